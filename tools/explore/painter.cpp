#include "explore/painter.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "qjulia/error.hpp"
#include "qjulia/map_file.hpp"

namespace qjulia::explore {

void Painter::show(Map map) {
  map_ = std::move(map);
  turned_text_ = "none";
  studios_.remove_if([](const Kept& kept) { return !kept.is_of_mesh; });
}

const Map& Painter::turned(const ViewRequest& view) {
  if (turned_text_ == view.knobs_text) return turned_;
  turned_text_ = "none";
  turned_ = with_knobs(device_, map_, view.knobs);
  turned_text_ = view.knobs_text;
  return turned_;
}

Studio Painter::new_studio(const ViewRequest& view, const std::stop_token& stop) {
  PictureOptions options = view.picture;
  options.keep_loose = keep_loose_;
  if (view.shows_mesh) {
    if (mesh_ == nullptr) throw InputError("there is no mesh here, but a map");
    return {device_, *mesh_, mesh_->box(), options};
  }
  if (view.is_draft) return Studio::of_drafts(device_, turned(view), options, stop);
  return {device_, turned(view), options, stop};
}

Studio& Painter::studio(const ViewRequest& view, const std::stop_token& stop) {
  const auto found = std::ranges::find(studios_, view.studio_text, &Kept::text);
  if (found != studios_.end()) {
    studios_.splice(studios_.begin(), studios_, found);
  } else {
    studios_.push_front({view.studio_text, view.shows_mesh, new_studio(view, stop)});
    if (studios_.size() > kMostStudios) studios_.pop_back();
  }
  return studios_.front().studio;
}

std::string Painter::picture(const ViewRequest& view, const ProgressMonitor& monitor) {
  Studio& seen = studio(view, monitor.stop);
  seen.resize(view.picture.width, view.picture.height);
  return png_bytes(seen.picture(view.picture.camera, monitor), {}, Packing::quick);
}

std::string Painter::map_file(const ViewRequest& view) {
  Map map = turned(view);
  map.provenance.set("turned", {{"page", view.knobs_text}});
  return to_json(map).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace qjulia::explore

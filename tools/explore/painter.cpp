#include "explore/painter.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "qjulia/error.hpp"
#include "qjulia/map_file.hpp"

namespace qjulia::explore {

void Painter::show(RationalMap map) {
  map_ = std::move(map);
  turned_text_ = "none";
  studios_.remove_if([](const Kept& kept) { return !kept.is_of_mesh; });
}

const RationalMap& Painter::turned(const ViewRequest& view) {
  if (turned_text_ == view.knobs_text) return turned_;
  turned_text_ = "none";
  turned_ = with_knobs(device_, map_, view.knobs);
  turned_text_ = view.knobs_text;
  return turned_;
}

Studio Painter::new_studio(const ViewRequest& view) {
  // The next request may well want this studio: only the end of everything stops it.
  PictureOptions options = view.picture;
  options.keep_loose = keep_loose_;
  if (!view.shows_mesh) return {device_, turned(view), options, end_};
  if (mesh_ == nullptr) throw InputError("there is no mesh here, but a map");
  return {device_, *mesh_, mesh_->box(), options};
}

Studio& Painter::studio(const ViewRequest& view) {
  const auto found = std::ranges::find(studios_, view.studio_text, &Kept::text);
  if (found != studios_.end()) {
    studios_.splice(studios_.begin(), studios_, found);
  } else {
    studios_.push_front({view.studio_text, view.shows_mesh, new_studio(view)});
    if (studios_.size() > kMostStudios) studios_.pop_back();
  }
  return studios_.front().studio;
}

std::string Painter::picture(const ViewRequest& view, const std::stop_token& stop) {
  ProgressMonitor monitor;
  monitor.stop = stop;
  return png_bytes(studio(view).picture(view.picture.camera, monitor));
}

std::string Painter::map_file(const ViewRequest& view) {
  RationalMap map = turned(view);
  map.provenance.set("turned", {{"page", view.knobs_text}});
  return to_json(map).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace qjulia::explore

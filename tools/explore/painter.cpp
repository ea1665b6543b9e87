#include "explore/painter.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "qjulia/map_file.hpp"

namespace qjulia::explore {

const RationalMap& Painter::turned(const ViewRequest& view) {
  if (turned_text_ == view.knobs_text) return turned_;
  turned_text_ = "none";
  turned_ = with_knobs(device_, map_, view.knobs);
  turned_text_ = view.knobs_text;
  return turned_;
}

Studio& Painter::studio(const ViewRequest& view) {
  const auto found = std::ranges::find(studios_, view.studio_text, &Kept::text);
  if (found != studios_.end()) {
    studios_.splice(studios_.begin(), studios_, found);
  } else {
    // The next request may well want this studio: only the end of everything stops it.
    PictureOptions options = view.picture;
    options.keep_loose = keep_loose_;
    studios_.push_front({view.studio_text, Studio(device_, turned(view), options, end_)});
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

#include "explore/painter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "qjulia/base/error.hpp"
#include "qjulia/edit/painting.hpp"
#include "qjulia/edit/portal_choice.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::explore {

void Painter::show(Map map) {
  map_ = std::move(map);
  turned_text_ = range_text_ = "none";
  studios_.remove_if([](const Kept& kept) { return !kept.is_of_mesh; });
}

void Painter::show_mesh(const TriangleMesh* mesh) {
  studios_.remove_if([](const Kept& kept) { return kept.is_of_mesh; });
  mesh_ = mesh;
}

const Map& Painter::turned(const ViewRequest& view) {
  if (turned_text_ == view.knobs_text) return turned_;
  turned_text_ = "none";
  turned_ = with_knobs(device_, map_, view.knobs);
  turned_text_ = view.knobs_text;
  return turned_;
}

namespace {

/// The camera at a distance, and with a point to look at, that show the whole set from every
/// azimuth: a set that turns neither grows nor moves.
Camera steady(Studio& studio, const Camera& camera) {
  constexpr int kAround = 24;
  std::vector<Camera> around(kAround, camera);
  for (int i = 0; i < kAround; ++i) {
    around[static_cast<std::size_t>(i)].azimuth += 360.0 * i / kAround;
  }
  return studio.aimed(around).front();
}

}  // namespace

Studio Painter::new_studio(const ViewRequest& view, const std::stop_token& stop) {
  PictureOptions options = view.picture;
  options.keep_loose = options.keep_loose || keep_loose_;
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
  std::optional<Studio> own;
  Studio& seen =
      view.is_apart ? own.emplace(new_studio(view, monitor.stop)) : studio(view, monitor.stop);
  seen.resize(view.picture.width, view.picture.height);
  const Camera camera = view.is_steady ? steady(seen, view.picture.camera) : view.picture.camera;
  // While something moves, colours stay those of the last whole picture.
  const std::string shows = fmt::format("{}{} {}", view.knobs_text,
                                        to_string(view.picture.material), view.picture.iterations);
  if (!view.picture.range) {
    seen.set_range(view.is_draft && shows == range_text_ ? std::optional(range_) : std::nullopt);
  }
  const Image image = seen.picture(camera, monitor);
  if (!view.is_draft && !view.shows_mesh) {
    range_text_ = shows;
    range_ = seen.range();
  }
  return png_bytes(image, {}, Packing::quick);
}

std::vector<std::optional<Eigen::Vector3d>> Painter::points(
    const ViewRequest& view, const std::vector<Eigen::Vector2d>& places,
    const ProgressMonitor& monitor) {
  Studio& seen = studio(view, monitor.stop);
  const auto [width, height] = std::pair(view.picture.width, view.picture.height);
  seen.resize(width, height);
  const PictureLayers layers = seen.layered_picture(view.picture.camera, monitor).layers;
  const auto pixel = [](double share, int side) {
    return std::min(static_cast<std::size_t>(share * side), static_cast<std::size_t>(side - 1));
  };
  std::vector<std::optional<Eigen::Vector3d>> found;
  for (const Eigen::Vector2d& place : places) {
    const std::size_t at =
        pixel(place.y(), height) * static_cast<std::size_t>(width) + pixel(place.x(), width);
    // The ground has a position, too.
    const std::span<const float> mask(layers.mask.data() + 3 * at, 3);
    const Eigen::Vector3d position =
        Eigen::Vector3f(layers.position.data() + 3 * at).cast<double>();
    auto& point = found.emplace_back();
    if (mask[0] + mask[2] > 0 && position.allFinite()) point = position;
  }
  return found;
}

namespace {

/// The one copy that the brush plants. @param seen where, on the shape as its knobs turn it.
std::vector<Portal> planted(const Device& device, const Map& map, const BrushRequest& brush,
                            Eigen::Vector3d seen, const ProgressMonitor& monitor) {
  if (brush.view.knobs.rotate) {
    const Eigen::Vector3d origin = map.frame.shape_to_map.to_shape(Eigen::Vector3d::Zero());
    seen = origin + brush.view.knobs.rotate->matrix().transpose() * (seen - origin);
  }
  try {
    return planted_portals(device, map, seen, *brush.copy, monitor);
  } catch (const OptionError& error) {
    throw InputError(fmt::format("copy: {}", error.problem()));
  }
}

Paint painted_by(const Map& map, const BrushRequest& brush,
                 const std::vector<std::optional<Eigen::Vector3d>>& seen) {
  if (!map.frame.box) {
    throw InputError("the map does not say its \"box\": nothing says how large the brush is");
  }
  const double longest = map.frame.box->size().maxCoeff();
  if (brush.places.empty()) {
    return painted_over(map, {{map.frame.box->center(), 2 * longest, brush.share}});
  }
  std::vector<PaintBall> balls;
  for (const auto& point : seen) {
    if (point) balls.push_back({*point, brush.radius * longest, brush.share});
  }
  if (balls.empty()) throw InputError("the stroke missed the set; begin on it");
  return painted_over(map, balls);
}

}  // namespace

Map Painter::brushed(const BrushRequest& brush, const ProgressMonitor& monitor) {
  const MapKnobs& knobs = brush.view.knobs;
  if (!brush.copy && knobs.rotate && knobs.rotate->degrees != 0) {
    throw InputError("set 'rotate' to 0 before you paint: paint does not turn with the shape");
  }
  const auto seen = brush.places.empty() ? std::vector<std::optional<Eigen::Vector3d>>{}
                                         : points(brush.view, brush.places, monitor);
  Map map = map_;
  if (brush.copy) {
    if (!seen.front()) throw InputError("that click missed the set; click a point on it");
    map.layers.portals = planted(device_, map, brush, *seen.front(), monitor);
  } else {
    map.layers.paint = painted_by(map, brush, seen);
  }
  with_knobs(device_, map, knobs);  // @throws where the map does not bear both
  nlohmann::json provenance = map.provenance.json();
  provenance.erase("job");  // it makes the map without the brush
  provenance["brush"] = provenance.value("brush", 0) + 1;
  map.provenance = provenance;
  return map;
}

std::string Painter::map_file(const ViewRequest& view) {
  Map map = turned(view);
  map.provenance.set("turned", {{"page", view.knobs_text}});
  return to_json(map).dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace qjulia::explore

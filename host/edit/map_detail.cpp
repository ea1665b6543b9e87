#include "qjulia/edit/map_detail.hpp"

#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/mesh/radial_spread.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia {

double detail_for(const Device& device, const Map& map, DetailWord word,
                  const std::stop_token& stop) {
  constexpr int kShapeCells = 128;
  with_detail(map, kLeastDetail);  // throws where no detail can be had
  SurfaceOptions options;
  options.iterations = 1;
  options.resolution = kShapeCells;
  ProgressMonitor monitor;
  monitor.stop = stop;
  const TriangleMesh mesh = extract_surface(device, without_portals(map), options, monitor);
  if (mesh.triangles.empty()) {
    throw OptionError("detail",
                      "the map's own shape is empty, so a word cannot be used; give a "
                      "number");
  }
  const bool is_exact = std::holds_alternative<DistanceModulus>(map.dynamics.modulus);
  RadialSpread spread =
      radial_spread(mesh, map.frame.shape_to_map.to_shape(Eigen::Vector3d::Zero()));
  double diagonal = mesh.box().diagonal();
  if (map.frame.diagonal) {  // the shape has been turned, and its box had other sides before
    diagonal = *map.frame.diagonal;
    if (map.frame.box) spread.longest_side = longest_side(map) / diagonal;
  }
  const double detail = chosen_detail(word, spread, is_exact ? kExactRule : kFittedRule);
  // The box in the map need not be that of its surface.
  return detail * diagonal / map.frame.own_diagonal().value_or(diagonal);
}

}  // namespace qjulia

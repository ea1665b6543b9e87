#include "fit/finish_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "qjulia/detail.hpp"
#include "qjulia/field.hpp"

namespace qjulia::fitting {
namespace {

constexpr std::size_t kCalibrationPoints = 20'000;
constexpr double kGoodFit = 0.9;    ///< IoU
constexpr double kDeepEnough = -2;  ///< F₁ at the origin

std::vector<Eigen::Vector3d> positions(const std::vector<SurfacePoint>& points) {
  std::vector<Eigen::Vector3d> found;
  for (std::size_t i = 0; i < std::min(kCalibrationPoints, points.size()); ++i) {
    found.push_back(points[i].position);
  }
  return found;
}

/// About how far the map's own surface is from each point, over the diagonal of the shape's box:
/// |F₁ - L| over the mean slope.
std::vector<double> distances(const Device& device, const Map& map,
                              const std::vector<Eigen::Vector3d>& surface) {
  const Field field(device, map);
  const double diagonal = map.frame.shape_to_map.scale * map.frame.box->diagonal();
  const double unit = shell_thickness(field, surface, map.dynamics.slice) / diagonal;
  std::vector<double> found = field.at(on_slice(surface, map.dynamics.slice));
  for (double& f : found) f = unit * std::abs(f - map.dynamics.surface_level);
  return found;
}

/// How poor the fit is and where the surface is missed most.
std::string poor_fit(const Device& device, const Map& map, double iou,
                     const std::vector<Eigen::Vector3d>& surface) {
  const auto off = distances(device, map, surface);
  const auto worst = std::ranges::max_element(off);
  const Eigen::Vector3d where =
      map.frame.shape_to_map.to_shape(surface[static_cast<std::size_t>(worst - off.begin())]);
  return fmt::format(
      "the fit reaches an IoU of {:.2f} only; it is farthest off the surface, by about {:.2g} % of "
      "the diagonal, near ({:.4g}, {:.4g}, {:.4g}). More factors or more time follow the shape "
      "more closely",
      iou, 100 * *worst, where.x(), where.y(), where.z());
}

/// The map with the wanted shell, or the thickest that bounds its set well; a map that no shell
/// bounds keeps its slope.
Map with_shell(const Device& device, const Map& map, const std::vector<Eigen::Vector3d>& surface,
               double detail) {
  constexpr double kLeastDegree = 1.1;  // at 1 the set is unbounded
  Map measured = with_measured_detail(device, map, surface);
  if (measured.dynamics.degree() <= 0) return measured;
  const double thickest = *measured.frame.detail * measured.dynamics.degree();
  return with_detail(measured, detail < 0.999 * thickest ? detail : thickest / kLeastDegree);
}

}  // namespace

Map finish_map(const Device& device, Map map, double iou, const Shape& shape,
               const SamplePool& pool, double detail, std::vector<std::string>& warnings) {
  const auto surface = positions(pool.surface);
  if (map.frame.detail) return with_shell(device, map, surface, detail);
  map.frame.shape_to_map = shape.shape_to_map;
  map.frame.box = shape.box;
  map.frame.inradius = shape.inradius / shape.shape_to_map.scale;
  map.dynamics.log_scale -= median_level(Field(device, map), surface, map.dynamics.slice);
  if (iou < kGoodFit) warnings.push_back(poor_fit(device, map, iou, surface));
  map = with_shell(device, map, surface, detail);

  const std::vector<Quaternion> origin{{0, 0, 0, map.dynamics.slice}};
  const auto at_origin = [&] { return Field(device, map).at(origin).front(); };
  if (const double above = at_origin(); above >= map.dynamics.surface_level) {
    warnings.push_back(
        fmt::format("the field at the origin is {:.2f}, above the surface's: the fit does not hold "
                    "the shape's deepest point inside, and iteration will not keep the shape; use "
                    "more factors or more time, and look for surfaces inside the mesh",
                    above));
    return map;
  }
  map = calibrated(device, map);
  if (map.dynamics.degree() <= 0) {
    warnings.push_back(
        fmt::format("the exponents sum to {:.3g}: no detail bounds the iterated set; use more "
                    "time, another number of factors or another seed",
                    map.dynamics.degree()));
  } else if (const double depth = at_origin(); depth > kDeepEnough) {
    warnings.push_back(
        fmt::format("the field at the origin is {:.2f}, above {}: the iterated set is near "
                    "dissolving; use a smaller detail",
                    depth, kDeepEnough));
  }
  return map;
}

double mean_distance(const Device& device, const Map& map, const SamplePool& pool) {
  const auto all = distances(device, map, positions(pool.surface));
  return std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
}

}  // namespace qjulia::fitting

#include "fit/finish_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "fit/far_field.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/field.hpp"

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

/// About how far a finished map's own surface is from each point, over the diagonal of the shape's
/// box: |F₁ - L| over the mean slope, both of steepness 1.
std::vector<double> distances(const Device& device, Map map,
                              const std::vector<Eigen::Vector3d>& surface) {
  map.layers.steepness = 1;
  const Field field(device, map);
  const double diagonal = map.frame.shape_to_map.scale * map.frame.own_diagonal().value();
  const double unit = shell_thickness(field, surface, map.dynamics.slice) / diagonal;
  std::vector<double> found = field.at(on_slice(surface, map.dynamics.slice));
  for (double& f : found) f = unit * std::abs(f - map.dynamics.surface_level);
  return found;
}

/// The map with the wanted shell, or with the thickest that bounds its set well.
Map in_shell(const Map& map, double detail) {
  constexpr double kLeastDegree = 1.1;  // at 1 the set is unbounded
  const double thickest = *map.frame.detail * map.dynamics.degree();
  return with_detail(map, detail < 0.999 * thickest ? detail : thickest / kLeastDegree);
}

double field_at_origin(const Device& device, const Map& map) {
  const std::vector<Quaternion> origin{{0, 0, 0, map.dynamics.slice}};
  return Field(device, map).at(origin).front();
}

bool holds_origin(const Device& device, const Map& map) {
  return field_at_origin(device, map) < map.dynamics.surface_level;
}

/// The map with the wanted shell, calibrated where it was not before and its origin is inside.
/// Samples lie near the shape, so a fit may leave a field that does not rise enough beyond them,
/// even exponents that sum to less than 0. Then roots beyond twice the shape's distance are left
/// out, and the sum is raised to the first with which all points beyond that distance escape and
/// the shell is the wanted one. Warnings say so, and if there is none.
Map with_shell(const Device& device, const Map& map, const std::vector<Eigen::Vector3d>& surface,
               double detail, std::vector<std::string>& warnings) {
  constexpr double kFirstDegree = 1.5, kNextDegree = 1.5;
  constexpr int kTries = 6;
  const bool was_finished = map.frame.detail.has_value();
  const Map measured = with_measured_detail(device, map, surface);
  const double enlarged = *measured.frame.detail / detail;
  const bool held_origin = holds_origin(device, measured);
  const auto is_wanted = [&](const Map& found) {
    return *found.frame.detail > 0.999 * detail && ends_near_shape(device, found) &&
           holds_origin(device, found) == held_origin;
  };
  const auto calibrated_inside = [&](const Map& found) {
    return holds_origin(device, found) ? calibrated(device, found) : found;
  };
  std::optional<Map> first;
  if (measured.dynamics.degree() > 0) {
    const Map shelled = in_shell(measured, detail);
    first = was_finished ? shelled : calibrated_inside(shelled);
    if (is_wanted(*first)) return *first;
  }
  double degree = std::max(kFirstDegree, enlarged * measured.dynamics.degree());
  for (int i = 0; i < kTries; ++i, degree *= kNextDegree) {
    const Map raised = with_raised_degree(measured, surface, degree / enlarged);
    Map found = calibrated_inside(in_shell(with_measured_detail(device, raised, surface), detail));
    if (is_wanted(found)) {
      warnings.emplace_back(
          "the fit left a field that rises too little outside the shape; its exponents were "
          "changed so that the iterated set ends near the shape");
      return found;
    }
    if (!first) first = std::move(found);
  }
  if (!ends_near_shape(device, *first)) {
    warnings.emplace_back(
        "the field rises too little outside the shape: the iterated set reaches far beyond it; use "
        "more factors, more time or another seed");
  }
  return *first;
}

}  // namespace

Map finish_map(const Device& device, Map map, const Shape& shape, const SamplePool& pool,
               double detail, std::vector<std::string>& warnings) {
  const auto surface = positions(pool.surface);
  if (!map.frame.detail) {
    map.frame.shape_to_map = shape.shape_to_map;
    map.frame.box = shape.box;
    map.frame.inradius = shape.inradius / shape.shape_to_map.scale;
    map.dynamics.log_scale -= median_level(Field(device, map), surface, map.dynamics.slice);
  }
  map = with_shell(device, map, surface, detail, warnings);
  const double depth = field_at_origin(device, map);
  if (depth >= map.dynamics.surface_level) {
    warnings.push_back(
        fmt::format("the field at the origin is {:.2f}, above the surface's: the fit does not hold "
                    "the shape's deepest point inside, and iteration will not keep the shape; use "
                    "more factors or more time, and look for surfaces inside the mesh",
                    depth));
  } else if (depth > kDeepEnough) {
    warnings.push_back(
        fmt::format("the field at the origin is {:.2f}, above {}: the iterated set is near "
                    "dissolving; use a smaller detail",
                    depth, kDeepEnough));
  }
  return map;
}

std::string poor_fit(const Device& device, const Map& map, double iou, const SamplePool& pool) {
  if (iou >= kGoodFit) return {};
  const auto surface = positions(pool.surface);
  const auto off = distances(device, map, surface);
  const auto worst = std::ranges::max_element(off);
  const Eigen::Vector3d where =
      map.frame.shape_to_map.to_shape(surface[static_cast<std::size_t>(worst - off.begin())]);
  return fmt::format(
      "the fit reaches an IoU of {:.2f} only; it is farthest from the surface, by about {:.2g} % "
      "of the diagonal, near ({:.4g}, {:.4g}, {:.4g}). More factors or more time follow the shape "
      "more closely",
      iou, 100 * *worst, where.x(), where.y(), where.z());
}

double mean_distance(const Device& device, const Map& map, const SamplePool& pool) {
  const auto all = distances(device, map, positions(pool.surface));
  return std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
}

}  // namespace qjulia::fitting

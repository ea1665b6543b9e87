#include "qjulia/compare.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "map/box_option.hpp"
#include "qjulia/error.hpp"
#include "qjulia/shape.hpp"
#include "qjulia/shared/map_layout.h"
#include "surface/overlap.hpp"
#include "surface/set_surface.hpp"

namespace qjulia {
namespace {

constexpr int kMostCells = 1024;
constexpr std::size_t kSurfaceSamples = 30000;
constexpr std::uint64_t kSeed = 1;

bool holds(const std::optional<Box>& part, const Eigen::Vector3d& x) {
  return !part ||
         ((x.array() >= part->low.array()).all() && (x.array() <= part->high.array()).all());
}

/// Of the triangles whose middle lies in the part.
double area(const TriangleMesh& mesh, const std::optional<Box>& part) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& origin = mesh.vertices[a];
    if (!holds(part, (origin + mesh.vertices[b] + mesh.vertices[c]) / 3)) continue;
    sum += 0.5 * (mesh.vertices[b] - origin).cross(mesh.vertices[c] - origin).norm();
  }
  return sum;
}

struct DistanceSummary {
  double mean = 0;
  double within_95 = 0;  ///< the 95th percentile
  double largest = 0;
};

/// From points of a surface to another mesh.
DistanceSummary distance_between(const std::vector<Eigen::Vector3d>& points,
                                 const SignedDistance& to) {
  std::vector<double> distances = to.at(points);
  for (double& d : distances) d = std::abs(d);
  const auto count = static_cast<double>(distances.size());
  const auto at_95 = distances.begin() + static_cast<std::ptrdiff_t>(0.95 * count);
  std::ranges::nth_element(distances, at_95);
  return {std::reduce(distances.begin(), distances.end()) / count, *at_95,
          std::ranges::max(distances)};
}

/// A mesh as far as surfaces are compared; its points and area are those of the part.
struct SampledMesh {
  SignedDistance distance;
  std::vector<Eigen::Vector3d> points;
  double area;

  SampledMesh(const TriangleMesh& mesh, const SignedDistance& to_mesh,
              const std::optional<Box>& part)
      : distance(to_mesh), area(qjulia::area(mesh, part)) {
    for (const SurfacePoint& point : sample_surface(mesh, kSurfaceSamples, kSeed)) {
      if (holds(part, point.position)) points.push_back(point.position);
    }
  }
};

/// Fills what is measured between surfaces; without a surface of the set there is no distance.
void compare_surfaces(const Device& device, const TriangleMesh& set, const SampledMesh& mesh,
                      const std::optional<Box>& part, double diagonal, FitMetrics& metrics) {
  std::optional<SampledMesh> sampled;
  if (!set.triangles.empty()) sampled.emplace(set, SignedDistance(device, set), part);
  if (!sampled || sampled->points.empty()) {
    metrics.mean_distance = metrics.distance_95 = metrics.hausdorff_distance =
        std::numeric_limits<double>::quiet_NaN();
    return;
  }
  metrics.roughness = sampled->area / mesh.area;
  const auto there = distance_between(sampled->points, mesh.distance);
  const auto back = distance_between(mesh.points, sampled->distance);
  metrics.mean_distance = 0.5 * (there.mean + back.mean) / diagonal;
  metrics.distance_95 = std::max(there.within_95, back.within_95) / diagonal;
  metrics.hausdorff_distance = std::max(there.largest, back.largest) / diagonal;
}

/// Coefficient of variation of ‖∇F_1‖ over points of the shape, in its own coordinates.
double slope_variation(const Device& device, const RationalMap& map,
                       std::vector<Eigen::Vector3d> points) {
  for (auto& x : points) x = map.shape_to_map.to_map(x);
  double sum = 0, squares = 0;
  for (const Quaternion& g : Field(device, map).gradient_at(on_slice(points, map.slice))) {
    const double slope = std::hypot(g.x, g.y, g.z);
    sum += slope;
    squares += slope * slope;
  }
  const double mean = sum / static_cast<double>(points.size());
  return std::sqrt(std::max(0.0, squares / static_cast<double>(points.size()) - mean * mean)) /
         mean;
}

}  // namespace

void CompareOptions::validate() const {
  if (resolution < 8 || resolution > kMostCells) {
    throw InputError(
        fmt::format("--resolution {} is out of range; give 8 … {} cells", resolution, kMostCells));
  }
  if (iterations < 1 || iterations > QJ_MOST_ITERATIONS) {
    throw InputError(fmt::format("--iterations {} is out of range; give 1 … {}", iterations,
                                 QJ_MOST_ITERATIONS));
  }
  expect_box(box);
}

std::vector<FitMetrics> compare(const Device& device, const RationalMap& map,
                                const TriangleMesh& mesh, const CompareOptions& options,
                                const Watch& watch) {
  options.validate();
  map.validate();
  const StopRadii stops = find_stop_radii(device, map, options.escape);
  std::vector<int> iterations{1};
  if (options.iterations > 1) iterations.push_back(options.iterations);
  const auto steps = static_cast<double>(1 + iterations.size());
  const auto report = [&](double done) { watch.report({"comparing", done / steps, -1, ""}); };

  report(0);
  const OuterSurface outer = outer_surface(device, mesh);
  const CubeSamples cube = sample_cube(outer.distance, mesh.box(), map.shape_to_map,
                                       options.resolution, options.box, watch);
  const SampledMesh sampled(outer.mesh, outer.distance, options.box);
  if (sampled.points.empty()) {
    throw InputError("--box holds nothing of the mesh's surface; give a part that it runs through");
  }
  const double variation = slope_variation(device, map, sampled.points);
  const Watch quiet{{}, watch.stop};
  std::vector<FitMetrics> all;
  for (const int n : iterations) {
    report(static_cast<double>(all.size() + 1));
    FitMetrics metrics;
    metrics.iterations = n;
    metrics.slope_variation = variation;
    const auto shared =
        overlap({device, map, stops, n, options.precision}, map.surface_level, cube, watch);
    metrics.iou = shared.iou;
    metrics.energy = shared.energy;
    SurfaceOptions surface;
    surface.resolution = options.resolution;
    surface.iterations = n;
    surface.precision = options.precision;
    MeshSink set;
    set_surface(device, map, stops, surface, set, quiet);
    compare_surfaces(device, set.mesh, sampled, options.box, mesh.box().diagonal(), metrics);
    all.push_back(metrics);
  }
  report(steps);
  return all;
}

nlohmann::json to_json(const FitMetrics& metrics) {
  return {{"iterations", metrics.iterations},
          {"iou", metrics.iou},
          {"mean_distance", metrics.mean_distance},
          {"distance_95", metrics.distance_95},
          {"hausdorff_distance", metrics.hausdorff_distance},
          {"energy", metrics.energy},
          {"roughness", metrics.roughness},
          {"slope_variation", metrics.slope_variation}};
}

}  // namespace qjulia

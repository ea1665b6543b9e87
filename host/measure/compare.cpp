#include "qjulia/surface/compare.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>

#include "lattice/level_set.hpp"
#include "map/checks.hpp"
#include "measure/limbs.hpp"
#include "mesh/overlap.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/mesh/shape.hpp"
#include "qjulia/surface/compare_settings.hpp"

namespace qjulia {

using namespace surface;
namespace {

constexpr std::size_t kSurfaceSamples = 30000;
constexpr std::uint64_t kComparisonSeed = 1;
constexpr double kSharpness = 10;  // α
constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();
constexpr double kShortestLimb = 0.1;  // times the mesh's longest side

/// Cell centres of a cube about a mesh, and the mesh's signed distance there.
struct CubeSamples {
  Grid grid;                     ///< the centres, map units
  std::vector<double> distance;  ///< from the mesh, negative inside, in its own units; x fastest
  double cell = 0;               ///< side of a cell, the mesh's units
};

/// `resolution` cells along the longest side of `part`, or where there is none, `resolution`³ of
/// the cube about the box `about`.
/// @param distance of the mesh.
/// @param part the mesh's units.
CubeSamples sample_cube(const SignedDistance& distance, const Box& about,
                        const ShapeToMap& shape_to_map, int resolution,
                        const std::optional<Box>& part, const ProgressMonitor& monitor) {
  const Box box = part.value_or(shape::cube_to_count(about));
  CubeSamples samples;
  samples.cell = box.size().maxCoeff() / resolution;
  const Eigen::Array3d cells = (box.size() / samples.cell).array().round().max(1.0);
  const Grid centers{box.center() - 0.5 * samples.cell * (cells - 1).matrix(), samples.cell,
                     cells.cast<int>()};
  samples.grid = {shape_to_map.to_map(centers.origin), shape_to_map.scale * samples.cell,
                  centers.points};

  std::vector<Eigen::Vector3d> slice;
  for (int z = 0; z < centers.points.z(); ++z) {
    throw_if_stopped(monitor.stop);
    slice.clear();
    for_points(slices(centers, z, 1).count, [&](std::size_t, const Eigen::Vector3i& at) {
      slice.push_back(centers.point({at.x(), at.y(), z}));
    });
    const auto values = distance.at(slice, monitor.stop);
    samples.distance.insert(samples.distance.end(), values.begin(), values.end());
  }
  return samples;
}

/// Sums over the cells on one side of the mesh.
struct EnergySum {
  double weight = 0;
  double agreement = 0;  ///< Σ w s tanh(α (F_n − L))

  double mean() const { return weight > 0 ? agreement / weight : 0; }
};

/// Fills IoU and energy of the set F_n < `level` against the mesh. @return which of the centres are
/// in the set.
std::vector<bool> compare_volumes(const LevelSet& set, double level, const CubeSamples& samples,
                                  const ProgressMonitor& monitor, FitMetrics& metrics) {
  shape::Overlap overlap;
  EnergySum outside, inside;
  std::size_t index = 0;
  std::vector<bool> in_set;
  in_set.reserve(samples.distance.size());
  const int at_once = slices_at_once(samples.grid);
  for (int z = 0; z < samples.grid.points[2]; z += at_once) {
    throw_if_stopped(monitor.stop);
    const int count = std::min(at_once, samples.grid.points[2] - z);
    for (const float value : set.over(samples.grid, slices(samples.grid, z, count))) {
      const double distance = samples.distance[index++];
      const double field = static_cast<double>(value) - level;
      const bool in_mesh = distance < 0;
      overlap.add(in_mesh, field < 0);
      in_set.push_back(field < 0);
      const double weight = 1 / std::max(std::abs(distance), 0.5 * samples.cell);
      EnergySum& side = in_mesh ? inside : outside;
      side.weight += weight;
      side.agreement += (in_mesh ? -weight : weight) * std::tanh(kSharpness * field);
    }
  }
  const bool mesh_has_cells = inside.weight > 0;
  metrics.iou = mesh_has_cells ? overlap.iou() : kUndefined;
  metrics.energy = mesh_has_cells ? -0.5 * (outside.mean() + inside.mean()) : kUndefined;
  return in_set;
}

/// Limbs of the mesh, map units; ways begin at the map's origin.
std::vector<Limb> limbs_of(const CubeSamples& samples, double longest_side) {
  std::vector<bool> in_mesh;
  for (const double distance : samples.distance) in_mesh.push_back(distance < 0);
  return find_limbs(samples.grid, in_mesh, kShortestLimb * longest_side);
}

bool holds(const std::optional<Box>& part, const Eigen::Vector3d& x) {
  return !part || Eigen::AlignedBox3d(part->low, part->high).contains(x);
}

double area(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& origin = mesh.vertices[a];
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
                                 const SignedDistance& to, const std::stop_token& stop) {
  std::vector<double> distances = to.at(points, stop);
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
  double area;  ///< the whole area times the share of points that lie in the part

  SampledMesh(const TriangleMesh& mesh, const SignedDistance& to_mesh,
              const std::optional<Box>& part)
      : distance(to_mesh) {
    const auto samples = sample_surface(mesh, kSurfaceSamples, kComparisonSeed);
    for (const SurfacePoint& point : samples) {
      if (holds(part, point.position)) points.push_back(point.position);
    }
    area = qjulia::area(mesh) *
           (static_cast<double>(points.size()) / static_cast<double>(samples.size()));
  }
};

/// Fills what is measured between surfaces; without a surface of the set there is no distance.
void compare_surfaces(const Device& device, const TriangleMesh& set, const SampledMesh& mesh,
                      const std::optional<Box>& part, double diagonal, const std::stop_token& stop,
                      FitMetrics& metrics) {
  std::optional<SampledMesh> sampled;
  if (!set.triangles.empty()) {
    sampled.emplace(set, SignedDistance(device, set, Precision::single, stop), part);
  }
  if (!sampled || sampled->points.empty()) {
    metrics.mean_distance = metrics.distance_95 = metrics.hausdorff_distance = kUndefined;
    if (std::isnan(metrics.iou)) metrics.roughness = kUndefined;
    return;
  }
  metrics.roughness = sampled->area / mesh.area;
  const auto there = distance_between(sampled->points, mesh.distance, stop);
  const auto back = distance_between(mesh.points, sampled->distance, stop);
  metrics.mean_distance = 0.5 * (there.mean + back.mean) / diagonal;
  metrics.distance_95 = std::max(there.within_95, back.within_95) / diagonal;
  metrics.hausdorff_distance = std::max(there.largest, back.largest) / diagonal;
}

/// Coefficient of variation of ‖∇F_1‖ over points of the shape, in its own coordinates.
double slope_variation(const Device& device, Map map, std::vector<Eigen::Vector3d> points) {
  map.layers.steepness = 1;  // the points lie on both sides of where F gets steeper
  map.layers.portals.clear();
  map.layers.paint.reset();
  for (auto& x : points) x = map.frame.shape_to_map.to_map(x);
  double sum = 0, squares = 0;
  for (const Quaternion& g : Field(device, map).gradient_at(on_slice(points, map.dynamics.slice))) {
    const double slope = std::hypot(g.x, g.y, g.z);
    sum += slope;
    squares += slope * slope;
  }
  const double mean = sum / static_cast<double>(points.size());
  if (!(mean > 0)) return kUndefined;
  return std::sqrt(std::max(0.0, squares / static_cast<double>(points.size()) - mean * mean)) /
         mean;
}

}  // namespace

void CompareOptions::validate() const {
  expect_in_ranges(compare_settings(), *this);
  map::expect_box(box);
  if (limbs && box)
    throw OptionError("limbs", "they are counted of all the mesh; leave the box out");
}

std::vector<FitMetrics> compare(const Device& device, const Map& map, const TriangleMesh& mesh,
                                const CompareOptions& options, const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  mesh.validate();
  const StopRadii stops = find_stop_radii(device, map, options.escape, monitor.stop);
  std::vector<int> iterations{1};
  if (options.iterations > 1) iterations.push_back(options.iterations);
  const auto steps = static_cast<double>(1 + iterations.size());
  const auto report = [&](double done) { monitor.report({"comparing", done / steps, -1, ""}); };

  report(0);
  const OuterSurface outer = outer_surface(device, mesh, monitor.stop);
  const CubeSamples cube = sample_cube(outer.distance, mesh.box(), map.frame.shape_to_map,
                                       options.resolution, options.box, monitor);
  const SampledMesh sampled(outer.mesh, outer.distance, options.box);
  if (sampled.points.empty()) {
    throw OptionError(
        "box", "it holds no part of the mesh's surface; give a box that the surface runs through");
  }
  std::vector<Limb> limbs;
  if (options.limbs)
    limbs = limbs_of(cube, map.frame.shape_to_map.scale * mesh.box().size().maxCoeff());
  const double variation = slope_variation(device, map, sampled.points);
  const ProgressMonitor quiet{{}, monitor.stop};
  std::vector<FitMetrics> all;
  for (const int n : iterations) {
    report(static_cast<double>(all.size() + 1));
    FitMetrics metrics;
    metrics.iterations = n;
    metrics.slope_variation = variation;
    const LevelSet level_set(device, map, stops, n, options.precision);
    const std::vector<bool> in_set =
        compare_volumes(level_set, map.dynamics.surface_level, cube, monitor, metrics);
    if (options.limbs) {
      metrics.limbs = static_cast<int>(limbs.size());
      metrics.limbs_kept = limbs_kept(limbs, cube.grid, in_set);
    }
    const SurfaceOptions surface{.resolution = options.resolution,
                                 .iterations = n,
                                 .exact = true,
                                 .precision = options.precision};
    MeshSink set;
    level_set_surface(device, map, stops, surface, set, quiet);
    compare_surfaces(device, set.mesh, sampled, options.box, mesh.box().diagonal(), monitor.stop,
                     metrics);
    all.push_back(metrics);
  }
  report(steps);
  return all;
}

std::string why_undefined(const FitMetrics& metrics) {
  if (std::isnan(metrics.iou)) {
    return "no cell's centre lies in the mesh, which is too thin for cells of this size; give a "
           "higher resolution";
  }
  if (std::isnan(metrics.mean_distance)) {
    return "the set has no surface on this grid; give less detail or fewer iterations, or a higher "
           "resolution where the set is thinner than a cell";
  }
  if (std::isnan(metrics.slope_variation)) {
    return "the potential is flat all over the mesh's surface; give the mesh that the map was made "
           "for";
  }
  return {};
}

nlohmann::json to_json(const FitMetrics& metrics) {
  nlohmann::json json{{"iterations", metrics.iterations},
                      {"iou", metrics.iou},
                      {"mean_distance", metrics.mean_distance},
                      {"distance_95", metrics.distance_95},
                      {"hausdorff_distance", metrics.hausdorff_distance},
                      {"energy", metrics.energy},
                      {"roughness", metrics.roughness},
                      {"slope_variation", metrics.slope_variation}};
  if (const std::string why = why_undefined(metrics); !why.empty()) json["undefined"] = why;
  if (metrics.limbs >= 0)
    json.update({{"limbs", metrics.limbs}, {"limbs_kept", metrics.limbs_kept}});
  return json;
}

}  // namespace qjulia

#include "qjulia/exact/exact_map.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "base/random.hpp"
#include "base/range_check.hpp"
#include "exact/distance_grid.hpp"
#include "exact/grid_cells.hpp"
#include "mesh/make_shape.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_settings.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/mesh/radial_spread.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia {

using exact::kMostGridCells;

namespace {

/// Roots of whole powers 2 … 13 at random points of the inside.
/// @param distances of points, map units.
std::vector<Factor> random_roots(const exact::Distances& distances, const Box& box,
                                 const RandomRoots& choice) {
  constexpr std::size_t kAtOnce = 4096;
  constexpr int kMostTries = 1000;
  base::Random random(choice.seed);
  std::vector<Factor> roots;
  const auto wanted = static_cast<std::size_t>(choice.roots);
  for (int tried = 0; tried < kMostTries && roots.size() < wanted; ++tried) {
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < kAtOnce; ++i) {
      const double x = random.uniform(box.low.x(), box.high.x());
      const double y = random.uniform(box.low.y(), box.high.y());
      points.emplace_back(x, y, random.uniform(box.low.z(), box.high.z()));
    }
    const std::vector<double> found = distances(points);
    for (std::size_t i = 0; i < kAtOnce && roots.size() < wanted; ++i) {
      if (found[i] >= 0) continue;
      const double power = 2 + static_cast<double>(random.index(12));
      roots.push_back({{points[i].x(), points[i].y(), points[i].z(), 0}, power});
    }
  }
  if (roots.size() < wanted) {
    throw InputError("the mesh has too little inside to place the versor's roots in");
  }
  return roots;
}

/// @param thickness of the shape's inside, cells.
void expect_cells(double thickness, int resolution) {
  if (thickness >= 1) return;
  const double needed = std::ceil(resolution / thickness);
  if (needed > kMostGridCells) {
    throw InputError("the shape is too thin for a grid: fit a map to it instead");
  }
  throw OptionError("resolution",
                    fmt::format("{} cells are too few for this shape, whose inside is {:.2g} of "
                                "them thick; give {} or more",
                                resolution, thickness, needed));
}

/// From another map's coordinates to this one's.
std::vector<Factor> moved(std::vector<Factor> factors, const ShapeToMap& from,
                          const ShapeToMap& to) {
  for (Factor& factor : factors) {
    Quaternion& c = factor.center;
    const Eigen::Vector3d x = to.to_map(from.to_shape(Eigen::Vector3d(c.x, c.y, c.z)));
    c = {x.x(), x.y(), x.z(), c.w * to.scale / from.scale};
  }
  return factors;
}

}  // namespace

void ExactMapOptions::validate() const {
  expect_in_ranges(exact_settings(), *this);
  if (const auto* random = std::get_if<RandomRoots>(&versor)) {
    base::expect_between("roots", random->roots, 1, RandomRoots::kMostRoots);
  } else if (const auto* noise = std::get_if<NoiseVersor>(&versor)) {
    noise->validate();
  } else if (std::get<FactorsOfMap>(versor).factors.empty()) {
    throw OptionError("versor", "it has no factors; give at least one");
  }
}

Map exact_map(const Device& device, const TriangleMesh& mesh, const ExactMapOptions& options,
              const ProgressMonitor& monitor) {
  options.validate();
  constexpr double kSteps = 4;
  int step = 0;
  const auto report = [&](const char* what) {
    throw_if_stopped(monitor.stop);
    monitor.report({what, step++ / kSteps, -1, ""});
  };
  report("preparing the mesh");
  const auto prepared = shape::make_shape_with_distance(device, mesh, monitor.stop);
  const Shape& shape = prepared.shape;
  const ShapeToMap& to_map = shape.shape_to_map;
  const exact::Distances distances = [&](std::span<const Eigen::Vector3d> points) {
    std::vector<Eigen::Vector3d> own(points.size());
    for (std::size_t i = 0; i < own.size(); ++i) own[i] = to_map.to_shape(points[i]);
    std::vector<double> found = prepared.distance.at(own, monitor.stop);
    for (double& d : found) d *= to_map.scale;
    return found;
  };
  const Box box = to_map.to_map(shape.box);

  report("sampling the distance");
  DistanceModulus modulus =
      exact::sampled_distance(distances, box, (options.resolution + 3) / 4 * 4, monitor.stop);
  expect_cells(2 * shape.inradius / modulus.step, options.resolution);
  const double detail =
      chosen_detail(options.detail, radial_spread(shape.mesh, Eigen::Vector3d::Zero()), kExactRule);
  modulus.shell = detail * box.diagonal();
  modulus.inradius = shape.inradius;
  modulus.fourth = options.fourth;

  report("placing the versor");
  Map map;
  map.dynamics.modulus = modulus;
  if (const auto* noise = std::get_if<NoiseVersor>(&options.versor)) {
    map.dynamics.versor = *noise;
  } else if (const auto* random = std::get_if<RandomRoots>(&options.versor)) {
    map.dynamics.factors = random_roots(distances, box, *random);
  } else {
    const auto& [factors, frame] = std::get<FactorsOfMap>(options.versor);
    map.dynamics.factors = moved(factors, frame, to_map);
  }
  map.dynamics.phase = options.phase;
  map.frame.shape_to_map = to_map;
  map.frame.detail = detail;
  map.layers.steepness = options.steepness;
  map.frame.up = options.up ? options.up : guess_up(mesh);
  map.frame.inradius = shape.inradius / to_map.scale;
  map.frame.box = shape.box;

  report("calibrating");
  return calibrated(device, map);
}

}  // namespace qjulia

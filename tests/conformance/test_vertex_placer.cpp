// Compares vertices on crossed edges with those of a plain search in double precision.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <random>
#include <vector>

#include "armed_ball.hpp"
#include "lattice/level_set.hpp"
#include "map/reference_iteration.hpp"
#include "qjulia/map/field.hpp"
#include "surface/vertex_placer.hpp"
#include "test_device.hpp"

using namespace qjulia;
using surface::DifferenceScale;
using surface::EdgeVertex;
using surface::VertexPlacer;

namespace {

const DifferenceScale kScale{0.5, 1.5};
constexpr int kIterations = 5;
constexpr double kDetail = 0.1;

/// A map whose surface jumps where orbits part. Its detail says how steep F_1 is.
Map jumpy_map() {
  Map map = test::armed_ball_map(40);
  for (Factor& factor : map.dynamics.factors) factor.exponent /= kDetail;
  map.dynamics.log_scale /= kDetail;
  map.dynamics.slice = 0.0625;
  map = calibrated(test::shared_device(), map);
  map.frame.detail = kDetail;
  map.frame.box = Box{{-0.3, -0.3, -0.3}, {0.3, 0.3, 0.4}};
  return map;
}

surface::Grid grid_of_cells(int cells) {
  surface::Grid grid;
  grid.origin = {-1.5, -1.25, -1.75};
  grid.step = 3.0 / cells;
  grid.points = Eigen::Vector3i::Constant(cells + 1);
  return grid;
}

/// The field at a point, and the number of the iterate that decided it.
struct Decided {
  double field;
  int iterate;
};

Decided decided(const Map& map, const StopRadii& stops, const Eigen::Vector3d& start) {
  const double log_escape = std::log(stops.escape);
  const double above = std::log(std::min(stops.outer, stops.escape));
  Quaternion q{start.x(), start.y(), start.z(), map.dynamics.slice};
  if (std::log(norm(q)) >= log_escape) return {std::log(norm(q)), 1};
  for (int m = 1;; ++m) {
    const reference::Step step = reference::step(map, q);
    if (m == kIterations || step.log_norm <= std::log(stops.inner) || step.log_norm >= above) {
      return {step.log_norm, m};
    }
    q = std::exp(step.log_norm) * step.versor;
  }
}

/// The search that kernels/place_vertices.cl describes, for one edge.
/// @param slope |∇F_1| per step; 0 if it is not known. @param stretch factor by which an iterate
///   stretches distances.
double searched(const Map& map, const StopRadii& stops, const surface::Grid& grid,
                const EdgeVertex& edge, int tries, double slope, double stretch) {
  struct End {
    double at, difference;
    int iterate = 0;  // 0 for a grid point: it is not known there
  };
  End start{0, edge.at_start}, end{1, edge.at_end};
  const auto vertex = [&] {
    double from_start, from_end;
    if (start.iterate > 0 && end.iterate > 0) {
      // Both are distances, in the same unit.
      from_start = std::abs(start.difference) / std::pow(stretch, start.iterate - 1);
      from_end = std::abs(end.difference) / std::pow(stretch, end.iterate - 1);
    } else {
      from_start = std::min(std::abs(start.difference), kScale.reach);
      from_end = std::min(std::abs(end.difference), kScale.reach);
    }
    return start.at + (end.at - start.at) * from_start / (from_start + from_end);
  };
  for (int i = 0; i < tries; ++i) {
    const double length = end.at - start.at;
    const double tried = std::clamp(vertex(), start.at + 0.25 * length, end.at - 0.25 * length);
    const Eigen::Vector3d index =
        edge.point.cast<double>() + tried * Eigen::Vector3d::Unit(edge.axis);
    const Decided found = decided(map, stops, grid.at(index));
    const double over = found.field - map.dynamics.surface_level;
    End& moved = (over < 0) == (edge.at_start < 0) ? start : end;
    moved = {tried, over < 0 ? over : over / kScale.steepness, found.iterate};
    if (slope == 0) continue;
    // Near enough to the boundary.
    const double close = 0.8 * std::pow(2.0, -tries);
    const auto distance = [&](const End& e) {
      return std::abs(e.difference) / (slope * std::pow(stretch, e.iterate - 1));
    };
    if (start.iterate > 0 && distance(start) < close) {
      return std::min(start.at + distance(start), end.at);
    }
    if (end.iterate > 0 && distance(end) < close) {
      return std::max(end.at - distance(end), start.at);
    }
  }
  return vertex();
}

/// Edges of the grid that the set's surface crosses, drawn at random.
std::vector<EdgeVertex> crossed_edges(const Device& device, const Map& map, const StopRadii& stops,
                                      const surface::Grid& grid) {
  const auto values =
      surface::LevelSet(device, map, stops, kIterations, Precision::single).over(grid, whole(grid));
  const auto at = [&](const Eigen::Vector3i& p) {
    const auto number =
        static_cast<std::size_t>((p.z() * grid.points.y() + p.y()) * grid.points.x() + p.x());
    const double over = double{values[number]} - map.dynamics.surface_level;
    return static_cast<float>(
        std::clamp(over > 0 ? over / kScale.steepness : over, -kScale.reach, kScale.reach));
  };
  std::vector<EdgeVertex> edges;
  for (int z = 0; z + 1 < grid.points.z(); ++z) {
    for (int y = 0; y + 1 < grid.points.y(); ++y) {
      for (int x = 0; x + 1 < grid.points.x(); ++x) {
        for (int axis = 0; axis < 3; ++axis) {
          EdgeVertex edge{{x, y, z}, axis};
          edge.at_start = at(edge.point);
          edge.at_end = at(edge.point + Eigen::Vector3i::Unit(axis));
          if ((edge.at_start < 0) != (edge.at_end < 0)) edges.push_back(edge);
        }
      }
    }
  }
  std::shuffle(edges.begin(), edges.end(), std::mt19937(1));
  edges.resize(std::min(edges.size(), test::sweep_size(4096)));
  return edges;
}

/// Where orbits in single and in double precision part, vertices lie in different places.
double share_apart(const std::vector<EdgeVertex>& found, const std::vector<double>& wanted,
                   double tolerance) {
  std::size_t apart = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!(std::abs(double{found[i].at} - wanted[i]) <= tolerance)) ++apart;
  }
  return static_cast<double>(apart) / static_cast<double>(found.size());
}

}  // namespace

TEST_CASE("vertices come to lie where a plain search in double puts them") {
  const auto variant = GENERATE(from_range(test::variants()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  const bool has_detail = GENERATE(true, false);
  const int tries = GENERATE(1, 2, 5);
  const Device device = variant.of(test::shared_device());
  if (!test::can_check(device, precision)) return;
  Map map = jumpy_map();
  if (!has_detail) map.frame.detail.reset();
  const StopRadii stops = find_stop_radii(device, map);
  const surface::Grid grid = grid_of_cells(24);
  std::vector<EdgeVertex> edges = crossed_edges(device, map, stops, grid);
  REQUIRE(edges.size() > 50);
  const double slope = has_detail ? 1 / (kDetail * map.frame.box->diagonal()) : 0;
  const double stretch =
      has_detail ? std::max(2.0, slope * std::exp(map.dynamics.surface_level)) : 12;
  std::vector<double> wanted;
  for (const EdgeVertex& edge : edges) {
    const double at = searched(map, stops, grid, edge, tries, slope * grid.step, stretch);
    constexpr double kMargin = surface::kVertexMargin;
    wanted.push_back(std::clamp(at, kMargin, 1 - kMargin));
  }
  VertexPlacer(device, map, stops, kIterations, precision, kScale, tries).place(grid, edges);
  CAPTURE(variant, precision, has_detail, tries, edges.size());
  CHECK(share_apart(edges, wanted, 1e-3) <= (precision == Precision::dbl ? 0.001 : 0.01));
  // They moved.
  const auto plain = [](const EdgeVertex& e) { return e.at_start / (e.at_start - e.at_end); };
  CHECK(std::ranges::count_if(edges, [&](const EdgeVertex& e) {
          return std::abs(e.at - plain(e)) > 0.05F;
        }) > static_cast<std::ptrdiff_t>(edges.size() / 4));
}

TEST_CASE("after many tries the set's side changes at every vertex") {
  const auto variant = GENERATE(from_range(test::variants()));
  const auto precision = GENERATE(Precision::single, Precision::dbl);
  const Device device = variant.of(test::shared_device());
  if (!test::can_check(device, precision)) return;
  const Map map = jumpy_map();
  const StopRadii stops = find_stop_radii(device, map);
  const surface::Grid grid = grid_of_cells(24);
  std::vector<EdgeVertex> edges = crossed_edges(device, map, stops, grid);
  VertexPlacer(device, map, stops, kIterations, precision, kScale, 20).place(grid, edges);
  std::size_t checked = 0, wrong = 0;
  for (const EdgeVertex& edge : edges) {
    // Vertices that would lie nearer to a grid point are moved.
    constexpr float kReach = 0.001F;
    if (edge.at < surface::kVertexMargin + kReach ||
        edge.at > 1 - surface::kVertexMargin - kReach) {
      continue;
    }
    const auto is_inside = [&](double at) {
      const Eigen::Vector3d index =
          edge.point.cast<double>() + at * Eigen::Vector3d::Unit(edge.axis);
      return decided(map, stops, grid.at(index)).field < map.dynamics.surface_level;
    };
    // The set may also end and begin again within the reach.
    constexpr int kProbes = 8;
    bool changes = false;
    for (int i = 0; i < kProbes; ++i) {
      const double at = double{edge.at} + kReach * (2.0 * (i + 0.5) / kProbes - 1);
      changes |= is_inside(at) != is_inside(at + 2.0 * kReach / kProbes);
    }
    ++checked;
    if (!changes) ++wrong;
  }
  CAPTURE(variant, precision, checked, wrong);
  CHECK(checked > edges.size() / 2);
  CHECK(static_cast<double>(wrong) <=
        (precision == Precision::dbl ? 0.002 : 0.01) * static_cast<double>(checked));
}

TEST_CASE("where a vertex comes to lie does not depend on the others") {
  const auto variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(test::shared_device());
  const Map map = jumpy_map();
  const StopRadii stops = find_stop_radii(device, map);
  const surface::Grid grid = grid_of_cells(16);
  const std::vector<EdgeVertex> edges = crossed_edges(device, map, stops, grid);
  const VertexPlacer placer(device, map, stops, kIterations, Precision::single, kScale, 3);
  std::vector<EdgeVertex> all = edges;
  placer.place(grid, all);
  constexpr std::size_t kApart = 3;
  std::vector<EdgeVertex> some;
  for (std::size_t i = 0; i < edges.size(); i += kApart) some.push_back(edges[i]);
  placer.place(grid, some);
  std::size_t different = 0;
  for (std::size_t i = 0; i < some.size(); ++i) {
    if (some[i].at != all[kApart * i].at) ++different;
  }
  CHECK(different == 0);
}

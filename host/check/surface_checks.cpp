#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/larger_error.hpp"
#include "base/random.hpp"
#include "check/checks.hpp"
#include "check/small_problems.hpp"
#include "check/unit_ball.hpp"
#include "device/point_batch.hpp"
#include "lattice/image_lattice.hpp"
#include "lattice/level_set.hpp"
#include "layout/image_lattice.h"
#include "layout/image_table.h"
#include "map/device_map.hpp"
#include "map/reference_iteration.hpp"
#include "profile/workload.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia::check {
namespace {

using base::larger_error;
using Eigen::Vector3d;
using profiling::kNoEscape;
using profiling::largest_difference;

constexpr int kBallCells = 48;

double level_set(const Device& device, Precision precision) {
  const Map map = small_work().map;
  const surface::Grid grid = small_grid();
  const surface::LevelSet set(device, map, {0, 0, kNoEscape}, kIterations, precision);
  const auto found = set.over(grid, {{0, 0, 0}, grid.points});
  return largest_difference(
      {found.begin(), found.end()},
      reference::field(map, grid_points(grid, map.dynamics.slice), kIterations, kNoEscape));
}

/// A mesh of the ball.
/// @param tries to place each vertex; with 0, vertices are where the field is interpolated.
TriangleMesh surface_of_ball(const Device& device, Precision precision, int tries, bool dense) {
  SurfaceOptions options;
  options.resolution = kBallCells;
  options.precision = precision;
  options.refine = tries;
  options.dense = dense;
  return extract_surface(device, unit_ball(), options);
}

/// How far vertices are from the ball, in cells.
double cells_off_ball(const TriangleMesh& mesh) {
  constexpr double kCell = 2.1 / kBallCells;
  double worst = mesh.vertices.empty() ? kInfinite : 0;
  for (const Vector3d& vertex : mesh.vertices) {
    worst = larger_error(worst, std::abs(vertex.norm() - 1) / kCell);
  }
  return worst;
}

/// Interpolated orbits give the same mesh as orbits that are run.
double interpolated_surface(const Device& device, Precision precision) {
  const TriangleMesh found = surface_of_ball(device, precision, 0, false);
  const TriangleMesh dense = surface_of_ball(device, precision, 0, true);
  if (found.vertices != dense.vertices || found.triangles != dense.triangles) return kInfinite;
  return cells_off_ball(found);
}

/// Vertices that are placed by tries on their edges lie on the ball.
double placed_vertices(const Device& device, Precision precision) {
  constexpr int kTries = 12;
  return cells_off_ball(surface_of_ball(device, precision, kTries, false));
}

/// How many cells are trusted or distrusted wrongly. F and U are linear, and their fourth
/// differences vanish, but for a few nodes at which one of them is wrong. Some others are not
/// stored.
double image_lattice(const Device& device, Precision precision) {
  const surface::Grid grid{Vector3d(-1, 0.5, 2), 0.25, {12, 8, 7}};
  constexpr std::size_t kEveryNode = 97;
  const auto is_wrong = [](std::size_t number) { return number % kEveryNode == 50; };
  const auto is_stored = [](std::size_t number) { return number % kEveryNode != 40; };
  std::vector<double> field, versors;
  surface::for_points(grid.points, [&](std::size_t number, const Eigen::Vector3i& at) {
    const Vector3d p = grid.point(at);
    field.push_back(p.dot(Vector3d(1, -2, 0.5)));
    for (const double slope : {0.5, 1.0, -1.0, 2.0}) versors.push_back(slope * p.sum());
    if (is_wrong(number)) (number % 2 == 0 ? field : versors).back() += 1;
  });
  // How many nodes are wrong of the five that lie about one along an axis; negative if one of these
  // is not stored.
  const auto wrong_about = [&](const Eigen::Vector3i& node, int axis) {
    Eigen::Vector3i at = node;
    int wrong = 0;
    for (at[axis] = node[axis] - 2; at[axis] <= node[axis] + 2; ++at[axis]) {
      if (at[axis] < 0 || at[axis] >= grid.points[axis]) return -1;
      const std::size_t number = surface::number_of(at, grid.points);
      if (!is_stored(number)) return -1;
      wrong += is_wrong(number) ? 1 : 0;
    }
    return wrong;
  };
  std::vector<std::int32_t> cells;
  std::vector<std::uint8_t> right(field.size()), found(field.size());
  surface::for_points(grid.points.array() - 3, [&](std::size_t, const Eigen::Vector3i& inner) {
    const Eigen::Vector3i low = inner.array() + 1, high = low.array() + 1;
    const std::size_t number = surface::number_of(low, grid.points);
    cells.push_back(device::narrow(number));
    right[number] = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i along = Eigen::Vector3i::Unit(axis);
      const int most = std::max({wrong_about(low, axis), wrong_about(low + along, axis),
                                 wrong_about(high, axis), wrong_about(high - along, axis)});
      if (most != 0) right[number] = 0;
    }
  });
  // Pages in their order, none of which is left out.
  constexpr auto kNodes = static_cast<std::size_t>(int{QJ_LATTICE_PAGE_NODES});
  const std::size_t pages = (field.size() + kNodes - 1) / kNodes;
  std::vector<std::int32_t> places(pages * (1 + QJ_LATTICE_PAGE));
  for (std::size_t page = 0; page < pages; ++page) {
    places[page] = device::narrow(pages + page * QJ_LATTICE_PAGE);
  }
  for (std::size_t number = 0; number < field.size(); ++number) {
    std::int32_t& group = places[pages + number / QJ_LATTICE_GROUP];
    const auto member = device::narrow(number % QJ_LATTICE_GROUP);
    if (member == 0) group = device::narrow(number) << QJ_LATTICE_GROUP;
    if (is_stored(number)) group |= 1 << member;
  }
  surface::ImageLattice::Level level;
  level.grid = grid;
  device::Context& context = device.context();
  const auto kernel = context.kernel("image_lattice.cl", "trust_cells",
                                     {device.lane_width(precision), precision, {}});
  std::vector<std::uint8_t> all(places.size() * QJ_LATTICE_GROUP);
  const auto trusted = context.upload<std::uint8_t>(all);
  const auto sent = [&](const std::vector<double>& reals) {
    return context.upload_real(reals, precision);
  };
  context.launch(
      kernel, {{cells.size(), 1, 1}},
      {context.upload<std::int32_t>(cells), device::narrow(cells.size()),
       sent(surface::ImageLattice::layout_of(std::span(&level, 1))), 0,
       context.upload<std::int32_t>(places), sent(field), sent(versors),
       device::Argument::real(1e-3, precision), device::Argument::real(0, precision), trusted},
      device::kNotCounted);
  context.read<std::uint8_t>(trusted, all);
  std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(pages * QJ_LATTICE_GROUP), found.size(),
              found.begin());
  return static_cast<double>(field.size()) -
         std::transform_reduce(found.begin(), found.end(), right.begin(), 0.0, std::plus<>(),
                               std::equal_to<>());
}

/// The point where the first two iterates take the nodes of a turned lattice, with the reference.
double composed_images(const Device& device, Precision precision) {
  constexpr int kIterates = 2;
  const Map work = small_work().map;
  const map::DeviceMap map(device, work, {0, 0, kNoEscape}, precision);
  surface::ImageLattice::Level level;
  level.iterates = kIterates;
  level.axes = Eigen::AngleAxisd(0.7, Vector3d(1, -2, 3).normalized()).toRotationMatrix();
  level.grid = {Vector3d(-0.6, -0.5, -0.4), 0.3, {4, 4, 4}};
  const std::size_t nodes = whole(level.grid).size();
  device::Context& context = device.context();
  const auto numbers = context.upload<std::int32_t>(surface::all_numbers(nodes));
  const auto fields = context.allocate_real(nodes, precision),
             versors = context.allocate_real(4 * nodes, precision);
  const std::size_t groups = map.groups(nodes);
  context.launch(
      map.kernel("image_lattice.cl", "composed_images"), {{groups, 1, 1}},
      {numbers, numbers,
       context.upload_real(surface::ImageLattice::layout_of(std::span(&level, 1)), precision), 0,
       context.allocate<std::int32_t>(1), context.allocate<std::uint8_t>(1), 0,
       device::narrow(groups), map.buffer(), map.factors(), fields, versors},
      device::kNotCounted);
  std::vector<double> f(nodes), u(4 * nodes);
  context.read(fields, f);
  context.read(versors, u);
  double worst = 0;
  surface::for_points(level.grid.points, [&](std::size_t i, const Eigen::Vector3i& at) {
    const Vector3d p = level.axes.transpose() * level.grid.point(at);
    const reference::Step first = reference::step(work, {p.x(), p.y(), p.z(), map.slice()});
    const double growth = std::exp(first.log_norm);
    const reference::Step second = reference::step(work, growth * first.versor);
    const Quaternion found{u[4 * i], u[4 * i + 1], u[4 * i + 2], u[4 * i + 3]};
    worst = larger_error(worst, std::abs(f[i] - second.log_norm));
    worst = larger_error(worst, norm(growth * found - second.versor));
  });
  return worst;
}

/// A table of one brick, over the cube from -1 to 1. Its F is linear, and its U is 1.
struct SmallTable {
  device::RealBuffer layout;
  device::Buffer<std::int32_t> bricks;
  device::Buffer<std::uint16_t> fields;
  device::Buffer<std::int8_t> versors;

  SmallTable(device::Context& context, Precision precision) {
    std::vector<double> reals(QJ_TABLE_SIZE);
    reals[QJ_TABLE_ORIGIN] = -1;
    reals[QJ_TABLE_STEP] = 0.5;
    reals[QJ_TABLE_BRICKS] = 1;
    reals[QJ_TABLE_FIELD] = -2;
    reals[QJ_TABLE_FIELD_STEP] = 0.25;
    std::vector<std::uint16_t> f;
    std::vector<std::int8_t> u;
    for (int node = 0; node < QJ_TABLE_NODES; ++node) {
      const int x = node % 5, y = node / 5 % 5, z = node / 25 % 5, w = node / 125;
      f.push_back(static_cast<std::uint16_t>(x + 2 * y + 3 * z + 4 * w));
      u.insert(u.end(), {QJ_TABLE_VERSOR, 0, 0, 0});
    }
    layout = context.upload_real(reals, precision);
    bricks = context.upload<std::int32_t>(std::vector<std::int32_t>{0});
    fields = context.upload<std::uint16_t>(f);
    versors = context.upload<std::int8_t>(u);
  }

  static double field_at(const Quaternion& q) {
    return 0.25 * (q.x + 1 + 2 * (q.y + 1) + 3 * (q.z + 1) + 4 * (q.w + 1)) / 0.5 - 2;
  }
};

constexpr std::size_t kTablePoints = 64;  // a multiple of every width

/// Four arrays of coordinates, each between -0.99 and 0.99.
std::vector<double> table_points() {
  base::Random random(5);
  std::vector<double> points(4 * kTablePoints);
  for (double& c : points) c = random.uniform(-0.99, 0.99);
  return points;
}

Quaternion table_point(const std::vector<double>& points, std::size_t i) {
  return {points[i], points[kTablePoints + i], points[2 * kTablePoints + i],
          points[3 * kTablePoints + i]};
}

/// F and U at points.
double image_table(const Device& device, Precision precision) {
  const std::vector<double> points = table_points();
  std::vector<double> right(5 * kTablePoints), found(right.size());
  for (std::size_t i = 0; i < kTablePoints; ++i) {
    right[i] = SmallTable::field_at(table_point(points, i));
    right[kTablePoints + i] = 1;
  }
  device::Context& context = device.context();
  const SmallTable table(context, precision);
  const int width = device.lane_width(precision);
  const std::size_t groups = kTablePoints / static_cast<std::size_t>(width);
  const auto images = context.allocate_real(found.size(), precision);
  context.launch(
      context.kernel("image_table.cl", "table_images", {width, precision, {}}), {{groups, 1, 1}},
      {context.upload_real(points, precision), device::narrow(kTablePoints), device::narrow(groups),
       table.layout, table.bricks, table.fields, table.versors, images},
      device::kNotCounted);
  context.read(images, found);
  return largest_difference(found, right);
}

/// F_2 of orbits whose second iterate is looked up: the ball's map takes q to q², and here to
/// e^F (q / |q|)² with an F that is given.
double looked_up(const Device& device, Precision precision) {
  constexpr double kFirst = -0.3;
  constexpr int kDone = 1, kLast = 2;
  const std::vector<double> points = table_points();
  std::vector<double> right, found(kTablePoints);
  for (std::size_t i = 0; i < kTablePoints; ++i) {
    const Quaternion q = table_point(points, i);
    right.push_back(SmallTable::field_at(std::exp(kFirst) / (norm(q) * norm(q)) * (q * q)));
  }
  const map::DeviceMap map(device, unit_ball(), {}, precision);
  device::Context& context = device.context();
  const SmallTable table(context, precision);
  const std::size_t groups = map.groups(kTablePoints);
  const auto ends = context.allocate_real(found.size(), precision);
  context.launch(map.kernel("look_up.cl", "look_up_rest"), {{groups, 1, 1}},
                 {context.upload_real(points, precision),
                  context.upload_real(std::vector<double>(kTablePoints, kFirst), precision),
                  device::narrow(kTablePoints),
                  context.upload<std::int32_t>(surface::all_numbers(kTablePoints)), 0,
                  device::narrow(groups), map.buffer(), map.factors(), kDone, kLast, table.layout,
                  table.bricks, table.fields, table.versors, ends},
                 device::kNotCounted);
  context.read(ends, found);
  return largest_difference(found, right);
}

constexpr std::array kSurfaceChecks{
    Check{"level_set.cl", "F_4 on a grid, with the reference", 1e-4, 1e-6, level_set, true},
    Check{"interpolated_orbit.cl", "surface of a ball, in cells", 0.5, 0.5, interpolated_surface},
    Check{"place_vertices.cl", "vertices of a ball, in cells", 0.011, 0.011, placed_vertices},
    Check{"image_lattice.cl", "cells that are wrong", 0, 0, image_lattice},
    Check{"image_lattice.cl", "images of two iterates, with the reference", 1e-5, 1e-12,
          composed_images, true},
    Check{"image_table.cl", "images from a table", 1e-5, 1e-12, image_table},
    Check{"look_up.cl", "ends of orbits that are looked up", 1e-5, 1e-12, looked_up},
};

}  // namespace

std::span<const Check> surface_checks() { return kSurfaceChecks; }

}  // namespace qjulia::check

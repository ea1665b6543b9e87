#include "qjulia/map/sample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "map/checks.hpp"
#include "map/portals.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/sample_settings.hpp"

namespace qjulia {

using namespace map;
namespace {

constexpr double kBoxMargin = 0.05;  // about the box of shape and copies, of its longest side
constexpr std::size_t kPiece = std::size_t{1} << 20U;

Box default_box(const Device& device, const Map& map, const std::stop_token& stop) {
  if (const std::optional<Box> box = box_with_copies(map)) {
    const Eigen::Vector3d margin = Eigen::Vector3d::Constant(kBoxMargin * box->size().maxCoeff());
    return {box->low - margin, box->high + margin};
  }
  const StopRadii stops = find_stop_radii(device, map, {}, stop);
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(std::min(stops.outer, stops.escape));
  return {map.frame.shape_to_map.to_shape(-reach), map.frame.shape_to_map.to_shape(reach)};
}

/// No orbit returns from beyond this radius, so the set is the same as in surfaces and pictures.
double default_escape(const Device& device, const Map& map, const std::stop_token& stop) {
  return std::max(kUsualEscape, find_stop_radii(device, map, {}, stop).escape);
}

/// The cell that comes `index`-th in `order`.
Eigen::Vector3d center_at(const CellGrid& grid, CellOrder order, std::size_t index) {
  std::array<std::size_t, 3> axes{0, 1, 2};  // fastest first
  if (order == CellOrder::z_fastest) axes = {2, 1, 0};
  std::array<int, 3> cell{};
  for (const std::size_t axis : axes) {
    const auto count = static_cast<std::size_t>(grid.cells[axis]);
    cell[axis] = static_cast<int>(index % count);
    index /= count;
  }
  return grid.center(cell[0], cell[1], cell[2]);
}

void check_grid(const CellGrid& grid) {
  for (const int along : grid.cells) {
    if (along >= 1 && along <= kMostSampleCells) continue;
    throw InputError(fmt::format("the grid has {} cells along a side: it must have 1 to {}", along,
                                 kMostSampleCells));
  }
  expect_box(grid.box);
}

}  // namespace

void SampleOptions::validate() const {
  expect_in_ranges(sample_settings(), *this);
  map::expect_box(box);
}

Eigen::Vector3d CellGrid::cell() const {
  return box.size().cwiseQuotient(Eigen::Vector3d(cells[0], cells[1], cells[2]));
}

Eigen::Vector3d CellGrid::center(int x, int y, int z) const {
  return box.low + cell().cwiseProduct(Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
}

std::size_t CellGrid::size() const {
  return Eigen::Vector3i(cells.data()).cast<std::size_t>().prod();
}

CellGrid sample_grid(const Device& device, const Map& map, const SampleOptions& options,
                     const std::stop_token& stop) {
  options.validate();
  map.validate();
  CellGrid grid;
  grid.box = options.box ? *options.box : default_box(device, map, stop);
  const double longest = grid.box.size().maxCoeff();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double share = grid.box.size()[static_cast<Eigen::Index>(axis)] / longest;
    grid.cells[axis] = std::max(1, static_cast<int>(std::lround(share * options.resolution)));
  }
  return grid;
}

void sample_field(const Device& device, const Map& map, const SampleOptions& options,
                  const CellGrid& grid, CellOrder order,
                  const std::function<void(std::span<const double>)>& take,
                  const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  check_grid(grid);
  if (options.escape) expect_escape(*options.escape, map.dynamics.surface_level);
  const double escape =
      options.escape ? *options.escape : default_escape(device, map, monitor.stop);
  const Field field(device, map, options.precision, {.escape = escape});
  const std::size_t all = grid.size();
  const auto start = std::chrono::steady_clock::now();
  std::vector<Eigen::Vector3d> points;
  for (std::size_t first = 0; first < all; first += points.size()) {
    throw_if_stopped(monitor.stop);
    points.resize(std::min(kPiece, all - first));
    for (std::size_t i = 0; i < points.size(); ++i) {
      points[i] = map.frame.shape_to_map.to_map(center_at(grid, order, first + i));
    }
    take(field.at(on_slice(points, map.dynamics.slice), options.iterations));
    const double done = static_cast<double>(first + points.size()) / static_cast<double>(all);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    monitor.report({"sampling the field", done, taken.count() * (1 - done) / done, ""});
  }
}

}  // namespace qjulia

#include "lattice/orbit_lookup.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "device/point_batch.hpp"
#include "lattice/image_probe.hpp"

namespace qjulia::surface {
namespace {

/// What looking up typically displaces, over the most that it may. The more points a grid has, the
/// more nodes are worth making: beyond so many cells along its longest side the share falls.
constexpr double kTypicalShare = 0.15, kManyCells = 512;
/// Cells along the sides of the blocks over which F_1 is bounded, coarse to fine.
constexpr std::array<int, 2> kBlocks{4, 2};

/// The numbers of the cells in which bounds of F_1 leave the side of points undecided, of those
/// that have a cell on every side.
std::vector<std::int32_t> undecided_cells(const LevelSet& set, double level, const Grid& grid,
                                          const std::stop_token& stop) {
  const double inside_below = set.certainly_inside_below(level);
  const double outside_above = set.certainly_outside_above(level);
  const Eigen::Vector3i cells = grid.points.array() - 1;
  std::vector<Eigen::Vector3i> undecided;  // blocks, in counts of their size
  const Eigen::Vector3i coarse = (cells.array() + kBlocks[0] - 1) / kBlocks[0];
  for_points(coarse,
             [&](std::size_t, const Eigen::Vector3i& block) { undecided.push_back(block); });
  for (const int size : kBlocks) {
    throw_if_stopped(stop);
    std::vector<Eigen::Vector3d> centers;
    centers.reserve(undecided.size());
    for (const Eigen::Vector3i& block : undecided) {
      centers.push_back(grid.at(size * (block.cast<double>().array() + 0.5)));
    }
    const FieldBounds bounds = set.bounds(centers, 0.5 * size * grid.step);
    std::vector<Eigen::Vector3i> halves;
    for (std::size_t i = 0; i < undecided.size(); ++i) {
      if (bounds.high[i] < inside_below || bounds.low[i] > outside_above) continue;
      for_points(Eigen::Vector3i::Constant(2), [&](std::size_t, const Eigen::Vector3i& half) {
        halves.push_back(2 * undecided[i] + half);
      });
    }
    undecided = std::move(halves);
  }
  std::vector<std::int32_t> numbers;
  for (const Eigen::Vector3i& cell : undecided) {
    if ((cell.array() < 1).any() || (cell.array() > grid.points.array() - 3).any()) continue;
    numbers.push_back(device::narrow(number_of(cell, grid.points)));
  }
  return numbers;
}

}  // namespace

bool tables_pay(const Map& map, const Grid& grid) {
  // Points near the surface grow as the square of the cells along a side, and an orbit's cost as
  // the factors. Of 992 factors, 256 cells take as long with tables as without, and 512 take two
  // thirds of the time. Of 331 factors, 512 cells take as long, and 1,024 four fifths.
  constexpr double kLeastWork = 1.2e8;
  const double cells = grid.points.maxCoeff() - 1;
  return cells * cells * static_cast<double>(map.dynamics.factors.size()) >= kLeastWork;
}

std::shared_ptr<const OrbitLookup> make_lookup(const map::DeviceMap& map, const LevelSet& set,
                                               double level, const Grid& grid, double displacement,
                                               const std::stop_token& stop) {
  if (!map.interpolates()) return nullptr;
  // A coarser table shows in the mesh more than it saves.
  constexpr double kTableShare = 0.25;
  ImageTable table = ImageTable::of_ball(map, kTableShare * displacement, stop);
  const int tabled = table.first_iterate(displacement);
  if (tabled > 2) return nullptr;
  const double typical =
      kTypicalShare * displacement * std::min(1.0, kManyCells / grid.points.maxCoeff());
  ImageLattice lattice(
      map, {grid.origin, grid.point(grid.points.array() - 1)},
      [&](const Grid& nodes) { return undecided_cells(set, level, nodes, stop); },
      {displacement, typical, first_stretch(map, stop), std::numeric_limits<double>::infinity()},
      stop);
  return std::make_shared<const OrbitLookup>(
      OrbitLookup{std::move(lattice), std::move(table), tabled});
}

std::vector<float> looked_up_fields(const map::DeviceMap& map, const ImageLattice& lattice,
                                    const ImageTable& table, int iterates,
                                    const std::vector<Eigen::Vector3d>& points,
                                    const std::stop_token& stop) {
  std::vector<float> fields(points.size());
  device::PointBatch batch(map.context(), map.kernel("look_up.cl", "look_up_points"),
                           map.precision(), 1, kLookUpCost);
  batch.run<3, 1>(
      points.size(),
      [&](std::size_t i) {
        return std::array{points[i].x(), points[i].y(), points[i].z()};
      },
      [&](const device::PointBatch::Part& part) {
        Arguments arguments{part.in,
                            device::narrow(part.stride),
                            device::narrow(part.count),
                            map.buffer(),
                            iterates,
                            iterates};
        append_lattice(lattice, arguments);
        append_table(table, arguments);
        arguments.emplace_back(part.out);
        return look_up_call(std::move(arguments), part.count);
      },
      [&](std::size_t i, const std::array<double, 1>& f) { fields[i] = static_cast<float>(f[0]); },
      0, stop);
  return fields;
}

device::PartCall look_up_call(Arguments arguments, std::size_t points) {
  return {std::move(arguments), device::moving(5 * static_cast<double>(points))};
}

void append_lattice(const ImageLattice& lattice, Arguments& arguments) {
  arguments.emplace_back(lattice.layout());
  arguments.emplace_back(lattice.places());
  arguments.emplace_back(lattice.field());
  arguments.emplace_back(lattice.versors());
  arguments.emplace_back(lattice.trusted());
}

void append_table(const ImageTable& table, Arguments& arguments) {
  arguments.emplace_back(table.layout());
  arguments.emplace_back(table.bricks());
  arguments.emplace_back(table.fields());
  arguments.emplace_back(table.versors());
}

}  // namespace qjulia::surface

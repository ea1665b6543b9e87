#include "picture/image_lattice.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "device/point_batch.hpp"
#include "picture/grid_layout.hpp"
#include "surface/grid_block.hpp"

namespace qjulia::picture {
namespace {

/// Interpolation between nodes that F and U turn h radians apart at is off by about kError h⁴, as
/// the median; a third of what is allowed.
constexpr double kError = 0.07, kShare = 0.3;
/// Radians from node to node.
constexpr double kNearest = 0.1, kFarthest = 0.8;
/// A lattice made for this many times the displacement serves as well.
constexpr double kSlack = 1.5;
/// For memory's sake.
constexpr double kMostNodes = 4e6;

/// Cells about the box with the nodes that they are interpolated from.
surface::Grid nodes_over(const Box& box, double step) {
  surface::Grid grid;
  grid.step = step;
  grid.origin = box.low.array() - 1.5 * step;
  for (std::size_t i = 0; i < 3; ++i) {
    grid.points[i] =
        static_cast<int>(std::ceil(box.size()[static_cast<Eigen::Index>(i)] / step)) + 4;
  }
  return grid;
}

/// The numbers of the cells that rays run orbits in.
std::vector<std::int32_t> cells_of(const surface::Grid& grid, const BandGrid& band) {
  const double reach = std::sqrt(0.75) * grid.step;  // of a cell's corners from its middle
  std::vector<std::int32_t> cells;
  for (int k = 1; k + 2 < grid.points[2]; ++k) {
    for (int j = 1; j + 2 < grid.points[1]; ++j) {
      for (int i = 1; i + 2 < grid.points[0]; ++i) {
        if (!band.has_orbits_near(grid.at(Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5)), reach)) {
          continue;
        }
        cells.push_back((k * grid.points[1] + j) * grid.points[0] + i);
      }
    }
  }
  return cells;
}

/// The nodes that these cells are interpolated from.
std::vector<std::int32_t> nodes_of(const surface::Grid& grid,
                                   const std::vector<std::int32_t>& cells) {
  std::vector<bool> needed(surface::whole(grid).size());
  const int row = grid.points[0], slice = row * grid.points[1];
  for (const std::int32_t cell : cells) {
    for (int k = -1; k <= 2; ++k) {
      for (int j = -1; j <= 2; ++j) {
        const auto first = needed.begin() + (cell + k * slice + j * row - 1);
        std::fill(first, first + 4, true);
      }
    }
  }
  std::vector<std::int32_t> nodes;
  for (std::size_t i = 0; i < needed.size(); ++i) {
    if (needed[i]) nodes.push_back(device::narrow(i));
  }
  return nodes;
}

bool holds(const Box& outer, const Box& inner) {
  return (outer.low.array() <= inner.low.array()).all() &&
         (outer.high.array() >= inner.high.array()).all();
}

}  // namespace

ImageLattice::ImageLattice(const map::DeviceMap& map)
    : layout_(map.context().upload_real(grid_layout({}), map.precision())),
      field_(map.context().allocate_real(1, map.precision())),
      versors_(map.context().allocate_real(1, map.precision())),
      trusted_(map.context().allocate<std::uint8_t>(1)) {}

ImageLattice::ImageLattice(const map::DeviceMap& map, const BandGrid& band, const Box& box,
                           double displacement, double steepest)
    : box_(box), displacement_(displacement) {
  device::Context& context = map.context();
  // The image moves steepest · e^F times as far as the point, and interpolation is off by a share
  // of e^F.
  const double allowed = displacement * steepest;
  const double turn = std::clamp(std::pow(kShare * allowed / kError, 0.25), kNearest, kFarthest);
  const double step = std::max(turn / steepest, std::cbrt(box.size().prod() / kMostNodes));
  const surface::Grid grid = nodes_over(box, step);
  const std::size_t size = surface::whole(grid).size();
  const std::vector<std::int32_t> cells = cells_of(grid, band);
  layout_ = context.upload_real(grid_layout(grid), map.precision());
  field_ = context.allocate_real(size, map.precision());
  versors_ = context.allocate_real(4 * size, map.precision());
  trusted_ = context.upload<std::uint8_t>(std::vector<std::uint8_t>(size));
  if (cells.empty()) return;
  const std::vector<std::int32_t> nodes = nodes_of(grid, cells);
  compute(map, grid, nodes, nodes, field_, versors_);
  trust(map, grid, cells, allowed);
}

bool ImageLattice::serves(const Box& box, double displacement) const {
  return kSlack * displacement >= displacement_ && holds(box_, box);
}

/// The kind's F and U at the grid's points of these numbers, point i in slot slots[i].
void ImageLattice::compute(const map::DeviceMap& map, const surface::Grid& grid,
                           std::vector<std::int32_t> numbers, std::vector<std::int32_t> slots,
                           const device::RealBuffer& field,
                           const device::RealBuffer& versors) const {
  device::Context& context = map.context();
  numbers.resize(map.groups(numbers.size()) * map.lanes(), numbers.back());
  slots.resize(numbers.size(), slots.back());
  const auto from = context.upload<std::int32_t>(numbers);
  const auto to = context.upload<std::int32_t>(slots);
  const device::Argument points = grid_block(grid, surface::whole(grid), map.precision());
  device::launch_in_parts(context, map.kernel("interpolated_orbit.cl", "block_images"),
                          map.groups(numbers.size()), map.step_cost() * map.points_per_item(),
                          [&](std::size_t first, std::size_t count) {
                            return std::vector<device::Argument>{from,
                                                                 to,
                                                                 points,
                                                                 1,
                                                                 device::narrow(first),
                                                                 device::narrow(count),
                                                                 map.buffer(),
                                                                 map.factors(),
                                                                 field,
                                                                 versors};
                          });
}

/// Marks those cells at whose middles interpolation is off by no more than `allowed`.
void ImageLattice::trust(const map::DeviceMap& map, const surface::Grid& grid,
                         const std::vector<std::int32_t>& cells, double allowed) {
  device::Context& context = map.context();
  surface::Grid middles = grid;
  middles.origin.array() += 0.5 * grid.step;
  const std::size_t padded = map.groups(cells.size()) * map.lanes();
  const auto field = context.allocate_real(padded, map.precision());
  const auto versors = context.allocate_real(4 * padded, map.precision());
  std::vector<std::int32_t> slots(cells.size());
  std::iota(slots.begin(), slots.end(), 0);
  compute(map, middles, cells, slots, field, versors);
  context.launch(map.kernel("image_lattice.cl", "trust_cells"), {{cells.size(), 1, 1}, {}},
                 {context.upload<std::int32_t>(cells), device::narrow(cells.size()), field, versors,
                  layout_, field_, versors_, map.real(allowed), trusted_});
}

}  // namespace qjulia::picture

#include "surface/image_lattice.hpp"

#include <algorithm>
#include <cmath>

#include "device/point_batch.hpp"
#include "layout/image_lattice.h"
#include "qjulia/progress.hpp"
#include "surface/grid_layout.hpp"
#include "surface/interpolated_orbits.hpp"

namespace qjulia::surface {
namespace {

/// Interpolation between nodes from one of which to the next U turns by h radians is off by about
/// kError h⁴, as the median.
constexpr double kError = 0.07;
/// Nodes that are computed between two looks at the stop token: about half a second's work.
constexpr std::size_t kNodesAtOnce = std::size_t{1} << 17;
/// Radians from node to node.
constexpr double kNearest = 0.1, kFarthest = 0.8;
/// A lattice whose nodes would lie more than this many times as far apart as they should serves too
/// few cells to be worth making.
constexpr double kCoarsest = 1.6;
/// A lattice made for this many times the displacement serves as well.
constexpr double kServedSlack = 1.5;
/// Nodes in the whole box: any number is affordable below the first, and memory limits it above the
/// second.
constexpr double kFewestNodes = 3e5, kMostNodes = 12e6;

/// The nodes that these cells are interpolated from.
std::vector<std::int32_t> nodes_of(const Grid& grid, const std::vector<std::int32_t>& cells) {
  std::vector<bool> needed(whole(grid).size());
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

/// Where nodes are stored (layout/image_lattice.h).
struct Storage {
  std::vector<std::int32_t> places;  ///< by group of nodes
  std::vector<std::int32_t> slots;   ///< by node stored
  std::size_t size = 0;              ///< slots, those that stay empty included

  /// @param nodes numbers of those to store, rising. @param all how many the lattice has.
  Storage(const std::vector<std::int32_t>& nodes, std::size_t all)
      : places((all + QJ_LATTICE_GROUP - 1) / QJ_LATTICE_GROUP), slots(nodes.size()) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const std::int32_t member = nodes[i] % QJ_LATTICE_GROUP;
      std::int32_t& group = places[static_cast<std::size_t>(nodes[i] / QJ_LATTICE_GROUP)];
      if (group == 0) {
        group = device::narrow(size << QJ_LATTICE_GROUP);
        size += QJ_LATTICE_GROUP;
      }
      group |= 1 << member;
      slots[i] = (group >> QJ_LATTICE_GROUP) + member;
    }
  }
};

}  // namespace

ImageLattice::ImageLattice(const map::DeviceMap& map)
    : layout_(map.context().upload_real(grid_layout({}), map.precision())),
      field_(map.context().allocate_real(1, map.precision())),
      versors_(map.context().allocate_real(1, map.precision())),
      places_(map.context().allocate<std::int32_t>(1)),
      trusted_(map.context().allocate<std::uint8_t>(1)) {}

ImageLattice::ImageLattice(const map::DeviceMap& map, const Box& box, const CellsOf& cells_of,
                           const Fineness& fineness, const std::stop_token& stop)
    : ImageLattice(map) {
  box_ = box;
  displacement_ = fineness.displacement;
  device::Context& context = map.context();
  // The image moves stretch · e^F times as far as the point, and interpolation is off by a share
  // of e^F.
  const double allowed = fineness.displacement * fineness.stretch;
  const double turn =
      std::clamp(std::pow(fineness.typical * fineness.stretch / kError, 0.25), kNearest, kFarthest);
  const double most_nodes = std::clamp(fineness.most_nodes, kFewestNodes, kMostNodes);
  const double finest = std::cbrt(box.size().prod() / most_nodes);
  const double step = std::max(turn / fineness.stretch, finest);
  if (step > kCoarsest * turn / fineness.stretch) return;
  // Cells about the box with the nodes that they are interpolated from.
  Grid grid = grid_around(box, step, 1.5);
  grid.points.x() += -grid.points.x() & (QJ_LATTICE_GROUP - 1);  // whole groups of nodes
  const std::size_t size = whole(grid).size();
  const std::vector<std::int32_t> cells = cells_of(grid);
  layout_ = context.upload_real(grid_layout(grid), map.precision());
  trusted_ = context.upload<std::uint8_t>(std::vector<std::uint8_t>(size));
  if (cells.empty()) return;
  const std::vector<std::int32_t> nodes = nodes_of(grid, cells);
  const Storage storage(nodes, size);
  places_ = context.upload<std::int32_t>(storage.places);
  field_ = context.allocate_real(storage.size, map.precision());
  versors_ = context.allocate_real(4 * storage.size, map.precision());
  nodes_ = nodes.size();
  for (std::size_t first = 0; first < nodes.size(); first += kNodesAtOnce) {
    throw_if_stopped(stop);
    const std::size_t count = std::min(kNodesAtOnce, nodes.size() - first);
    const auto begin = nodes.begin() + static_cast<std::ptrdiff_t>(first);
    const auto slot = storage.slots.begin() + static_cast<std::ptrdiff_t>(first);
    const auto size_of_part = static_cast<std::ptrdiff_t>(count);
    block_images(map, grid, whole(grid), 1, {begin, begin + size_of_part},
                 {slot, slot + size_of_part}, field_, versors_);
    context.finish();
  }
  context.launch(map.kernel("image_lattice.cl", "trust_cells"), {{cells.size(), 1, 1}, {}},
                 {context.upload<std::int32_t>(cells), device::narrow(cells.size()), layout_,
                  places_, field_, versors_, map.real(allowed), trusted_});
  std::vector<std::uint8_t> trusted(size);
  context.read(trusted_, std::span(trusted));
  trusted_share_ =
      static_cast<double>(std::ranges::count(trusted, 1)) / static_cast<double>(cells.size());
}

bool ImageLattice::serves(const Box& box, double displacement) const {
  return kServedSlack * displacement >= displacement_ &&
         (box_.low.array() <= box.low.array()).all() &&
         (box_.high.array() >= box.high.array()).all();
}

}  // namespace qjulia::surface

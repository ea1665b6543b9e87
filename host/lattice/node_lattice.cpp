#include "lattice/node_lattice.hpp"

#include <algorithm>
#include <cstddef>

namespace qjulia::surface {
namespace {

/// Nodes that interpolation takes before the one at or before a point, and after it.
constexpr int kBefore = 2;
constexpr int kAfter = 3;

/// One byte for each thing that may be needed.
using Marks = std::vector<std::uint8_t>;

std::vector<std::int32_t> numbers_of(const Marks& marks) {
  std::vector<std::int32_t> numbers;
  numbers.reserve(marks.size());
  for (std::size_t i = 0; i < marks.size(); ++i) {
    if (marks[i] != 0) numbers.push_back(static_cast<std::int32_t>(i));
  }
  return numbers;
}

/// The meetings that interpolation along x takes at these points.
Marks meetings_at(const GridBlock& block, const NodeLattice& lattice,
                  std::span<const std::int32_t> asking) {
  Marks marks(lattice.meetings());
  const std::int32_t row_points = block.count[0];
  std::int32_t end = 0;  // end of the points between the same two nodes
  for (const std::int32_t number : asking) {
    if (number < end) continue;
    const std::int32_t row = number / row_points;
    const std::int32_t node = number % row_points / lattice.spacing;
    end = std::min(row * row_points + (node + 1) * lattice.spacing, (row + 1) * row_points);
    const auto first = marks.begin() + std::ptrdiff_t{row} * lattice.nodes.count[0] + node;
    std::fill(first, first + kBefore + 1 + kAfter, std::uint8_t{1});
  }
  return marks;
}

/// The nodes that interpolation along y takes at these meetings.
Marks nodes_at(const NodeLattice& lattice, const Marks& meetings) {
  Marks marks(lattice.nodes.size());
  const auto columns = static_cast<std::size_t>(lattice.nodes.count[0]);
  const auto rows = static_cast<std::size_t>(lattice.rows);
  const auto node_rows = static_cast<std::size_t>(lattice.nodes.count[1]);
  const auto spacing = static_cast<std::size_t>(lattice.spacing);
  Marks any(columns);  // among the rows between the same two nodes
  for (std::size_t row = 0; row * columns < meetings.size(); ++row) {
    const std::size_t y = row % rows;
    for (std::size_t i = 0; i < columns; ++i) any[i] |= meetings[row * columns + i];
    if ((y + 1) % spacing != 0 && y + 1 != rows) continue;
    const std::size_t first = row / rows * node_rows + y / spacing;
    for (std::size_t node = first; node <= first + kBefore + kAfter; ++node) {
      for (std::size_t i = 0; i < columns; ++i) marks[node * columns + i] |= any[i];
    }
    std::ranges::fill(any, std::uint8_t{0});
  }
  return marks;
}

}  // namespace

std::size_t NodeLattice::meetings() const {
  return static_cast<std::size_t>(nodes.count[0]) * static_cast<std::size_t>(rows) *
         static_cast<std::size_t>(nodes.count[2]);
}

NodeLattice node_lattice(const GridBlock& block, int spacing,
                         std::span<const std::int32_t> asking) {
  NodeLattice lattice{spacing, block, block.count[1], {}, {}};
  for (const int axis : {0, 1}) {
    lattice.nodes.first[axis] -= kBefore * spacing;
    lattice.nodes.count[axis] = kBefore + (block.count[axis] - 1) / spacing + kAfter + 1;
  }
  const Marks meetings = meetings_at(block, lattice, asking);
  lattice.needed_meetings = numbers_of(meetings);
  lattice.needed_nodes = numbers_of(nodes_at(lattice, meetings));
  return lattice;
}

}  // namespace qjulia::surface

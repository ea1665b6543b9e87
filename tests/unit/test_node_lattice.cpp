// Nodes that interpolation needs, against what it takes point by point.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <random>
#include <set>

#include "lattice/node_lattice.hpp"
#include "random_maps.hpp"

using namespace qjulia;

TEST_CASE("a lattice has what interpolation takes, and nothing else") {
  const int spacing = GENERATE(2, 3, 7, 32);
  const double share = GENERATE(0.002, 0.3, 1.0);
  const surface::GridBlock block{{5, 1, 2}, {23, 17, 3}};
  std::mt19937_64 bits(7);
  std::vector<std::int32_t> asking;
  for (std::int32_t i = 0; i < 23 * 17 * 3; ++i) {
    if (test::uniform(bits, 0, 1) < share) asking.push_back(i);
  }
  const surface::NodeLattice lattice = surface::node_lattice(block, spacing, asking);
  const int columns = lattice.nodes.count[0];
  const int node_rows = lattice.nodes.count[1];
  CHECK(lattice.nodes.first == Eigen::Vector3i(5 - 2 * spacing, 1 - 2 * spacing, 2));
  CHECK(lattice.nodes.count[2] == 3);
  CHECK(lattice.meetings() == static_cast<std::size_t>(columns * 17 * 3));

  // Nodes m - 2 … m + 3 of an axis are 0 … 5 past node number m there.
  std::set<std::int32_t> meetings;
  for (const std::int32_t number : asking) {
    for (int i = 0; i < 6; ++i) {
      const int column = number % 23 / spacing + i;
      REQUIRE(column < columns);
      meetings.insert(number / 23 * columns + column);
    }
  }
  std::set<std::int32_t> nodes;
  for (const std::int32_t meeting : meetings) {
    const int row = meeting / columns;
    for (int i = 0; i < 6; ++i) {
      const int node_row = row % 17 / spacing + i;
      REQUIRE(node_row < node_rows);
      nodes.insert((row / 17 * node_rows + node_row) * columns + meeting % columns);
    }
  }
  CHECK(std::ranges::equal(lattice.needed_meetings, meetings));
  CHECK(std::ranges::equal(lattice.needed_nodes, nodes));
}

TEST_CASE("a lattice that nobody asks for has no needed nodes") {
  const surface::NodeLattice lattice = surface::node_lattice({{0, 0, 0}, {9, 9, 1}}, 4, {});
  CHECK(lattice.needed_meetings.empty());
  CHECK(lattice.needed_nodes.empty());
}

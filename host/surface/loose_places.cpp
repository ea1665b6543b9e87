#include "surface/loose_places.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "base/union_find.hpp"

namespace qjulia::surface {
namespace {

/// A share of the largest body's volume, as in `drop_loose_pieces`.
constexpr double kLeast = 0.01;
/// A piece that has not ended after so many cells is kept.
constexpr int kMostRounds = 6;
/// The places of a loose piece go so many points of the fine grid beyond its inside points, because
/// its surface, and pieces of it, lie between points.
constexpr int kMargin = 2;
/// The most points of a finer look at the pieces in sight. They take about a second of two CPU
/// cores.
constexpr std::size_t kMostFinerPoints = std::size_t{1} << 22;

using Index = Eigen::Vector3i;

/// Which inside points of the coarse grid belong to bodies that are kept, and which look loose.
struct CoarseBodies {
  std::vector<bool> is_kept;
  std::vector<std::size_t> suspects;
  double largest = 0;  ///< points
  double kept_points = 0;
};

CoarseBodies coarse_bodies(const Grid& grid, const std::vector<bool>& is_inside) {
  base::UnionFind bodies(is_inside.size());
  for_points(grid.points, [&](std::size_t number, const Index& at) {
    if (!is_inside[number]) return;
    std::size_t stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t before = number - stride;
      if (at[axis] > 0 && is_inside[before]) {
        bodies.unite(static_cast<std::uint32_t>(number), static_cast<std::uint32_t>(before));
      }
      stride *= static_cast<std::size_t>(grid.points[axis]);
    }
  });
  std::vector<std::uint32_t> sizes(is_inside.size());
  for (std::uint32_t i = 0; i < sizes.size(); ++i) {
    if (is_inside[i]) ++sizes[bodies.root(i)];
  }
  CoarseBodies found;
  found.largest = sizes.empty() ? 0 : *std::ranges::max_element(sizes);
  found.is_kept.resize(sizes.size());
  for (std::uint32_t i = 0; i < sizes.size(); ++i) {
    if (!is_inside[i]) continue;
    found.is_kept[i] = sizes[bodies.root(i)] >= kLeast * found.largest;
    if (found.is_kept[i]) ++found.kept_points;
    if (!found.is_kept[i]) found.suspects.push_back(i);
  }
  return found;
}

/// The cells, by their lower corners, that have no corner in a body that is kept, and one about
/// which something may be.
std::vector<std::size_t> cells_beside(const Grid& grid, const CoarseBodies& coarse,
                                      const std::vector<bool>& may_be_inside) {
  const auto row = static_cast<std::size_t>(grid.points[0]);
  const std::size_t slice = row * static_cast<std::size_t>(grid.points[1]);
  std::vector<std::size_t> cells;
  for_points(grid.points.array() - 1, [&](std::size_t, const Index& lower) {
    const std::size_t first = number_of(lower, grid.points);
    bool is_asked = false, has_body = false;
    for (const std::size_t corner : {first, first + row, first + slice, first + slice + row}) {
      for (const std::size_t at : {corner, corner + 1}) {
        is_asked = is_asked || may_be_inside[at];
        has_body = has_body || coarse.is_kept[at];
      }
    }
    if (is_asked && !has_body) cells.push_back(first);
  });
  return cells;
}

/// Sets or reads a bit in the order of `LoosePlaces::bits`.
void put(std::vector<std::uint32_t>& bits, std::size_t number, bool value) {
  const std::uint32_t bit = 1U << (number % 32);
  value ? bits[number / 32] |= bit : bits[number / 32] &= ~bit;
}
bool has(const std::vector<std::uint32_t>& bits, std::size_t number) {
  return ((bits[number / 32] >> (number % 32)) & 1U) != 0;
}

/// The grid's point that is nearest to `p`; nothing if `p` lies beyond the grid.
std::optional<Index> nearest_point(const Grid& grid, const Eigen::Vector3d& p) {
  const Eigen::Array3d at = ((p - grid.origin) / grid.step).array().round();
  if (!(at >= 0).all() || !(at < grid.points.cast<double>().array()).all()) return std::nullopt;
  return at.cast<int>();
}

Grid finer_grid(const Grid& grid, int finer) {
  return {grid.origin, grid.step / finer, finer * grid.points};
}

/// The number of a finer point's bit in `finer_bits`; nothing if its cell has none.
std::optional<std::size_t> finer_number(const LoosePlaces& places, const Index& at) {
  const Index cell = at / places.finer;
  const std::size_t number = number_of(cell, places.grid.points), word = number / 32;
  const std::uint32_t cells = places.finer_cells[2 * word], bit = 1U << (number % 32);
  if ((cells & bit) == 0) return std::nullopt;
  const auto before = static_cast<std::size_t>(places.finer_cells[2 * word + 1]) +
                      static_cast<std::size_t>(std::popcount(cells & (bit - 1)));
  const Index count = Index::Constant(places.finer);
  return before * static_cast<std::size_t>(count.prod()) +
         number_of(at - places.finer * cell, count);
}

/// Lists the known blocks as the cells that have finer points, and marks which points are loose.
void take_finer(LoosePlaces& places, const FineBodies& fine, int finer) {
  const std::vector<std::size_t>& blocks = fine.blocks();
  places.finer = finer;
  places.finer_cells.assign(2 * places.bits.size(), 0);
  for (const std::size_t block : blocks) {
    places.finer_cells[2 * (block / 32)] |= 1U << (block % 32);
  }
  std::uint32_t before = 0;
  for (std::size_t word = 0; word < places.bits.size(); ++word) {
    places.finer_cells[2 * word + 1] = before;
    before += static_cast<std::uint32_t>(std::popcount(places.finer_cells[2 * word]));
  }
  places.finer_bits.assign((fine.size() + 31) / 32, 0);
  // Points that are near neither loose nor kept points stay as the coarser look found them.
  const int half = finer / 2;
  for (std::size_t place = 0; place < fine.size(); ++place) {
    const Index at = fine.at(place);
    const Index nearest = ((at.array() + half) / finer).min(places.grid.points.array() - 1);
    const bool was_loose = has(places.bits, number_of(nearest, places.grid.points));
    if (was_loose) put(places.finer_bits, *finer_number(places, at), true);
  }
  fine.mark(kMargin, [&](const Index& at, bool is_loose) {
    const auto number = finer_number(places, at);
    if (number) put(places.finer_bits, *number, is_loose);
  });
}

/// Looks `finer` times as finely around these points of loose pieces; false, without looking, if it
/// would take too many points.
bool look_finer(LoosePlaces& places, const std::vector<Index>& points, int finer,
                const Insides& insides) {
  FineBodies fine(places.grid, places.is_kept, finer, Links::diagonals, insides);
  for (const Index& point : points) fine.want(finer * point, finer * kMargin + finer / 2);
  if (fine.wanted_blocks() * fine.points_a_block() > kMostFinerPoints) return false;
  const double any_size = std::numeric_limits<double>::infinity();
  fine.follow(kMostRounds);
  fine.find_loose(any_size);
  fine.look_around_loose(kMargin + 1);
  fine.find_loose(any_size);
  take_finer(places, fine, finer);
  return true;
}

}  // namespace

bool LoosePlaces::holds(const Eigen::Vector3d& p) const {
  if (bits.empty()) return false;
  const auto at = nearest_point(grid, p);
  if (!at) return false;
  if (finer > 0) {
    const auto near = nearest_point(finer_grid(grid, finer), p);
    const auto number = near ? finer_number(*this, *near) : std::nullopt;
    if (number) return has(finer_bits, *number);
  }
  return has(bits, number_of(*at, grid.points));
}

LoosePlaces find_loose_places(const Grid& grid, const std::vector<bool>& is_inside,
                              const std::vector<bool>& may_be_inside, int divisions,
                              const Insides& insides) {
  const CoarseBodies coarse = coarse_bodies(grid, is_inside);
  FineBodies fine(grid, coarse.is_kept, divisions, Links::edges, insides);
  for (const std::size_t suspect : coarse.suspects) {
    fine.want(divisions * index_of(suspect, grid.points), 1);
  }
  for (const std::size_t cell : cells_beside(grid, coarse, may_be_inside)) {
    fine.want(divisions * index_of(cell, grid.points), 0);
  }
  const double most = kLeast * coarse.largest * std::pow(divisions, 3);
  fine.follow(kMostRounds);
  fine.find_loose(most);
  fine.look_around_loose(kMargin + 1);
  fine.find_loose(most);

  LoosePlaces places;
  places.resolution = grid.step / divisions;
  places.largest_loose = most * std::pow(places.resolution, 3);
  places.of_pieces = fine.loose_bodies();
  if (places.of_pieces.empty()) return places;
  places.grid = fine.grid();
  const Index& points = places.grid.points;
  places.pieces.count = places.of_pieces.size();
  for (std::vector<std::size_t>& piece : places.of_pieces) {
    for (std::size_t& point : piece) point = number_of(fine.at(point), points);
    places.pieces.volume += std::pow(places.grid.step, 3) * static_cast<double>(piece.size());
  }
  const double all = places.pieces.volume + std::pow(grid.step, 3) * coarse.kept_points;
  places.pieces.share = places.pieces.volume / all;
  places.is_kept.resize(whole(places.grid).size());
  for_points(grid.points, [&](std::size_t number, const Index& at) {
    if (coarse.is_kept[number]) places.is_kept[number_of(divisions * at, points)] = true;
  });
  for (std::size_t place = 0; place < fine.size(); ++place) {
    if (!fine.is_inside(place) || fine.is_loose(place)) continue;
    places.is_kept[number_of(fine.at(place), points)] = true;
  }
  places.bits.resize((whole(places.grid).size() + 31) / 32);
  fine.mark(kMargin, [&](const Index& at, bool is_loose) {
    put(places.bits, number_of(at, points), is_loose);
  });
  return places;
}

void look_finer(LoosePlaces& places, int finer, const Sight& is_in_sight, const Insides& insides) {
  places.finer = 0;
  places.finer_cells.clear();
  places.finer_bits.clear();
  const Grid& grid = places.grid;
  std::vector<Index> points;
  for (const std::vector<std::size_t>& piece : places.of_pieces) {
    const bool is_seen = std::ranges::any_of(piece, [&](std::size_t point) {
      return is_in_sight(grid.point(index_of(point, grid.points)), (kMargin + 1) * grid.step);
    });
    if (!is_seen) continue;
    for (const std::size_t point : piece) points.push_back(index_of(point, grid.points));
  }
  if (points.empty()) return;
  while (finer > 1 && !look_finer(places, points, finer, insides)) finer /= 2;
}

}  // namespace qjulia::surface

#include "surface/loose_places.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "base/union_find.hpp"

namespace qjulia::surface {
namespace {

/// Of the largest body's volume, as in `drop_loose_pieces`.
constexpr double kLeast = 0.01;
/// A piece that has not come to an end after so many cells of the coarse grid is kept.
constexpr int kMostRounds = 6;
/// Points of the fine grid by which a loose piece's place is wider than its inside points: its
/// surface, and crumbs of it, lie between points.
constexpr int kMargin = 2;

using Index = std::array<int, 3>;

std::size_t number_of(const Index& at, const Index& points) {
  const auto [i, j, k] = at;
  return (static_cast<std::size_t>(k) * static_cast<std::size_t>(points[1]) +
          static_cast<std::size_t>(j)) *
             static_cast<std::size_t>(points[0]) +
         static_cast<std::size_t>(i);
}

Index index_of(std::size_t number, const Index& points) {
  const auto nx = static_cast<std::size_t>(points[0]), ny = static_cast<std::size_t>(points[1]);
  return {static_cast<int>(number % nx), static_cast<int>(number / nx % ny),
          static_cast<int>(number / nx / ny)};
}

bool is_on(const Index& at, const Index& points) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (at[axis] < 0 || at[axis] >= points[axis]) return false;
  }
  return true;
}

Index moved(Index at, std::size_t axis, int by) {
  at[axis] += by;
  return at;
}

/// Which inside points of the coarse grid belong to bodies that are kept, and which look loose.
struct CoarseBodies {
  enum Kind : std::uint8_t { outside, kept, suspect };
  std::vector<Kind> kinds;
  std::vector<std::size_t> suspects;
  double largest = 0;  ///< points
  double kept_points = 0;
};

CoarseBodies coarse_bodies(const Grid& grid, const std::vector<bool>& is_inside) {
  base::UnionFind bodies(is_inside.size());
  const std::size_t row = static_cast<std::size_t>(grid.points[0]);
  const std::array<std::size_t, 3> stride{1, row, row * static_cast<std::size_t>(grid.points[1])};
  std::size_t number = 0;
  for (int k = 0; k < grid.points[2]; ++k) {
    for (int j = 0; j < grid.points[1]; ++j) {
      for (int i = 0; i < grid.points[0]; ++i, ++number) {
        if (!is_inside[number]) continue;
        const Index at{i, j, k};
        for (std::size_t axis = 0; axis < 3; ++axis) {
          if (at[axis] == 0 || !is_inside[number - stride[axis]]) continue;
          bodies.unite(static_cast<std::uint32_t>(number),
                       static_cast<std::uint32_t>(number - stride[axis]));
        }
      }
    }
  }
  std::vector<std::uint32_t> sizes(is_inside.size());
  for (std::uint32_t i = 0; i < sizes.size(); ++i) {
    if (is_inside[i]) ++sizes[bodies.root(i)];
  }
  CoarseBodies found;
  found.largest = sizes.empty() ? 0 : *std::ranges::max_element(sizes);
  found.kinds.resize(sizes.size());
  for (std::uint32_t i = 0; i < sizes.size(); ++i) {
    if (!is_inside[i]) continue;
    const bool is_kept = sizes[bodies.root(i)] >= kLeast * found.largest;
    found.kinds[i] = is_kept ? CoarseBodies::kept : CoarseBodies::suspect;
    if (is_kept) ++found.kept_points;
    if (!is_kept) found.suspects.push_back(i);
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
  for (int k = 0; k + 1 < grid.points[2]; ++k) {
    for (int j = 0; j + 1 < grid.points[1]; ++j) {
      for (int i = 0; i + 1 < grid.points[0]; ++i) {
        const std::size_t first = number_of({i, j, k}, grid.points);
        bool is_asked = false, has_body = false;
        for (const std::size_t corner : {first, first + row, first + slice, first + slice + row}) {
          for (const std::size_t at : {corner, corner + 1}) {
            is_asked = is_asked || may_be_inside[at];
            has_body = has_body || coarse.kinds[at] == CoarseBodies::kept;
          }
        }
        if (is_asked && !has_body) cells.push_back(first);
      }
    }
  }
  return cells;
}

/// The fine grid, known in blocks: a block is a cell of the coarse grid, with the fine points from
/// its lower corner on, `divisions` along each side.
class FineBlocks {
 public:
  FineBlocks(const Grid& coarse, int divisions, const Insides& insides)
      : coarse_points_(coarse.points),
        divisions_(divisions),
        insides_(insides),
        slots_(whole(coarse).size(), kUnknown) {
    fine_.origin = coarse.origin;
    fine_.step = coarse.step / divisions;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      fine_.points[axis] = coarse.points[axis] * divisions;
    }
  }

  const Grid& grid() const { return fine_; }
  std::size_t size() const { return inside_.size(); }
  bool is_inside(std::size_t place) const { return inside_[place]; }

  /// The block of a fine point is to be known after the next `look`.
  void want(const Index& at) {
    if (!is_on(at, fine_.points)) return;
    const std::size_t block = block_of(at);
    if (slots_[block] != kUnknown) return;
    slots_[block] = kWanted;
    wanted_.push_back(block);
  }

  /// Asks for the points of the blocks that are wanted; whether there were any.
  bool look() {
    if (wanted_.empty()) return false;
    std::vector<Eigen::Vector3d> points;
    points.reserve(wanted_.size() * block_points());
    for (const std::size_t block : wanted_) {
      slots_[block] = static_cast<std::int32_t>(blocks_.size());
      blocks_.push_back(block);
      for (std::size_t i = 0; i < block_points(); ++i) {
        const Index at = point_of(blocks_.size() - 1, i);
        points.push_back(fine_.at(Eigen::Vector3d(at[0], at[1], at[2])));
      }
    }
    wanted_.clear();
    const std::vector<bool> found = insides_(points);
    inside_.insert(inside_.end(), found.begin(), found.end());
    return true;
  }

  static constexpr std::ptrdiff_t kNowhere = -1;
  /// Where a fine point stands in the order of what is known; `kNowhere` where its block is not.
  std::ptrdiff_t place(const Index& at) const {
    if (!is_on(at, fine_.points)) return kNowhere;
    const std::int32_t slot = slots_[block_of(at)];
    if (slot < 0) return kNowhere;
    const Index in{at[0] % divisions_, at[1] % divisions_, at[2] % divisions_};
    return static_cast<std::ptrdiff_t>(static_cast<std::size_t>(slot) * block_points() +
                                       number_of(in, {divisions_, divisions_, divisions_}));
  }
  /// The fine point of a place.
  Index at(std::size_t place) const {
    return point_of(place / block_points(), place % block_points());
  }
  /// Whether it is a point of the coarse grid as well, and which.
  bool is_coarse(const Index& at, std::size_t& number) const {
    for (const int i : at) {
      if (i % divisions_ != 0) return false;
    }
    number = block_of(at);
    return true;
  }

 private:
  static constexpr std::int32_t kUnknown = -1, kWanted = -2;

  std::size_t block_points() const {
    const auto d = static_cast<std::size_t>(divisions_);
    return d * d * d;
  }
  std::size_t block_of(const Index& at) const {
    return number_of({at[0] / divisions_, at[1] / divisions_, at[2] / divisions_}, coarse_points_);
  }
  Index point_of(std::size_t slot, std::size_t in_block) const {
    const Index block = index_of(blocks_[slot], coarse_points_);
    const Index in = index_of(in_block, {divisions_, divisions_, divisions_});
    return {block[0] * divisions_ + in[0], block[1] * divisions_ + in[1],
            block[2] * divisions_ + in[2]};
  }

  std::array<int, 3> coarse_points_;
  int divisions_;
  const Insides& insides_;
  Grid fine_;
  std::vector<std::int32_t> slots_;  ///< of coarse cells: number of a known block
  std::vector<std::size_t> blocks_, wanted_;
  std::vector<bool> inside_;
};

/// Bodies of the fine points that are known.
struct FineBodies {
  base::UnionFind bodies;
  std::uint32_t kept = 0;  ///< what hangs on a body that is kept is one with this element
};

FineBodies fine_bodies(const FineBlocks& fine, const CoarseBodies& coarse) {
  FineBodies found{base::UnionFind(fine.size() + 1), static_cast<std::uint32_t>(fine.size())};
  for (std::uint32_t place = 0; place < fine.size(); ++place) {
    if (!fine.is_inside(place)) continue;
    const Index at = fine.at(place);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::ptrdiff_t next = fine.place(moved(at, axis, 1));
      if (next == FineBlocks::kNowhere || !fine.is_inside(static_cast<std::size_t>(next))) continue;
      found.bodies.unite(place, static_cast<std::uint32_t>(next));
    }
    std::size_t number = 0;
    if (fine.is_coarse(at, number) && coarse.kinds[number] == CoarseBodies::kept) {
      found.bodies.unite(place, found.kept);
    }
  }
  return found;
}

/// Marks the bodies that may go on in blocks that are not known, and asks for these blocks where a
/// body looked loose on the coarse grid.
std::vector<bool> follow(FineBlocks& fine, FineBodies& found, const CoarseBodies& coarse) {
  std::vector<bool> goes_on(fine.size()), is_suspect(fine.size());
  for (std::uint32_t place = 0; place < fine.size(); ++place) {
    std::size_t number = 0;
    if (fine.is_inside(place) && fine.is_coarse(fine.at(place), number) &&
        coarse.kinds[number] == CoarseBodies::suspect &&
        found.bodies.root(place) != found.bodies.root(found.kept)) {
      is_suspect[found.bodies.root(place)] = true;
    }
  }
  for (std::uint32_t place = 0; place < fine.size(); ++place) {
    if (!fine.is_inside(place)) continue;
    const std::uint32_t body = found.bodies.root(place);
    if (body == found.bodies.root(found.kept)) continue;
    const Index at = fine.at(place);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      for (const int by : {-1, 1}) {
        const Index next = moved(at, axis, by);
        if (!is_on(next, fine.grid().points) || fine.place(next) != FineBlocks::kNowhere) continue;
        fine.want(next);
        goes_on[body] = true;
      }
    }
  }
  return goes_on;
}

/// Calls `take` with each index at most `reach` from another along each axis.
template <class Take>
void for_around(const Index& at, int reach, const Take& take) {
  for (int k = -reach; k <= reach; ++k) {
    for (int j = -reach; j <= reach; ++j) {
      for (int i = -reach; i <= reach; ++i) take(Index{at[0] + i, at[1] + j, at[2] + k});
    }
  }
}

}  // namespace

bool LoosePlaces::holds(const Eigen::Vector3d& p) const {
  if (bits.empty()) return false;
  Index at{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<Eigen::Index>(axis);
    at[axis] = static_cast<int>(std::lround((p[i] - grid.origin[i]) / grid.step));
  }
  if (!is_on(at, grid.points)) return false;
  const std::size_t number = number_of(at, grid.points);
  return ((bits[number / 32] >> (number % 32)) & 1U) != 0;
}

LoosePlaces find_loose_places(const Grid& grid, const std::vector<bool>& is_inside,
                              const std::vector<bool>& may_be_inside, int divisions,
                              const Insides& insides) {
  const CoarseBodies coarse = coarse_bodies(grid, is_inside);
  FineBlocks fine(grid, divisions, insides);
  for (const std::size_t suspect : coarse.suspects) {
    Index at = index_of(suspect, grid.points);
    for (int& i : at) i *= divisions;
    for_around(at, 1, [&](const Index& i) { fine.want(i); });
  }
  for (const std::size_t cell : cells_beside(grid, coarse, may_be_inside)) {
    Index at = index_of(cell, grid.points);
    for (int& i : at) i *= divisions;
    fine.want(at);
  }
  FineBodies found;
  std::vector<bool> goes_on;
  for (int round = 0; round < kMostRounds && fine.look(); ++round) {
    found = fine_bodies(fine, coarse);
    goes_on = follow(fine, found, coarse);
  }
  // What lies about loose pieces, too.
  for (std::uint32_t place = 0; place < goes_on.size(); ++place) {
    if (!fine.is_inside(place)) continue;
    const std::uint32_t body = found.bodies.root(place);
    if (body == found.bodies.root(found.kept) || goes_on[body]) continue;
    for_around(fine.at(place), kMargin + 1, [&](const Index& i) { fine.want(i); });
  }
  if (fine.look()) {
    found = fine_bodies(fine, coarse);
    goes_on = follow(fine, found, coarse);
  }
  if (fine.size() == 0) return {};
  const std::uint32_t kept = found.bodies.root(found.kept);
  std::vector<std::uint32_t> sizes(found.bodies.size());
  for (std::uint32_t place = 0; place + 1 < sizes.size(); ++place) {
    if (fine.is_inside(place)) ++sizes[found.bodies.root(place)];
  }
  const double cell = std::pow(fine.grid().step, 3);
  const double most = kLeast * coarse.largest * divisions * divisions * divisions;
  const auto is_loose = [&](std::uint32_t body) {
    return body != kept && sizes[body] > 0 && !goes_on[body] && sizes[body] < most;
  };

  LoosePlaces places;
  for (std::uint32_t body = 0; body < goes_on.size(); ++body) {
    if (!is_loose(body)) continue;
    ++places.pieces.count;
    places.pieces.volume += cell * sizes[body];
  }
  if (places.pieces.count == 0) return {};
  const double all = places.pieces.volume + std::pow(grid.step, 3) * coarse.kept_points;
  places.pieces.share = places.pieces.volume / all;
  places.grid = fine.grid();
  places.bits.resize((whole(fine.grid()).size() + 31) / 32);
  for (std::uint32_t place = 0; place < goes_on.size(); ++place) {
    if (!fine.is_inside(place) || !is_loose(found.bodies.root(place))) continue;
    for_around(fine.at(place), kMargin, [&](const Index& at) {
      if (!is_on(at, fine.grid().points)) return;
      const std::size_t number = number_of(at, fine.grid().points);
      places.bits[number / 32] |= 1U << (number % 32);
    });
  }
  // What is kept keeps its surface.
  for (std::uint32_t place = 0; place < goes_on.size(); ++place) {
    if (!fine.is_inside(place) || is_loose(found.bodies.root(place))) continue;
    for_around(fine.at(place), 1, [&](const Index& at) {
      if (!is_on(at, fine.grid().points)) return;
      const std::ptrdiff_t other = fine.place(at);
      if (other != FineBlocks::kNowhere && fine.is_inside(static_cast<std::size_t>(other)) &&
          is_loose(found.bodies.root(static_cast<std::uint32_t>(other)))) {
        return;
      }
      const std::size_t number = number_of(at, fine.grid().points);
      places.bits[number / 32] &= ~(1U << (number % 32));
    });
  }
  return places;
}

}  // namespace qjulia::surface

#include "surface/loose_places.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

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

/// The fine grid, known in blocks: a block is a cell of the coarse grid, with the fine points from
/// its lower corner on, `divisions` along each side.
class FineBlocks {
 public:
  FineBlocks(const Grid& coarse, const CoarseBodies& bodies, int divisions, const Insides& insides)
      : coarse_points_(coarse.points),
        bodies_(bodies),
        divisions_(divisions),
        block_{Index::Zero(), Index::Constant(divisions)},
        insides_(insides),
        fine_{coarse.origin, coarse.step / divisions, divisions * coarse.points},
        slots_(whole(coarse).size(), kUnknown) {}

  const Grid& grid() const { return fine_; }
  std::size_t size() const { return inside_.size(); }
  bool is_inside(std::size_t place) const { return inside_[place]; }

  /// The blocks of all fine points at most `reach` from `middle` are to be known after the next
  /// `look`.
  void want(const Index& middle, int reach) {
    for_around(fine_.points, middle, reach, [&](std::size_t, const Index& at) {
      const std::size_t block = block_of(at);
      if (slots_[block] != kUnknown) return;
      slots_[block] = kWanted;
      wanted_.push_back(block);
    });
  }

  /// Asks for the points of the blocks that are wanted; whether there were any.
  bool look() {
    if (wanted_.empty()) return false;
    std::vector<Eigen::Vector3d> points;
    points.reserve(wanted_.size() * block_.size());
    for (const std::size_t block : wanted_) {
      slots_[block] = static_cast<std::int32_t>(blocks_.size());
      blocks_.push_back(block);
      const std::size_t first = (blocks_.size() - 1) * block_.size();
      for (std::size_t i = 0; i < block_.size(); ++i) points.push_back(fine_.point(at(first + i)));
    }
    wanted_.clear();
    const std::vector<bool> found = insides_(points);
    inside_.insert(inside_.end(), found.begin(), found.end());
    return true;
  }

  static constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
  /// Where a fine point stands in the order of what is known; `kNowhere` where its block is not.
  std::size_t place(const Index& at) const {
    if (!is_on_grid(at)) return kNowhere;
    const std::int32_t slot = slots_[block_of(at)];
    if (slot < 0) return kNowhere;
    const Index in_block = at - divisions_ * (at / divisions_);
    return static_cast<std::size_t>(slot) * block_.size() + number_of(in_block, block_.count);
  }
  /// The fine point of a place.
  Index at(std::size_t place) const {
    return divisions_ * index_of(blocks_[place / block_.size()], coarse_points_) +
           index_of(place % block_.size(), block_.count);
  }
  bool is_on_grid(const Index& at) const {
    return (at.array() >= 0).all() && (at.array() < fine_.points.array()).all();
  }
  /// Whether a fine point is one of the coarse grid as well, in a body that is kept.
  bool is_kept(const Index& at) const {
    return at == divisions_ * (at / divisions_) && bodies_.is_kept[block_of(at)];
  }

 private:
  static constexpr std::int32_t kUnknown = -1, kWanted = -2;

  std::size_t block_of(const Index& at) const { return number_of(at / divisions_, coarse_points_); }

  Index coarse_points_;
  const CoarseBodies& bodies_;
  int divisions_;
  GridBlock block_;  ///< the points of one
  const Insides& insides_;
  Grid fine_;
  std::vector<std::int32_t> slots_;  ///< of coarse cells: number of a known block
  std::vector<std::size_t> blocks_, wanted_;
  std::vector<bool> inside_;
};

/// Bodies of the fine points that are known.
struct FineBodies {
  base::UnionFind bodies;
  std::uint32_t kept = 0;     ///< what hangs on a body that is kept is one with this element
  std::vector<bool> goes_on;  ///< by root: whether more of a body may be in blocks not known

  bool is_kept(std::uint32_t place) { return bodies.root(place) == bodies.root(kept); }
};

/// Asks for the blocks in which bodies that are not kept may go on.
FineBodies fine_bodies(FineBlocks& fine) {
  FineBodies found{base::UnionFind(fine.size() + 1), static_cast<std::uint32_t>(fine.size()),
                   std::vector<bool>(fine.size())};
  for (std::uint32_t place = 0; place < fine.size(); ++place) {
    if (!fine.is_inside(place)) continue;
    const Index at = fine.at(place);
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t next = fine.place(at + Index::Unit(axis));
      if (next == FineBlocks::kNowhere || !fine.is_inside(next)) continue;
      found.bodies.unite(place, static_cast<std::uint32_t>(next));
    }
    if (fine.is_kept(at)) found.bodies.unite(place, found.kept);
  }
  for (std::uint32_t place = 0; place < fine.size(); ++place) {
    if (!fine.is_inside(place) || found.is_kept(place)) continue;
    const Index at = fine.at(place);
    for (int axis = 0; axis < 3; ++axis) {
      for (const int by : {-1, 1}) {
        const Index next = at + by * Index::Unit(axis);
        if (!fine.is_on_grid(next) || fine.place(next) != FineBlocks::kNowhere) continue;
        fine.want(next, 0);
        found.goes_on[found.bodies.root(place)] = true;
      }
    }
  }
  return found;
}

}  // namespace

bool LoosePlaces::holds(const Eigen::Vector3d& p) const {
  if (bits.empty()) return false;
  const Eigen::Array3d at = ((p - grid.origin) / grid.step).array().round();
  if (!(at >= 0).all() || !(at < grid.points.cast<double>().array()).all()) return false;
  const std::size_t number = number_of(at.cast<int>(), grid.points);
  return ((bits[number / 32] >> (number % 32)) & 1U) != 0;
}

LoosePlaces find_loose_places(const Grid& grid, const std::vector<bool>& is_inside,
                              const std::vector<bool>& may_be_inside, int divisions,
                              const Insides& insides) {
  const CoarseBodies coarse = coarse_bodies(grid, is_inside);
  FineBlocks fine(grid, coarse, divisions, insides);
  for (const std::size_t suspect : coarse.suspects) {
    fine.want(divisions * index_of(suspect, grid.points), 1);
  }
  for (const std::size_t cell : cells_beside(grid, coarse, may_be_inside)) {
    fine.want(divisions * index_of(cell, grid.points), 0);
  }
  FineBodies found;
  for (int round = 0; round < kMostRounds && fine.look(); ++round) found = fine_bodies(fine);
  // What lies about loose pieces, too.
  for (std::uint32_t place = 0; place < found.goes_on.size(); ++place) {
    if (!fine.is_inside(place) || found.is_kept(place) || found.goes_on[found.bodies.root(place)]) {
      continue;
    }
    fine.want(fine.at(place), kMargin + 1);
  }
  if (fine.look()) found = fine_bodies(fine);
  if (fine.size() == 0) return {};
  const std::uint32_t kept = found.bodies.root(found.kept);
  std::vector<std::uint32_t> sizes(found.bodies.size());
  for (std::uint32_t place = 0; place < fine.size(); ++place) {
    if (fine.is_inside(place)) ++sizes[found.bodies.root(place)];
  }
  const double cell = std::pow(fine.grid().step, 3);
  const double most = kLeast * coarse.largest * divisions * divisions * divisions;
  const auto is_loose = [&](std::uint32_t body) {
    return body != kept && sizes[body] > 0 && !found.goes_on[body] && sizes[body] < most;
  };

  LoosePlaces places;
  for (std::uint32_t body = 0; body < fine.size(); ++body) {
    if (!is_loose(body)) continue;
    ++places.pieces.count;
    places.pieces.volume += cell * sizes[body];
  }
  if (places.pieces.count == 0) return {};
  const double all = places.pieces.volume + std::pow(grid.step, 3) * coarse.kept_points;
  places.pieces.share = places.pieces.volume / all;
  places.grid = fine.grid();
  const Index& points = places.grid.points;
  places.bits.resize((whole(places.grid).size() + 31) / 32);
  for (std::uint32_t place = 0; place < fine.size(); ++place) {
    if (!fine.is_inside(place) || !is_loose(found.bodies.root(place))) continue;
    for_around(points, fine.at(place), kMargin, [&](std::size_t number, const Index&) {
      places.bits[number / 32] |= 1U << (number % 32);
    });
  }
  // What is kept keeps its surface.
  for (std::uint32_t place = 0; place < fine.size(); ++place) {
    if (!fine.is_inside(place) || is_loose(found.bodies.root(place))) continue;
    for_around(points, fine.at(place), 1, [&](std::size_t number, const Index& at) {
      const std::size_t other = fine.place(at);
      if (other != FineBlocks::kNowhere && fine.is_inside(other) &&
          is_loose(found.bodies.root(static_cast<std::uint32_t>(other)))) {
        return;
      }
      places.bits[number / 32] &= ~(1U << (number % 32));
    });
  }
  return places;
}

}  // namespace qjulia::surface

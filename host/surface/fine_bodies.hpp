#pragma once
/// Follows the bodies of a set over a fine grid without asking for all of its points.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <vector>

#include "base/union_find.hpp"
#include "lattice/grid.hpp"

namespace qjulia::surface {

/// Returns for each of these points, in map coordinates, whether it is inside the set.
using Insides = std::function<std::vector<bool>(const std::vector<Eigen::Vector3d>&)>;

/// Which inside points hang together: only those at both ends of an edge of the grid, or also those
/// across a diagonal of a square or a cell, as in a sheet that is thinner than a step.
enum class Links { edges, diagonals };

/// Points of the fine grid are known in blocks. A block is a cell of a coarse grid, with the fine
/// points from its lower corner on, `divisions` along each side. A point's place is its number in
/// the order in which points became known.
class FineBodies {
 public:
  /// @param is_kept which points of the coarse grid are in bodies that are kept.
  FineBodies(const Grid& coarse, const std::vector<bool>& is_kept, int divisions, Links links,
             const Insides& insides);

  static constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

  const Grid& grid() const { return fine_; }
  /// The known blocks, by the numbers of their cells' lower corners.
  const std::vector<std::size_t>& blocks() const { return blocks_; }
  std::size_t points_a_block() const { return block_.size(); }
  std::size_t size() const { return inside_.size(); }
  /// The place of a fine point; `kNowhere` if its block is not known.
  std::size_t place(const Eigen::Vector3i& at) const;
  /// The fine point of a place.
  Eigen::Vector3i at(std::size_t place) const {
    return block_.count.x() * index_of(blocks_[place / block_.size()], coarse_points_) +
           index_of(place % block_.size(), block_.count);
  }

  /// Wants the blocks of all fine points at most `reach` steps from `middle` along each axis.
  void want(const Eigen::Vector3i& middle, int reach);
  std::size_t wanted_blocks() const { return wanted_.size(); }

  /// Asks for the points of the blocks that are wanted. Then asks for the blocks in which bodies
  /// may go on that are not yet attached to anything kept, and so on, at most `rounds` times.
  void follow(int rounds);
  /// Asks for all points at most `reach` steps from those of loose bodies.
  void look_around_loose(int reach);

  /// Calls those bodies loose from now on that have fewer points, are attached to nothing kept, and
  /// do not reach a block that is not known.
  void find_loose(double points);
  bool is_inside(std::size_t place) const { return inside_[place]; }
  bool is_loose(std::size_t place) const { return loose_[place]; }
  /// The places of each loose body's points.
  std::vector<std::vector<std::size_t>> loose_bodies();

  /// Calls `mark(at, true)` for the points at most `margin` steps from loose ones. Then calls
  /// `mark(at, false)` for those that are next to other inside points and not loose themselves, so
  /// that what is kept keeps its surface.
  template <class Mark>
  void mark(int margin, const Mark& mark) const {
    for_inside(0, [&](std::size_t place, const Eigen::Vector3i& at) {
      if (!loose_[place]) return;
      for_around(fine_.points, at, margin,
                 [&](std::size_t, const Eigen::Vector3i& about) { mark(about, true); });
    });
    for_inside(0, [&](std::size_t place, const Eigen::Vector3i& at) {
      if (loose_[place]) return;
      for_around(fine_.points, at, 1, [&](std::size_t, const Eigen::Vector3i& about) {
        const std::size_t other = this->place(about);
        if (other == kNowhere || !loose_[other]) mark(about, false);
      });
    });
  }

 private:
  static constexpr std::int32_t kUnknown = -1, kWanted = -2;
  /// Everything attached to a body that is kept is united with this element; place p is element
  /// p + 1.
  static constexpr std::uint32_t kKept = 0;

  bool is_on_grid(const Eigen::Vector3i& at) const {
    return (at.array() >= 0).all() && (at.array() < fine_.points.array()).all();
  }
  std::uint32_t body_of(std::size_t place) {
    return bodies_.root(static_cast<std::uint32_t>(place + 1));
  }
  bool look();
  void unite_from(std::size_t first_block);

  /// Calls `visit(place, at)` for the inside points of known blocks, from `first_block` on.
  template <class Visit>
  void for_inside(std::size_t first_block, const Visit& visit) const {
    std::size_t place = first_block * block_.size();
    for (std::size_t block = first_block; block < blocks_.size(); ++block) {
      const Eigen::Vector3i lower = block_.count.x() * index_of(blocks_[block], coarse_points_);
      for_points(block_.count, [&](std::size_t, const Eigen::Vector3i& in_block) {
        if (inside_[place]) visit(place, lower + in_block);
        ++place;
      });
    }
  }
  /// Calls `visit(next)` for the points of the grid that hang together with `at` if both are
  /// inside.
  template <class Visit>
  void for_next(const Eigen::Vector3i& at, const Visit& visit) const {
    if (links_ == Links::diagonals) {
      for_around(fine_.points, at, 1, [&](std::size_t, const Eigen::Vector3i& next) {
        if (next != at) visit(next);
      });
      return;
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (const int by : {-1, 1}) {
        const Eigen::Vector3i next = at + by * Eigen::Vector3i::Unit(axis);
        if (is_on_grid(next)) visit(next);
      }
    }
  }

  Eigen::Vector3i coarse_points_;
  const std::vector<bool>& is_kept_;
  GridBlock block_;  ///< the points of one
  Links links_;
  const Insides& insides_;
  Grid fine_;
  std::vector<std::int32_t> slots_;  ///< for each coarse cell the number of a known block
  std::vector<std::size_t> blocks_, wanted_;
  std::vector<bool> inside_, loose_;
  base::UnionFind bodies_{1};
};

}  // namespace qjulia::surface

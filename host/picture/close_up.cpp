#include "picture/close_up.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "device/point_batch.hpp"
#include "layout/picture_layout.h"
#include "picture/depth_grid.hpp"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using Level = surface::ImageLattice::Level;

/// Nodes of a level lie at least so many pixels apart: closer ones are more than what they save.
constexpr double kNearestNodes = 1.5;
/// Pixels. A level whose nodes would have to lie nearer than this is not made: too few of its cells
/// would be trusted.
constexpr double kTooNear = 0.8;
/// Cells along each axis times each other: their lists take a bit for each; and where blocks of
/// them are looked at one by one.
constexpr double kMostCells = 2e8, kMostLookedAt = 24e6;
/// A level about orbits in sight has at most so many cells for each ray: many of them serve few.
constexpr double kNeededCells = 0.5;
/// A level about orbits in sight reaches at most so many times the picture's width beyond its edge.
constexpr double kAside = 0.2;
/// Depths of neighbours among few rays that differ by more than so many of their distances have
/// nothing between them.
constexpr double kBreak = 4;

/// Unit vectors to the right, downward and ahead, in rows.
Eigen::Matrix3d axes_of(const View& view) {
  Eigen::Matrix3d axes;
  axes.row(0) = view.dir_dx.normalized();
  axes.row(1) = view.dir_dy.normalized();
  axes.row(2) = axes.row(0).cross(axes.row(1));
  return axes;
}

/// Calls `take(cell)` for the cells of a level that have a cell on every side, in their order.
/// Blocks of which `is_asked_for(middle, cells)` says no are left out: it says whether any of the
/// cells about the middle, in map coordinates, may be asked for.
template <class IsAskedFor>
void take_cells(Level& level, const IsAskedFor& is_asked_for) {
  constexpr int kBlock = 4;
  constexpr double kMargin = 1.3;  // steps grow by more than the way in steep places
  const surface::Grid& grid = level.grid;
  const auto middle = [&](const Eigen::Vector3i& first, double cells) -> Vector3d {
    return level.axes.transpose() * grid.at(first.cast<double>().array() + 0.5 * cells);
  };
  const Eigen::Vector3i last = grid.points.array() - 3;
  surface::for_points(
      (last.array() + kBlock - 1) / kBlock, [&](std::size_t, const Eigen::Vector3i& block) {
        const Eigen::Vector3i first = kBlock * block.array() + 1;
        if (!is_asked_for(middle(first, kBlock), kMargin * kBlock)) return;
        surface::for_points(
            (last - first).cwiseMin(kBlock - 1).array() + 1,
            [&](std::size_t, const Eigen::Vector3i& inner) {
              const Eigen::Vector3i cell = first + inner;
              if (!is_asked_for(middle(cell, 1), 1)) return;
              level.cells.push_back(device::narrow(surface::number_of(cell, grid.points)));
            });
      });
}

class Sight {
 public:
  Sight(const CloseUp& close_up, const HasOrbitsNear& has_orbits_near)
      : close_up_(close_up),
        has_orbits_near_(has_orbits_near),
        axes_(axes_of(close_up.view)),
        in_sight_(close_up.few, close_up.depths, close_up.around),
        in_depth_(close_up.few, close_up.depths, close_up.reach) {}

  /// Distance of nodes with which most cells are trusted, map units.
  double wanted_step(int iterates) const {
    return surface::ImageLattice::step_for(
        close_up_.typical, close_up_.stretches[static_cast<std::size_t>(iterates - 1)]);
  }

  /// Of first iterates, wherever rays in sight run orbits.
  Level wide_level() const {
    const Eigen::AlignedBox3d box = band_in_sight();
    Level level = empty_level(1);
    const double step = level.grid.step;
    if (box.isEmpty() || !((box.sizes() / step).prod() < kMostLookedAt)) return level;
    level.grid = surface::ImageLattice::grid_about({box.min(), box.max()}, step);
    const double reach = std::sqrt(0.75) * step;  // from a cell's middle to its corners
    take_cells(level, [&](const Vector3d& p, double cells) {
      return has_orbits_near_(p, cells * reach) && in_sight_(p, cells * reach + close_up_.around);
    });
    return level;
  }

  /// Wherever orbits in sight need as many iterates. Empty if that is too much.
  /// @param fields after so many iterates.
  Level needed_level(int iterates, const Fields& fields) const {
    Level level = empty_level(iterates);
    const double step = level.grid.step;
    Eigen::AlignedBox3d seen;
    for (const Seen& s : all_seen()) {
      for (const double depth : {s.from, s.to}) seen.extend(at(s, depth));
    }
    if (seen.isEmpty()) return level;
    // As far around as light comes from, if there is room for as many cells, but little farther
    // than what is seen.
    double around =
        std::min(close_up_.around, kAside * close_up_.few.footprint * close_up_.few.columns);
    const auto box = [&] {
      return Eigen::AlignedBox3d(Vector3d(seen.min().array() - around),
                                 Vector3d(seen.max().array() + around));
    };
    while ((box().sizes() / step).prod() > kMostLookedAt) {
      around *= 0.7;
      if (around < close_up_.reach) return level;
    }
    level.grid = surface::ImageLattice::grid_about({box().min(), box().max()}, step);
    // F changes by so much a map unit.
    const double slope =
        close_up_.steepest * close_up_.stretches[static_cast<std::size_t>(iterates - 2)];
    constexpr int kBlock = 4;
    const Vector3i last = level.grid.points.array() - 3;  // cells that have one on every side
    std::vector<Vector3i> firsts;
    surface::for_points((last.array() + kBlock - 1) / kBlock,
                        [&](std::size_t, const Vector3i& block) {
                          firsts.emplace_back(kBlock * block.array() + 1);
                        });
    keep_needed(level.grid, firsts, kBlock, around, slope, fields);
    const double most = kNeededCells * close_up_.view.columns * close_up_.view.rows;
    // Only some of the blocks are counted, evenly spread; the others are likely to have as many
    // cells.
    constexpr std::size_t kStride = 16;
    std::vector<Vector3i> cells;
    for (std::size_t part = 0; part < kStride; ++part) {
      std::vector<Vector3i> more;
      for (std::size_t i = part; i < firsts.size(); i += kStride) {
        surface::for_points(
            (last - firsts[i]).cwiseMin(kBlock - 1).array() + 1,
            [&](std::size_t, const Vector3i& inner) { more.emplace_back(firsts[i] + inner); });
      }
      keep_needed(level.grid, more, 1, around, slope, fields);
      cells.insert(cells.end(), more.begin(), more.end());
      if (static_cast<double>(cells.size() * kStride) > most * static_cast<double>(part + 1)) {
        return level;
      }
    }
    for (const Vector3i& cell : cells) {
      level.cells.push_back(device::narrow(surface::number_of(cell, level.grid.points)));
    }
    return level;
  }

  /// About what is seen, or most of it where that is too much.
  Level near_level(int iterates) const {
    Level level = empty_level(iterates);
    const double step = level.grid.step;
    std::vector<Seen> seen = all_seen();
    double longest = std::numeric_limits<double>::infinity();  // along the depths
    while (!seen.empty()) {
      Eigen::AlignedBox3d box = box_about(seen, step);
      longest =
          std::min(longest, kMostCells * step * step * step / (box.sizes().x() * box.sizes().y()));
      if (longest < box.sizes().z()) {
        leave_out_far(seen, longest);
        box = box_about(seen, step);
      }
      level.grid = surface::ImageLattice::grid_about({box.min(), box.max()}, step);
      level.cells = cells_about(seen, level.grid);
      const double share = close_up_.most_nodes / static_cast<double>(level.cells.size());
      if (!(share < 1)) break;
      longest = 0.8 * share * box.sizes().z();
    }
    return level;
  }

 private:
  /// What one of the few rays sees of the set: a pixel, and depths between which others about it
  /// are likely to bisect.
  struct Seen {
    double x, y, from, to;
  };

  Level empty_level(int iterates) const {
    Level level{iterates, close_up_.displacement, axes_, {}, {}};
    level.grid.step = wanted_step(iterates);
    if (iterates > 1) {
      level.grid.step = std::max(level.grid.step,
                                 kNearestNodes * close_up_.view.footprint * close_up_.view.samples);
    }
    return level;
  }

  /// Along the axes.
  Vector3d at(const Seen& s, double depth) const {
    return axes_ * close_up_.few.at(s.x, s.y, depth);
  }

  std::vector<Seen> all_seen() const {
    const View& few = close_up_.few;
    const DepthGrid depths{few.columns, few.rows, close_up_.depths};
    const double gap = kBreak * few.footprint;
    std::vector<Seen> seen;
    for (int row = 0; row < few.rows; ++row) {
      for (int column = 0; column < few.columns; ++column) {
        const double depth = double{depths.at(column, row)};
        if (depth < 0) continue;
        Seen s{column + 0.5, row + 0.5, depth, depth};
        for (int j = std::max(row - 1, 0); j <= std::min(row + 1, few.rows - 1); ++j) {
          for (int i = std::max(column - 1, 0); i <= std::min(column + 1, few.columns - 1); ++i) {
            const double other = double{depths.at(i, j)};
            if (other < 0 || std::abs(other - depth) > gap) continue;
            s.from = std::min(s.from, 0.5 * (other + depth));
            s.to = std::max(s.to, 0.5 * (other + depth));
          }
        }
        s.from -= close_up_.reach;
        s.to += close_up_.reach;
        seen.push_back(s);
      }
    }
    return seen;
  }

  /// With room for the cells around, along the axes.
  Eigen::AlignedBox3d box_about(const std::vector<Seen>& seen, double step) const {
    const double margin = 0.5 * close_up_.few.footprint + step;
    Eigen::AlignedBox3d box;
    for (const Seen& s : seen) {
      for (const double depth : {s.from, s.to}) {
        const Vector3d along = at(s, depth);
        box.extend(Vector3d(along.array() - margin));
        box.extend(Vector3d(along.array() + margin));
      }
    }
    return box;
  }

  /// The cells that the rays of these pixels pass through between their depths.
  std::vector<std::int32_t> cells_about(const std::vector<Seen>& seen,
                                        const surface::Grid& grid) const {
    const double step = grid.step, wide = close_up_.few.footprint / step;  // cells
    std::vector<bool> marked(whole(grid).size());
    for (const Seen& s : seen) {
      for (double depth = s.from; depth < s.to + step; depth += 0.5 * step) {
        const Eigen::Array3d cell = (at(s, depth) - grid.origin) / step;
        const auto k = static_cast<int>(cell.z());
        if (k < 1 || k > grid.points.z() - 3) continue;
        const auto range = [&](Eigen::Index axis) {
          return std::pair(
              std::max(1, static_cast<int>(cell[axis] - 0.5 * wide)),
              std::min(grid.points[axis] - 3, static_cast<int>(cell[axis] + 0.5 * wide)));
        };
        const auto [left, right] = range(0);
        const auto [top, bottom] = range(1);
        for (int j = top; j <= bottom; ++j) {
          for (int i = left; i <= right; ++i) {
            marked[surface::number_of({i, j, k}, grid.points)] = true;
          }
        }
      }
    }
    std::vector<std::int32_t> cells;
    for (std::size_t i = 0; i < marked.size(); ++i) {
      if (marked[i]) cells.push_back(device::narrow(i));
    }
    return cells;
  }

  /// Keeps most of what lies within a range of depths of this length.
  static void leave_out_far(std::vector<Seen>& seen, double longest) {
    std::ranges::sort(seen, {}, &Seen::from);
    std::size_t best = 0, most = 0;
    for (std::size_t first = 0, end = 0; first < seen.size(); ++first) {
      while (end < seen.size() && seen[end].to - seen[first].from < 0.9 * longest) ++end;
      if (end > first && end - first > most) best = first, most = end - first;
    }
    seen = std::vector<Seen>(seen.begin() + static_cast<std::ptrdiff_t>(best),
                             seen.begin() + static_cast<std::ptrdiff_t>(best + most));
  }

  /// Leaves those blocks of cells in which orbits in sight are likely to need as many iterates.
  /// @param firsts each block's lowest cell. @param side of a block, cells.
  void keep_needed(const surface::Grid& grid, std::vector<Vector3i>& firsts, int side,
                   double around, double slope, const Fields& fields) const {
    const double reach = std::sqrt(0.75) * side * grid.step;  // from a middle to the corners
    const auto middle = [&](const Vector3i& first) -> Vector3d {
      return axes_.transpose() * grid.at(first.cast<double>().array() + 0.5 * side);
    };
    std::erase_if(firsts, [&](const Vector3i& first) {
      const Vector3d p = middle(first);
      return !in_depth_.sees(p, reach + around, reach) || !has_orbits_near_(p, reach);
    });
    std::vector<Vector3d> middles;
    middles.reserve(firsts.size());
    std::ranges::transform(firsts, std::back_inserter(middles), middle);
    const std::vector<float> found = fields(middles);
    std::size_t kept = 0;
    for (std::size_t i = 0; i < firsts.size(); ++i) {
      if (double{found[i]} < close_up_.outer + slope * reach) firsts[kept++] = firsts[i];
    }
    firsts.resize(kept);
  }

  /// About the part of the band that is in sight, along the axes.
  Eigen::AlignedBox3d band_in_sight() const {
    const View& few = close_up_.few;
    Eigen::AlignedBox3d box;
    for (int row = 0; row < few.rows; ++row) {
      for (int column = 0; column < few.columns; ++column) {
        const double hit = double{close_up_.depths[index(column, row, few.columns)]};
        if (hit < 0) continue;
        const Seen ray{column + 0.5, row + 0.5, 0, hit};
        // From the hit back to where no orbits are run.
        double front = hit;
        while (front > 0 && has_orbits_near_(few.at(ray.x, ray.y, front), close_up_.around)) {
          front -= close_up_.around;
        }
        for (const double depth : {std::max(front, 0.0), hit}) {
          const Vector3d along = at(ray, depth);
          box.extend(Vector3d(along.array() - close_up_.around));
          box.extend(Vector3d(along.array() + close_up_.around));
        }
      }
    }
    return box;
  }

  const CloseUp& close_up_;
  const HasOrbitsNear& has_orbits_near_;
  Eigen::Matrix3d axes_;
  InSight in_sight_;  ///< or little farther than what lights come from
  InSight in_depth_;  ///< or little farther than what rays bisect
};

}  // namespace

InSight::InSight(const View& coarse, std::vector<float> depths, double error)
    : view_(coarse),
      depths_(std::move(depths)),
      error_(error),
      axis_(view_.direction(0.5 * view_.columns, 0.5 * view_.rows)) {}

bool InSight::sees(const Vector3d& p, double aside, double behind) const {
  const Vector3d from_eye = p - view_.eye;
  const double scale = axis_.squaredNorm() / from_eye.dot(axis_);
  if (!(scale > 0)) return true;
  const Vector3d across = scale * from_eye - view_.dir;
  const auto range = [&](const Vector3d& pixel, int pixels) {
    const double middle = across.dot(pixel) / pixel.squaredNorm();
    const double around = 1 + scale * aside / pixel.norm();
    return std::pair(std::max(0, static_cast<int>(std::floor(middle - around))),
                     std::min(pixels, static_cast<int>(std::ceil(middle + around))));
  };
  const auto [left, right] = range(view_.dir_dx, view_.columns);
  const auto [top, bottom] = range(view_.dir_dy, view_.rows);
  for (int row = top; row < bottom; ++row) {
    for (int column = left; column < right; ++column) {
      const double depth = depths_[index(column, row, view_.columns)];
      if (depth < 0 || from_eye.norm() < depth + behind + error_) return true;
    }
  }
  return false;
}

bool is_worth_composing(const View& view, double typical, double stretch) {
  return surface::ImageLattice::step_for(typical, stretch) >=
         kNearestNodes * view.footprint * view.samples;
}

std::vector<Level> levels_for(const CloseUp& close_up, const HasOrbitsNear& has_orbits_near,
                              const FieldsAfter& fields_after) {
  const Sight sight(close_up, has_orbits_near);
  const auto is_worth = [&](const Level& level) {
    return !level.cells.empty() && static_cast<double>(level.cells.size()) <= close_up.most_nodes;
  };
  std::vector<Level> levels;
  if (Level first = sight.wide_level(); is_worth(first)) levels.push_back(std::move(first));
  const double pixel = close_up.view.footprint * close_up.view.samples;
  const auto most = static_cast<int>(close_up.stretches.size());
  for (int iterates = 2; iterates <= most; ++iterates) {
    if (sight.wanted_step(iterates) < kTooNear * pixel) break;
    Level level;
    if (!levels.empty() && levels.front().iterates + 1 == iterates) {
      level = sight.needed_level(iterates, fields_after(levels));
    }
    if (!is_worth(level)) level = sight.near_level(iterates);
    if (is_worth(level)) levels.insert(levels.begin(), std::move(level));
  }
  return levels;
}

}  // namespace qjulia::picture

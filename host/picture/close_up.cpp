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
using Level = surface::ImageLattice::Level;

/// Nodes of a level lie at least so many pixels apart: closer ones are more than what they save.
constexpr double kNearestNodes = 1.5;
/// Cells along each axis times each other: their lists take a few bytes for each.
constexpr double kMostCells = 24e6;
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
        in_sight_(close_up.few, close_up.depths, close_up.around) {}

  double step_of(int iterates) const {
    return surface::ImageLattice::step_for(
        close_up_.typical, close_up_.stretches[static_cast<std::size_t>(iterates - 1)]);
  }

  /// Wherever rays in sight run orbits.
  Level wide_level(int iterates) const {
    const Eigen::AlignedBox3d box = band_in_sight();
    Level level = empty_level(iterates);
    const double step = level.grid.step;
    if (box.isEmpty() || !((box.sizes() / step).prod() < kMostCells)) return level;
    level.grid = surface::ImageLattice::grid_about({box.min(), box.max()}, step);
    const double reach = std::sqrt(0.75) * step;  // from a cell's middle to its corners
    take_cells(level, [&](const Vector3d& p, double cells) {
      return has_orbits_near_(p, cells * reach) && in_sight_(p, cells * reach + close_up_.around);
    });
    return level;
  }

  /// About what is seen.
  Level near_level(int iterates) const {
    Level level = empty_level(iterates);
    const double step = level.grid.step;
    std::vector<Seen> seen = all_seen();
    if (seen.empty()) return level;
    const double wide = close_up_.few.footprint / step;  // cells
    Eigen::AlignedBox3d box;
    const double margin = 0.5 * close_up_.few.footprint + step;
    const auto limit = [&](const Seen& s) {
      for (const double depth : {s.from, s.to}) {
        const Vector3d along = at(s, depth);
        box.extend(Vector3d(along.array() - margin));
        box.extend(Vector3d(along.array() + margin));
      }
    };
    std::ranges::for_each(seen, limit);
    const double longest = kMostCells * step * step * step / (box.sizes().x() * box.sizes().y());
    if (longest < box.sizes().z()) {
      leave_out_far(seen, longest);
      box.setEmpty();
      std::ranges::for_each(seen, limit);
    }
    level.grid = surface::ImageLattice::grid_about({box.min(), box.max()}, step);
    const surface::Grid& grid = level.grid;
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
    for (std::size_t i = 0; i < marked.size(); ++i) {
      if (marked[i]) level.cells.push_back(device::narrow(i));
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
    level.grid.step = step_of(iterates);
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
  InSight in_sight_;
};

}  // namespace

InSight::InSight(const View& coarse, std::vector<float> depths, double error)
    : view_(coarse),
      depths_(std::move(depths)),
      error_(error),
      axis_(view_.direction(0.5 * view_.columns, 0.5 * view_.rows)) {}

bool InSight::operator()(const Vector3d& p, double reach) const {
  const Vector3d from_eye = p - view_.eye;
  const double scale = axis_.squaredNorm() / from_eye.dot(axis_);
  if (!(scale > 0)) return true;
  const Vector3d across = scale * from_eye - view_.dir;
  const auto range = [&](const Vector3d& pixel, int pixels) {
    const double middle = across.dot(pixel) / pixel.squaredNorm();
    const double around = 1 + scale * reach / pixel.norm();
    return std::pair(std::max(0, static_cast<int>(std::floor(middle - around))),
                     std::min(pixels, static_cast<int>(std::ceil(middle + around))));
  };
  const auto [left, right] = range(view_.dir_dx, view_.columns);
  const auto [top, bottom] = range(view_.dir_dy, view_.rows);
  for (int row = top; row < bottom; ++row) {
    for (int column = left; column < right; ++column) {
      const double depth = depths_[index(column, row, view_.columns)];
      if (depth < 0 || from_eye.norm() < depth + reach + error_) return true;
    }
  }
  return false;
}

bool is_worth_composing(const View& view, double typical, double stretch) {
  return surface::ImageLattice::step_for(typical, stretch) >=
         kNearestNodes * view.footprint * view.samples;
}

std::vector<Level> levels_for(const CloseUp& close_up, const HasOrbitsNear& has_orbits_near) {
  const Sight sight(close_up, has_orbits_near);
  std::vector<Level> levels;
  for (auto iterates = static_cast<int>(close_up.stretches.size()); iterates > 0; --iterates) {
    const double stretch = close_up.stretches[static_cast<std::size_t>(iterates - 1)];
    if (levels.empty() && iterates > 1 &&
        !is_worth_composing(close_up.view, close_up.typical, stretch)) {
      continue;
    }
    Level level =
        levels.empty() && iterates > 1 ? sight.near_level(iterates) : sight.wide_level(iterates);
    if (level.cells.empty() || static_cast<double>(level.cells.size()) > close_up.most_nodes) {
      continue;
    }
    levels.push_back(std::move(level));
  }
  return levels;
}

}  // namespace qjulia::picture

#include "picture/specks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_set>

namespace qjulia::picture {
namespace {

/// Neighbours whose depths differ by more than so many pixels do not hang together.
constexpr double kGap = 4;
/// Pits are deeper than so many pixels.
constexpr double kDeep = 2;
/// The greatest width of a speck in a picture, pixels: in front of something, and with nothing
/// behind.
constexpr int kMostWide = 48, kMostWideFree = 64;
/// The greatest depth of a speck, from which its rays must come out: this multiple of its width,
/// plus so many pixels.
constexpr double kDepthOverWidth = 4, kMoreDepth = 4;
constexpr int kRounds = 8;

constexpr double kNothing = std::numeric_limits<double>::infinity();

/// Finds groups of samples of a grid around which all values are higher by more than a gap.
class GroupFinder {
 public:
  /// @param sign of the values: 1 for depths, which are infinite where a ray hits nothing, -1 for
  /// their negatives.
  /// @param tips samples that hang together with all their neighbours; empty for none.
  GroupFinder(const DepthGrid& grid, double sign, double gap, int most,
              const std::vector<bool>& tips)
      : grid_(grid),
        sign_(sign),
        gap_(gap),
        most_(most),
        tips_(tips),
        states_(grid.depths.size(), State::fresh) {}

  std::vector<SampleGroup> all() {
    std::vector<SampleGroup> groups;
    for (int row = 1; row + 1 < grid_.rows; ++row) {
      for (int column = 1; column + 1 < grid_.columns; ++column) {
        if (!may_begin(column, row)) continue;
        SampleGroup group;
        const bool is_whole = follow(column, row, group);
        for (const std::size_t sample : group) states_[sample] = State::refused;
        if (is_whole) groups.push_back(std::move(group));
      }
    }
    return groups;
  }

 private:
  enum class State : unsigned char { fresh, followed, refused };

  double value(int column, int row) const {
    const float depth = grid_.at(column, row);
    return sign_ * (depth < 0 ? kNothing : double{depth});
  }
  bool is_tip(int column, int row) const {
    return !tips_.empty() && tips_[index(column, row, grid_.columns)];
  }
  /// Whether two neighbours hang together.
  bool hang_together(int x, int y, int i, int j) const {
    const double a = value(x, y), b = value(i, j);
    if (a == b || std::abs(a - b) <= gap_) return true;
    return std::max(a, b) < kNothing && (is_tip(x, y) || is_tip(i, j));
  }

  /// Whether a sample may be the first of a group, in the order of rows: of the neighbours before
  /// it, none hangs together with it, and none is lower.
  bool may_begin(int column, int row) const {
    const double here = value(column, row);
    if (here == kNothing || states_[index(column, row, grid_.columns)] != State::fresh)
      return false;
    for (const auto& [i, j] : {std::pair(-1, 0), {-1, -1}, {0, -1}, {1, -1}}) {
      if (hang_together(column, row, column + i, row + j)) return false;
      if (value(column + i, row + j) < here) return false;
    }
    return true;
  }

  /// Puts the samples of a group into `group`. @return false if they are no group; some of them are
  /// then in `group`.
  bool follow(int column, int row, SampleGroup& group) {
    int left = column, right = column, bottom = row;
    std::vector<std::size_t> lower;  // beyond a step: they must be of the group, by another way
    group.push_back(index(column, row, grid_.columns));
    states_[group.front()] = State::followed;
    for (std::size_t next = 0; next < group.size(); ++next) {
      const int x = static_cast<int>(group[next] % static_cast<std::size_t>(grid_.columns));
      const int y = static_cast<int>(group[next] / static_cast<std::size_t>(grid_.columns));
      left = std::min(left, x), right = std::max(right, x), bottom = std::max(bottom, y);
      const bool at_edge = x == 0 || y == 0 || x + 1 == grid_.columns || y + 1 == grid_.rows;
      if (at_edge || right - left >= most_ || bottom - row >= most_) return false;
      const double here = value(x, y);
      for (int j = y - 1; j <= y + 1; ++j) {
        for (int i = x - 1; i <= x + 1; ++i) {
          const std::size_t number = index(i, j, grid_.columns);
          if (!hang_together(x, y, i, j)) {
            if (value(i, j) < here) lower.push_back(number);
            continue;
          }
          State& state = states_[number];
          if (state == State::refused) return false;
          if (state == State::followed) continue;
          state = State::followed;
          group.push_back(number);
        }
      }
    }
    return std::ranges::all_of(
        lower, [&](std::size_t number) { return states_[number] == State::followed; });
  }

  const DepthGrid& grid_;
  double sign_, gap_;
  int most_;
  const std::vector<bool>& tips_;
  std::vector<State> states_;
};

/// The longer side of the box about a group, samples.
int width_of(const SampleGroup& group, int columns) {
  const auto [low, high] = std::ranges::minmax(group);
  const auto wide = static_cast<std::size_t>(columns);
  const auto column = [&](std::size_t sample) { return sample % wide; };
  const auto [left, right] = std::ranges::minmax(group, {}, column);
  return 1 + static_cast<int>(std::max(high / wide - low / wide, right % wide - left % wide));
}

/// Whether nothing is seen around a group.
bool stands_free(const DepthGrid& grid, const SampleGroup& group) {
  const std::unordered_set<std::size_t> own(group.begin(), group.end());
  return std::ranges::all_of(group, [&](std::size_t sample) {
    const int x = static_cast<int>(sample % static_cast<std::size_t>(grid.columns));
    const int y = static_cast<int>(sample / static_cast<std::size_t>(grid.columns));
    for (int j = y - 1; j <= y + 1; ++j) {
      for (int i = x - 1; i <= x + 1; ++i) {
        const std::size_t beside = index(i, j, grid.columns);
        if (grid.depths[beside] >= 0 && !own.contains(beside)) return false;
      }
    }
    return true;
  });
}

/// The median depth of what is around a pit.
float rim_of(const DepthGrid& grid, const SampleGroup& pit) {
  const std::unordered_set<std::size_t> own(pit.begin(), pit.end());
  std::vector<float> around;
  for (const std::size_t sample : pit) {
    const int x = static_cast<int>(sample % static_cast<std::size_t>(grid.columns));
    const int y = static_cast<int>(sample / static_cast<std::size_t>(grid.columns));
    for (int j = y - 1; j <= y + 1; ++j) {
      for (int i = x - 1; i <= x + 1; ++i) {
        const std::size_t beside = index(i, j, grid.columns);
        if (!own.contains(beside)) around.push_back(grid.depths[beside]);
      }
    }
  }
  const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
  std::ranges::nth_element(around, middle);
  return *middle;
}

}  // namespace

std::vector<SampleGroup> islands(const DepthGrid& grid, double gap, int most,
                                 const std::vector<bool>& tips) {
  return GroupFinder(grid, 1, gap, most, tips).all();
}

std::vector<SampleGroup> pits(const DepthGrid& grid, double gap, int most) {
  const std::vector<bool> no_tips;
  return GroupFinder(grid, -1, gap, most, no_tips).all();
}

SpecklessDepths::SpecklessDepths(DepthSource& source, const View& view, std::size_t slab)
    : source_(source),
      view_(view),
      rows_at_once_(static_cast<int>(
          std::max<std::size_t>(1, slab / static_cast<std::size_t>(view.columns)))),
      pixel_(view.footprint * view.samples),
      widest_(static_cast<int>(
          std::min(double(kMostWide) * view.samples, source.largest_speck() / view.footprint))),
      widest_free_(static_cast<int>(std::min(double(kMostWideFree) * view.samples,
                                             source.largest_free_speck() / view.footprint))) {}

int SpecklessDepths::reach() const {
  const int of_pits = 2 * view_.samples;
  return of_pits + (widest_free_ > 0 ? kRounds * (widest_free_ + 1) : 0);
}

void SpecklessDepths::leave_out_islands(DepthGrid& grid, int first_row) const {
  // How near to its end a ray counts as one that does not come out: in close-ups rounding keeps
  // depths less apart than samples are wide.
  const double rounding = 0x1p-21 * (view_.eye.norm() + source_.bounds().diagonal());
  const double near = std::max(view_.footprint, rounding);
  std::vector<bool> tips(grid.depths.size());  // samples of islands that are tips
  for (int round = 0; round < kRounds; ++round) {
    std::vector<SampleGroup> found = islands(grid, kGap * pixel_, widest_free_, tips);
    std::erase_if(found, [&](const SampleGroup& group) {
      const bool is_wide = width_of(group, grid.columns) > widest_;
      return std::ranges::all_of(group, [&](std::size_t sample) { return tips[sample]; }) ||
             (is_wide && !stands_free(grid, group));
    });
    if (found.empty()) return;
    std::vector<PassingRay> rays;
    for (const SampleGroup& group : found) {
      const double deepest =
          kDepthOverWidth * width_of(group, grid.columns) * view_.footprint + kMoreDepth * pixel_;
      for (const std::size_t sample : group) {
        const auto wide = static_cast<std::size_t>(grid.columns);
        const float depth = grid.depths[sample];
        rays.push_back({static_cast<int>(sample % wide),
                        first_row + static_cast<int>(sample / wide), depth,
                        depth + static_cast<float>(deepest)});
      }
    }
    const std::vector<float> beyond = source_.depths_beyond(view_, rays);
    std::size_t ray = 0;
    for (const SampleGroup& group : found) {
      const std::size_t first = ray;
      bool is_tip = false;
      for (; ray < first + group.size(); ++ray) {
        const double from_until = double{beyond[ray]} - double{rays[ray].until};
        is_tip = is_tip || std::abs(from_until) <= near;
      }
      if (is_tip) {
        for (const std::size_t sample : group) tips[sample] = true;
        continue;
      }
      for (std::size_t i = 0; i < group.size(); ++i) grid.depths[group[i]] = beyond[first + i];
    }
  }
}

std::vector<float> SpecklessDepths::source_rows(int first, int last) const {
  std::vector<float> depths;
  depths.reserve(index(0, last - first, view_.columns));
  int row = first;
  const int known_to = source_from_ + static_cast<int>(source_known_.size() /
                                                       static_cast<std::size_t>(view_.columns));
  if (source_from_ <= first && first < known_to) {
    row = std::min(last, known_to);
    const auto at = [&](int of) {
      return source_known_.begin() +
             static_cast<std::ptrdiff_t>(index(0, of - source_from_, view_.columns));
    };
    depths.assign(at(first), at(row));
  }
  while (row < last) {
    const int count = std::min(rows_at_once_, last - row);
    const std::vector<float> found = source_.depths(view_, row, count);
    depths.insert(depths.end(), found.begin(), found.end());
    row += count;
  }
  return depths;
}

void SpecklessDepths::compute(int first, int count) {
  const int from = std::max(0, first - reach());
  const int to = std::min(view_.rows, first + count + reach());
  DepthGrid grid{view_.columns, to - from, source_rows(from, to)};
  source_known_.clear();
  if (first + count < view_.rows) source_known_ = grid.depths;
  source_from_ = from;
  if (widest_free_ > 0) leave_out_islands(grid, from);
  const std::vector<SampleGroup> found = pits(grid, kDeep * pixel_, 2 * view_.samples - 1);
  std::vector<float> rims;  // before any pit is filled
  rims.reserve(found.size());
  for (const SampleGroup& pit : found) rims.push_back(rim_of(grid, pit));
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (const std::size_t sample : found[i]) grid.depths[sample] = rims[i];
  }
  const auto begin =
      grid.depths.begin() + static_cast<std::ptrdiff_t>(index(0, first - from, view_.columns));
  known_.assign(begin, begin + static_cast<std::ptrdiff_t>(index(0, count, view_.columns)));
  from_ = first;
}

std::vector<float> SpecklessDepths::rows(int first, int count) {
  const auto known_rows = static_cast<int>(known_.size() / static_cast<std::size_t>(view_.columns));
  if (first < from_ || first + count > from_ + known_rows) {
    compute(first, std::min(view_.rows - first, std::max(count, rows_at_once_)));
  }
  const auto begin =
      known_.begin() + static_cast<std::ptrdiff_t>(index(0, first - from_, view_.columns));
  return {begin, begin + static_cast<std::ptrdiff_t>(index(0, count, view_.columns))};
}

std::vector<float> speckless_depths(DepthSource& source, const View& view) {
  return SpecklessDepths(source, view).rows(0, view.rows);
}

}  // namespace qjulia::picture

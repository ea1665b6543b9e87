#include "surface/level_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "map/map_buffer.hpp"
#include "qjulia/shared/map_layout.h"

namespace qjulia {
namespace {

/// Factors evaluated in one launch: about 30 ms of potentials on two cores.
constexpr std::size_t kPairsPerLaunch = std::size_t{1} << 27;
/// The same for whole iterates, whose versors cost several times as much.
constexpr std::size_t kVersorsPerLaunch = kPairsPerLaunch / 4;

std::int32_t narrow(std::size_t count) { return static_cast<std::int32_t>(count); }

std::vector<float> rounded(std::vector<float> values) { return values; }

std::vector<float> rounded(const std::vector<double>& values) {
  std::vector<float> floats(values.size());
  std::ranges::transform(values, floats.begin(), [](double x) { return static_cast<float>(x); });
  return floats;
}

}  // namespace

double Grid::coordinate(int axis, int index, Precision precision) const {
  if (precision == Precision::dbl) return std::fma(index, step, origin[axis]);
  return std::fma(static_cast<float>(index), static_cast<float>(step),
                  static_cast<float>(origin[axis]));
}

std::size_t GridBlock::size() const {
  std::size_t points = 1;
  for (const int n : count) points *= static_cast<std::size_t>(n);
  return points;
}

GridBlock slices(const Grid& grid, int z, int count) {
  return {{0, 0, z}, {grid.points[0], grid.points[1], count}};
}

int slices_at_once(const Grid& grid) {
  constexpr std::size_t kPoints = std::size_t{1} << 20;
  return static_cast<int>(std::max<std::size_t>(1, kPoints / slices(grid, 0, 1).size()));
}

template <class Real>
void PointList::copy(std::size_t begin, std::size_t count, std::size_t stride,
                     std::span<Real> out) const {
  const auto from = static_cast<std::ptrdiff_t>(begin);
  auto to = out.begin();
  for (const auto* axis : {&x, &y, &z}) {
    std::transform(axis->begin() + from, axis->begin() + from + static_cast<std::ptrdiff_t>(count),
                   to, [](double c) { return static_cast<Real>(c); });
    to += static_cast<std::ptrdiff_t>(stride);
  }
}

LevelSet::LevelSet(const Device& device, const RationalMap& map, const StopRadii& stops,
                   int iterations, Precision precision)
    : device_(device),
      factors_(static_cast<int>(packed_factors(map))),
      iterations_(iterations),
      precision_(precision),
      slice_(map.slice) {
  const auto header = pack_map(map, stops);
  map_ = device.context().upload_real(header, precision);
  below_ = static_cast<float>(header[QJ_MAP_LOG_INNER]);
  above_ = static_cast<float>(std::min(header[QJ_MAP_LOG_ESCAPE], header[QJ_MAP_LOG_OUTER]));
}

double LevelSet::certainly_inside_below(double level) const {
  return iterations_ == 1 ? level : std::min<double>(below_, level);
}

double LevelSet::certainly_outside_above(double level) const {
  return iterations_ == 1 ? level : std::max<double>(above_, level);
}

device::Argument LevelSet::real(double value) const {
  return device::Argument::real(value, precision_);
}

std::size_t LevelSet::lanes() const {
  return static_cast<std::size_t>(device_.lane_width(precision_));
}

std::size_t LevelSet::groups_per_launch(std::size_t pairs) const {
  return std::max<std::size_t>(1, pairs / (lanes() * static_cast<std::size_t>(factors_)));
}

device::Kernel LevelSet::kernel(const char* name) const {
  return device_.context().kernel("level_set.cl", name,
                                  {device_.lane_width(precision_), precision_, {}});
}

std::vector<float> LevelSet::over(const Grid& grid, const GridBlock& block) const {
  return precision_ == Precision::dbl ? rounded(over_in<double>(grid, block))
                                      : rounded(over_in<float>(grid, block));
}

std::vector<float> LevelSet::densely_over(const Grid& grid, const GridBlock& block) const {
  if (iterations_ > 1) counts_.iterated += block.size();
  return precision_ == Precision::dbl ? rounded(block_values<double>(grid, block, iterations_))
                                      : rounded(block_values<float>(grid, block, iterations_));
}

std::vector<float> LevelSet::at(const PointList& points) const {
  return precision_ == Precision::dbl ? rounded(at_in<double>(points))
                                      : rounded(at_in<float>(points));
}

FieldBounds LevelSet::bounds(const PointList& centers, double half_side) const {
  return precision_ == Precision::dbl ? bounds_in<double>(centers, half_side)
                                      : bounds_in<float>(centers, half_side);
}

template <class Real>
std::vector<Real> LevelSet::over_in(const Grid& grid, const GridBlock& block) const {
  std::vector<Real> values = block_values<Real>(grid, block, 1);
  if (iterations_ == 1) return values;
  std::vector<std::int32_t> numbers;
  PointList points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!undecided(values[i])) continue;
    const int number = narrow(i);
    const int row = number / block.count[0];
    numbers.push_back(number);
    points.add(grid.coordinate(0, block.first[0] + number % block.count[0], precision_),
               grid.coordinate(1, block.first[1] + row % block.count[1], precision_),
               grid.coordinate(2, block.first[2] + row / block.count[1], precision_));
  }
  iterate<Real>(numbers, points, values);
  return values;
}

template <class Real>
std::vector<Real> LevelSet::block_values(const Grid& grid, const GridBlock& block,
                                         int iterations) const {
  auto& context = device_.context();
  std::vector<Real> values(block.size());
  const auto block_kernel = kernel("level_set_block");
  const std::size_t all = (values.size() + lanes() - 1) / lanes();
  const std::size_t most = std::min(all, iterations == 1 ? groups_per_launch(kPairsPerLaunch)
                                                         : groups_per_launch(kVersorsPerLaunch));
  const auto field = context.allocate<Real>(most * lanes());
  for (std::size_t first = 0; first < all; first += most) {
    const std::size_t groups = std::min(most, all - first);
    context.launch(
        block_kernel, {{groups, 1, 1}},
        {block.count[0], block.count[1], block.first[0], block.first[1], block.first[2],
         real(grid.origin.x()), real(grid.origin.y()), real(grid.origin.z()), real(grid.step),
         narrow(first), narrow(groups), map_, factors_, iterations, field});
    const std::size_t begin = first * lanes();
    context.read<Real>(
        field, std::span(values).subspan(begin, std::min(groups * lanes(), values.size() - begin)));
  }
  counts_.potentials += values.size();
  return values;
}

template <class Real>
std::vector<Real> LevelSet::at_in(const PointList& points) const {
  if (points.size() == 0) return {};
  auto& context = device_.context();
  const auto points_kernel = kernel("level_set_points");
  std::vector<Real> values(points.size());
  const std::size_t all = (points.size() + lanes() - 1) / lanes();
  const std::size_t most = std::min(all, groups_per_launch(kPairsPerLaunch));
  const std::size_t stride = most * lanes();
  const auto positions = context.allocate<Real>(3 * stride);
  const auto field = context.allocate<Real>(stride);
  std::vector<Real> sent(3 * stride);
  for (std::size_t begin = 0; begin < points.size(); begin += stride) {
    const std::size_t count = std::min(stride, points.size() - begin);
    points.copy<Real>(begin, count, stride, sent);
    context.write<Real>(positions, sent);
    const std::size_t groups = (count + lanes() - 1) / lanes();
    context.launch(points_kernel, {{groups, 1, 1}},
                   {positions, narrow(stride), narrow(groups), map_, factors_, field});
    context.read<Real>(field, std::span(values).subspan(begin, count));
  }
  counts_.potentials += points.size();
  if (iterations_ == 1) return values;
  std::vector<std::int32_t> numbers;
  PointList left;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!undecided(values[i])) continue;
    numbers.push_back(narrow(i));
    left.add(points.x[i], points.y[i], points.z[i]);
  }
  iterate<Real>(numbers, left, values);
  return values;
}

template <class Real>
void LevelSet::iterate(std::span<const std::int32_t> numbers, const PointList& points,
                       std::vector<Real>& values) const {
  if (numbers.empty()) return;
  auto& context = device_.context();
  const auto advance = kernel("level_set_advance");
  counts_.iterated += numbers.size();
  const std::size_t groups = (numbers.size() + lanes() - 1) / lanes();
  const std::size_t stride = std::min(groups, groups_per_launch(kVersorsPerLaunch)) * lanes();
  const auto positions = context.allocate<Real>(4 * stride);
  const auto field = context.allocate<Real>(stride);
  std::vector<std::int32_t> live;    // numbers of the points that go on
  std::vector<Real> at(4 * stride);  // X, Y, Z, W of these
  std::vector<Real> reached(stride);
  for (std::size_t begin = 0; begin < numbers.size(); begin += stride) {
    const std::size_t count = std::min(stride, numbers.size() - begin);
    const auto part = numbers.subspan(begin, count);
    live.assign(part.begin(), part.end());
    points.copy<Real>(begin, count, stride, at);
    std::fill_n(at.begin() + static_cast<std::ptrdiff_t>(3 * stride), count,
                static_cast<Real>(slice_));
    for (int iterate = 1; iterate < iterations_ && !live.empty(); ++iterate) {
      for (std::size_t i = 0; i < live.size(); ++i) {
        reached[i] = values[static_cast<std::size_t>(live[i])];
      }
      context.write<Real>(positions, at);
      context.write<Real>(field, reached);
      const std::size_t used = (live.size() + lanes() - 1) / lanes();
      context.launch(advance, {{used, 1, 1}},
                     {positions, narrow(stride), narrow(used), map_, factors_, field});
      context.read<Real>(positions, at);
      context.read<Real>(field, reached);
      counts_.iterates += live.size();
      std::size_t kept = 0;
      for (std::size_t i = 0; i < live.size(); ++i) {
        values[static_cast<std::size_t>(live[i])] = reached[i];
        if (!undecided(reached[i])) continue;
        live[kept] = live[i];
        for (std::size_t part_of = 0; part_of < 4; ++part_of) {
          at[part_of * stride + kept] = at[part_of * stride + i];
        }
        ++kept;
      }
      live.resize(kept);
    }
  }
}

template <class Real>
FieldBounds LevelSet::bounds_in(const PointList& centers, double half_side) const {
  if (centers.size() == 0) return {};
  auto& context = device_.context();
  const auto bounds_kernel = kernel("level_set_bounds");
  std::vector<Real> lows(centers.size()), highs(centers.size());
  const std::size_t all = (centers.size() + lanes() - 1) / lanes();
  const std::size_t stride = std::min(all, groups_per_launch(kVersorsPerLaunch)) * lanes();
  const auto positions = context.allocate<Real>(3 * stride);
  const auto low = context.allocate<Real>(stride);
  const auto high = context.allocate<Real>(stride);
  std::vector<Real> sent(3 * stride);
  for (std::size_t begin = 0; begin < centers.size(); begin += stride) {
    const std::size_t count = std::min(stride, centers.size() - begin);
    centers.copy<Real>(begin, count, stride, sent);
    context.write<Real>(positions, sent);
    const std::size_t groups = (count + lanes() - 1) / lanes();
    context.launch(
        bounds_kernel, {{groups, 1, 1}},
        {positions, narrow(stride), narrow(groups), real(half_side), map_, factors_, low, high});
    context.read<Real>(low, std::span(lows).subspan(begin, count));
    context.read<Real>(high, std::span(highs).subspan(begin, count));
  }
  counts_.cubes += centers.size();
  return {rounded(std::move(lows)), rounded(std::move(highs))};
}

}  // namespace qjulia

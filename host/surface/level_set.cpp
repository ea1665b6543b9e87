#include "surface/level_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "map/map_buffer.hpp"
#include "qjulia/shared/map_layout.h"

namespace qjulia {
namespace {

/// Factors evaluated in one launch: about 30 ms of potentials on two cores.
constexpr std::size_t kPairsPerLaunch = std::size_t{1} << 27;
/// The same for whole iterates, whose versors cost several times as much.
constexpr std::size_t kVersorsPerLaunch = kPairsPerLaunch / 4;

std::int32_t narrow(std::size_t count) { return static_cast<std::int32_t>(count); }

device::Argument real(double value) { return device::Argument::real(value, Precision::single); }

}  // namespace

float Grid::coordinate(int axis, int index) const {
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

void PointList::copy(std::size_t begin, std::size_t count, std::size_t stride,
                     std::span<float> out) const {
  const auto from = static_cast<std::ptrdiff_t>(begin);
  auto to = out.begin();
  for (const auto* axis : {&x, &y, &z}) {
    std::copy_n(axis->begin() + from, count, to);
    to += static_cast<std::ptrdiff_t>(stride);
  }
}

LevelSet::LevelSet(const Device& device, const RationalMap& map, const StopRadii& stops,
                   int iterations)
    : device_(device),
      factors_(static_cast<int>(packed_factors(map))),
      iterations_(iterations),
      slice_(static_cast<float>(map.slice)) {
  const auto header = pack_map(map, stops);
  map_ = device.context().upload_real(header, Precision::single);
  below_ = static_cast<float>(header[QJ_MAP_LOG_INNER]);
  above_ = static_cast<float>(std::min(header[QJ_MAP_LOG_ESCAPE], header[QJ_MAP_LOG_OUTER]));
}

double LevelSet::certainly_inside_below(double level) const {
  return iterations_ == 1 ? level : std::min<double>(below_, level);
}

double LevelSet::certainly_outside_above(double level) const {
  return iterations_ == 1 ? level : std::max<double>(above_, level);
}

std::size_t LevelSet::lanes() const {
  return static_cast<std::size_t>(device_.lane_width(Precision::single));
}

std::size_t LevelSet::groups_per_launch(std::size_t pairs) const {
  return std::max<std::size_t>(1, pairs / (lanes() * static_cast<std::size_t>(factors_)));
}

device::Kernel LevelSet::kernel(const char* name) const {
  return device_.context().kernel("level_set.cl", name,
                                  {device_.lane_width(Precision::single), Precision::single, {}});
}

std::vector<float> LevelSet::over(const Grid& grid, const GridBlock& block) const {
  std::vector<float> values(block.size());
  block_values(grid, block, 1, values);
  if (iterations_ == 1) return values;
  std::vector<std::int32_t> numbers;
  PointList points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!undecided(values[i])) continue;
    const int number = narrow(i);
    const int row = number / block.count[0];
    numbers.push_back(number);
    points.add(grid.coordinate(0, block.first[0] + number % block.count[0]),
               grid.coordinate(1, block.first[1] + row % block.count[1]),
               grid.coordinate(2, block.first[2] + row / block.count[1]));
  }
  iterate(numbers, points, values);
  return values;
}

std::vector<float> LevelSet::densely_over(const Grid& grid, const GridBlock& block) const {
  std::vector<float> values(block.size());
  block_values(grid, block, iterations_, values);
  if (iterations_ > 1) counts_.iterated += values.size();
  return values;
}

void LevelSet::block_values(const Grid& grid, const GridBlock& block, int iterations,
                            std::vector<float>& values) const {
  auto& context = device_.context();
  const auto block_kernel = kernel("level_set_block");
  const std::size_t all = (values.size() + lanes() - 1) / lanes();
  const std::size_t most = std::min(all, iterations == 1 ? groups_per_launch(kPairsPerLaunch)
                                                         : groups_per_launch(kVersorsPerLaunch));
  const auto field = context.allocate<float>(most * lanes());
  for (std::size_t first = 0; first < all; first += most) {
    const std::size_t groups = std::min(most, all - first);
    context.launch(
        block_kernel, {{groups, 1, 1}},
        {block.count[0], block.count[1], block.first[0], block.first[1], block.first[2],
         real(grid.origin.x()), real(grid.origin.y()), real(grid.origin.z()), real(grid.step),
         narrow(first), narrow(groups), map_, factors_, iterations, field});
    const std::size_t begin = first * lanes();
    context.read(
        field, std::span(values).subspan(begin, std::min(groups * lanes(), values.size() - begin)));
  }
  counts_.potentials += values.size();
}

std::vector<float> LevelSet::at(const PointList& points) const {
  if (points.size() == 0) return {};
  auto& context = device_.context();
  const auto points_kernel = kernel("level_set_points");
  std::vector<float> values(points.size());
  const std::size_t all = (points.size() + lanes() - 1) / lanes();
  const std::size_t most = std::min(all, groups_per_launch(kPairsPerLaunch));
  const std::size_t stride = most * lanes();
  const auto positions = context.allocate<float>(3 * stride);
  const auto field = context.allocate<float>(stride);
  std::vector<float> sent(3 * stride);
  for (std::size_t begin = 0; begin < points.size(); begin += stride) {
    const std::size_t count = std::min(stride, points.size() - begin);
    points.copy(begin, count, stride, sent);
    context.write<float>(positions, sent);
    const std::size_t groups = (count + lanes() - 1) / lanes();
    context.launch(points_kernel, {{groups, 1, 1}},
                   {positions, narrow(stride), narrow(groups), map_, factors_, field});
    context.read(field, std::span(values).subspan(begin, count));
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
  iterate(numbers, left, values);
  return values;
}

void LevelSet::iterate(std::span<const std::int32_t> numbers, const PointList& points,
                       std::vector<float>& values) const {
  if (numbers.empty()) return;
  auto& context = device_.context();
  const auto advance = kernel("level_set_advance");
  counts_.iterated += numbers.size();
  const std::size_t groups = (numbers.size() + lanes() - 1) / lanes();
  const std::size_t stride = std::min(groups, groups_per_launch(kVersorsPerLaunch)) * lanes();
  const auto positions = context.allocate<float>(4 * stride);
  const auto field = context.allocate<float>(stride);
  std::vector<std::int32_t> live;     // numbers of the points that go on
  std::vector<float> at(4 * stride);  // X, Y, Z, W of these
  std::vector<float> reached(stride);
  for (std::size_t begin = 0; begin < numbers.size(); begin += stride) {
    const std::size_t count = std::min(stride, numbers.size() - begin);
    const auto part = numbers.subspan(begin, count);
    live.assign(part.begin(), part.end());
    points.copy(begin, count, stride, at);
    std::fill_n(at.begin() + static_cast<std::ptrdiff_t>(3 * stride), count, slice_);
    for (int iterate = 1; iterate < iterations_ && !live.empty(); ++iterate) {
      for (std::size_t i = 0; i < live.size(); ++i) {
        reached[i] = values[static_cast<std::size_t>(live[i])];
      }
      context.write<float>(positions, at);
      context.write<float>(field, reached);
      const std::size_t used = (live.size() + lanes() - 1) / lanes();
      context.launch(advance, {{used, 1, 1}},
                     {positions, narrow(stride), narrow(used), map_, factors_, field});
      context.read<float>(positions, at);
      context.read<float>(field, reached);
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

FieldBounds LevelSet::bounds(const PointList& centers, double half_side) const {
  if (centers.size() == 0) return {};
  auto& context = device_.context();
  const auto bounds_kernel = kernel("level_set_bounds");
  FieldBounds bounds{std::vector<float>(centers.size()), std::vector<float>(centers.size())};
  const std::size_t all = (centers.size() + lanes() - 1) / lanes();
  const std::size_t stride = std::min(all, groups_per_launch(kVersorsPerLaunch)) * lanes();
  const auto positions = context.allocate<float>(3 * stride);
  const auto low = context.allocate<float>(stride);
  const auto high = context.allocate<float>(stride);
  std::vector<float> sent(3 * stride);
  for (std::size_t begin = 0; begin < centers.size(); begin += stride) {
    const std::size_t count = std::min(stride, centers.size() - begin);
    centers.copy(begin, count, stride, sent);
    context.write<float>(positions, sent);
    const std::size_t groups = (count + lanes() - 1) / lanes();
    context.launch(
        bounds_kernel, {{groups, 1, 1}},
        {positions, narrow(stride), narrow(groups), real(half_side), map_, factors_, low, high});
    context.read(low, std::span(bounds.low).subspan(begin, count));
    context.read(high, std::span(bounds.high).subspan(begin, count));
  }
  counts_.cubes += centers.size();
  return bounds;
}

}  // namespace qjulia

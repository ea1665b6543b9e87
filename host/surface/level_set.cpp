#include "surface/level_set.hpp"

#include <algorithm>
#include <span>

#include "map/map_buffer.hpp"
#include "qjulia/shared/map_layout.h"

namespace qjulia {
namespace {

/// Factors evaluated in one launch: about 30 ms of potentials or 100 ms of iterates on two cores.
constexpr std::size_t kPairsPerLaunch = std::size_t{1} << 27;

std::int32_t narrow(std::size_t count) { return static_cast<std::int32_t>(count); }

device::Argument real(double value) { return device::Argument::real(value, Precision::single); }

}  // namespace

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

LevelSet::LevelSet(const Device& device, const RationalMap& map, const StopRadii& stops,
                   int iterations)
    : device_(device), factors_(static_cast<int>(map.factors.size())), iterations_(iterations) {
  const auto header = pack_map(map, stops);
  map_ = device.context().upload_real(header, Precision::single);
  below_ = static_cast<float>(header[QJ_MAP_LOG_INNER]);
  above_ = static_cast<float>(std::min(header[QJ_MAP_LOG_ESCAPE], header[QJ_MAP_LOG_OUTER]));
}

std::size_t LevelSet::lanes() const {
  return static_cast<std::size_t>(device_.lane_width(Precision::single));
}

std::size_t LevelSet::groups_per_launch(int iterations) const {
  const auto pairs_per_group = lanes() * static_cast<std::size_t>(factors_ * iterations);
  return std::max<std::size_t>(1, kPairsPerLaunch / pairs_per_group);
}

std::vector<float> LevelSet::over(const Grid& grid, const GridBlock& block) const {
  std::vector<float> values(block.size());
  first_iterate(grid, block, values);
  if (iterations_ == 1) return values;
  std::vector<std::int32_t> points;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (undecided(values[i])) points.push_back(narrow(i));
  }
  iterate(grid, block, points, values);
  return values;
}

void LevelSet::first_iterate(const Grid& grid, const GridBlock& block,
                             std::vector<float>& values) const {
  auto& context = device_.context();
  const auto kernel =
      context.kernel("level_set.cl", "level_set_block",
                     {device_.lane_width(Precision::single), Precision::single, {}});
  const std::size_t all = (values.size() + lanes() - 1) / lanes();
  const std::size_t most = std::min(all, groups_per_launch(1));
  const auto field = context.allocate<float>(most * lanes());
  for (std::size_t first = 0; first < all; first += most) {
    const std::size_t groups = std::min(most, all - first);
    context.launch(kernel, {{groups, 1, 1}},
                   {block.count[0], block.count[1], block.first[0], block.first[1], block.first[2],
                    real(grid.origin.x()), real(grid.origin.y()), real(grid.origin.z()),
                    real(grid.step), narrow(first), narrow(groups), map_, factors_, 1, field});
    const std::size_t begin = first * lanes();
    context.read(
        field, std::span(values).subspan(begin, std::min(groups * lanes(), values.size() - begin)));
  }
}

void LevelSet::iterate(const Grid& grid, const GridBlock& block,
                       const std::vector<std::int32_t>& points, std::vector<float>& values) const {
  auto& context = device_.context();
  const auto kernel =
      context.kernel("level_set.cl", "level_set_points",
                     {device_.lane_width(Precision::single), Precision::single, {}});
  const std::size_t all = (points.size() + lanes() - 1) / lanes();
  const std::size_t most = std::min(all, groups_per_launch(iterations_));
  const auto indices = context.allocate<std::int32_t>(most * lanes());
  const auto field = context.allocate<float>(most * lanes());
  std::vector<std::int32_t> listed;
  std::vector<float> reached;
  for (std::size_t first = 0; first < all; first += most) {
    const std::size_t groups = std::min(most, all - first);
    const std::size_t begin = first * lanes();
    const std::size_t count = std::min(groups * lanes(), points.size() - begin);
    listed.assign(groups * lanes(), points[begin + count - 1]);
    std::copy_n(points.begin() + static_cast<std::ptrdiff_t>(begin), count, listed.begin());
    context.write<std::int32_t>(indices, listed);
    context.launch(kernel, {{groups, 1, 1}},
                   {block.count[0], block.count[1], block.first[0], block.first[1], block.first[2],
                    real(grid.origin.x()), real(grid.origin.y()), real(grid.origin.z()),
                    real(grid.step), indices, narrow(groups), map_, factors_, iterations_, field});
    reached.resize(count);
    context.read<float>(field, reached);
    for (std::size_t i = 0; i < count; ++i) {
      values[static_cast<std::size_t>(points[begin + i])] = reached[i];
    }
  }
}

}  // namespace qjulia

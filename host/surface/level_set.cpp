#include "surface/level_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "map/map_buffer.hpp"
#include "qjulia/shared/map_layout.h"

namespace qjulia {
namespace {

/// Points on the device with their F.
template <class Real>
struct Orbits {
  std::size_t stride = 0;
  device::Buffer<Real> points;  ///< arrays X, Y, Z, W of `stride`
  device::Buffer<Real> field;   ///< `stride`
};

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
      precision_(precision) {
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
  std::vector<std::int32_t> numbers(block.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  std::vector<float> values(numbers.size());
  at(grid, block, numbers, values);
  return values;
}

std::vector<float> LevelSet::densely_over(const Grid& grid, const GridBlock& block,
                                          double level) const {
  if (iterations_ > 1) counts_.iterated += block.size();
  return precision_ == Precision::dbl ? densely_over_in<double>(grid, block, level)
                                      : densely_over_in<float>(grid, block, level);
}

void LevelSet::at(const Grid& grid, const GridBlock& block, std::span<const std::int32_t> numbers,
                  std::span<float> values) const {
  precision_ == Precision::dbl ? at_in<double>(grid, block, numbers, values)
                               : at_in<float>(grid, block, numbers, values);
}

std::vector<float> LevelSet::at(const PointList& points) const {
  return precision_ == Precision::dbl ? at_in<double>(points) : at_in<float>(points);
}

FieldBounds LevelSet::bounds(const PointList& centers, double half_side) const {
  return precision_ == Precision::dbl ? bounds_in<double>(centers, half_side)
                                      : bounds_in<float>(centers, half_side);
}

template <class Real>
std::vector<float> LevelSet::densely_over_in(const Grid& grid, const GridBlock& block,
                                             double level) const {
  auto& context = device_.context();
  std::vector<Real> values(block.size());
  const auto dense_kernel = kernel("level_set_dense");
  const std::size_t all = (values.size() + lanes() - 1) / lanes();
  const std::size_t most = std::min(all, groups_per_launch(kVersorsPerLaunch));
  const auto field = context.allocate<Real>(most * lanes());
  for (std::size_t first = 0; first < all; first += most) {
    const std::size_t groups = std::min(most, all - first);
    context.launch(
        dense_kernel, {{groups, 1, 1}},
        {block.count[0], block.count[1], block.first[0], block.first[1], block.first[2],
         real(grid.origin.x()), real(grid.origin.y()), real(grid.origin.z()), real(grid.step),
         narrow(first), narrow(groups), map_, factors_, iterations_, real(level), field});
    const std::size_t begin = first * lanes();
    context.read<Real>(
        field, std::span(values).subspan(begin, std::min(groups * lanes(), values.size() - begin)));
  }
  counts_.potentials += values.size();
  return rounded(std::move(values));
}

template <class Real>
void LevelSet::at_in(const Grid& grid, const GridBlock& block,
                     std::span<const std::int32_t> numbers, std::span<float> values) const {
  auto& context = device_.context();
  const auto numbered_kernel = kernel("level_set_numbered");
  device::Buffer<std::int32_t> sent;
  const auto start = [&](std::size_t begin, std::size_t count, const Orbits<Real>& orbits) {
    if (sent.size() == 0) sent = context.allocate<std::int32_t>(orbits.stride);
    context.write<std::int32_t>(sent, numbers.subspan(begin, count));
    const std::size_t groups = (count + lanes() - 1) / lanes();
    context.launch(
        numbered_kernel, {{groups, 1, 1}},
        {sent, block.count[0], block.count[1], block.first[0], block.first[1], block.first[2],
         real(grid.origin.x()), real(grid.origin.y()), real(grid.origin.z()), real(grid.step),
         narrow(orbits.stride), narrow(groups), map_, factors_, orbits.points, orbits.field});
  };
  iterate<Real>(numbers.size(), start, [&](std::size_t begin, std::span<const Real> found) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      values[static_cast<std::size_t>(numbers[begin + i])] = static_cast<float>(found[i]);
    }
  });
}

template <class Real>
std::vector<float> LevelSet::at_in(const PointList& points) const {
  auto& context = device_.context();
  const auto points_kernel = kernel("level_set_points");
  std::vector<Real> sent;
  const auto start = [&](std::size_t begin, std::size_t count, const Orbits<Real>& orbits) {
    sent.resize(3 * orbits.stride);
    points.copy<Real>(begin, count, orbits.stride, sent);
    context.write<Real>(orbits.points, sent);
    const std::size_t groups = (count + lanes() - 1) / lanes();
    context.launch(
        points_kernel, {{groups, 1, 1}},
        {orbits.points, narrow(orbits.stride), narrow(groups), map_, factors_, orbits.field});
  };
  std::vector<float> values(points.size());
  iterate<Real>(points.size(), start, [&](std::size_t begin, std::span<const Real> found) {
    std::ranges::transform(found, values.begin() + static_cast<std::ptrdiff_t>(begin),
                           [](Real f) { return static_cast<float>(f); });
  });
  return values;
}

template <class Real, class Start, class Take>
void LevelSet::iterate(std::size_t count, Start start, Take take) const {
  if (count == 0) return;
  auto& context = device_.context();
  const auto advance = kernel("level_set_advance");
  const auto in_groups = [this](std::size_t points) { return (points + lanes() - 1) / lanes(); };
  const std::size_t stride =
      std::min(in_groups(count), groups_per_launch(kPairsPerLaunch)) * lanes();
  const std::size_t most = groups_per_launch(kVersorsPerLaunch);
  // Orbits, and their images: they change places.
  std::array<Orbits<Real>, 2> orbits;
  for (auto& side : orbits) {
    side = {stride, context.allocate<Real>(4 * stride), context.allocate<Real>(stride)};
    if (iterations_ == 1) break;
  }
  device::Buffer<std::int32_t> live_numbers;
  std::vector<Real> values(stride);
  std::vector<Real> reached(stride);
  std::vector<std::int32_t> live;   // which of the orbits go on
  std::vector<std::int32_t> place;  // whose they are, in `values`
  for (std::size_t begin = 0; begin < count; begin += stride) {
    const std::size_t points = std::min(stride, count - begin);
    start(begin, points, orbits[0]);
    context.read<Real>(orbits[0].field, std::span(values).first(points));
    live.clear();
    for (std::size_t i = 0; i < points && iterations_ > 1; ++i) {
      if (undecided(values[i])) live.push_back(narrow(i));
    }
    place = live;
    counts_.iterated += live.size();
    for (int iterate = 1; iterate < iterations_ && !place.empty(); ++iterate) {
      if (live_numbers.size() == 0) live_numbers = context.allocate<std::int32_t>(stride);
      const std::size_t groups = in_groups(place.size());
      live.resize(groups * lanes(), live.back());
      context.write<std::int32_t>(live_numbers, live);
      for (std::size_t first = 0; first < groups; first += most) {
        const std::size_t part = std::min(most, groups - first);
        context.launch(
            advance, {{part, 1, 1}},
            {orbits[0].points, orbits[0].field, narrow(stride), live_numbers, narrow(first),
             narrow(part), map_, factors_, orbits[1].points, orbits[1].field});
      }
      context.read<Real>(orbits[1].field, std::span(reached).first(place.size()));
      std::swap(orbits[0], orbits[1]);
      counts_.iterates += place.size();
      std::size_t kept = 0;
      for (std::size_t i = 0; i < place.size(); ++i) {
        values[static_cast<std::size_t>(place[i])] = reached[i];
        if (!undecided(reached[i])) continue;
        live[kept] = narrow(i);
        place[kept++] = place[i];
      }
      live.resize(kept);
      place.resize(kept);
    }
    take(begin, std::span<const Real>(values).first(points));
  }
  counts_.potentials += count;
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

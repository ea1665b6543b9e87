#include "surface/level_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "surface/interpolated_orbits.hpp"

namespace qjulia {
namespace {

/// Points on the device with their F.
template <class Real>
struct Orbits {
  std::size_t stride = 0;
  device::Buffer<Real> points;  ///< arrays X, Y, Z, W of `stride`
  device::Buffer<Real> field;   ///< `stride`
};

std::vector<float> rounded(std::vector<float> values) { return values; }

std::vector<float> rounded(const std::vector<double>& values) {
  std::vector<float> floats(values.size());
  std::ranges::transform(values, floats.begin(), [](double x) { return static_cast<float>(x); });
  return floats;
}

}  // namespace

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

LevelSetCounts& LevelSetCounts::operator+=(const LevelSetCounts& other) {
  potentials += other.potentials;
  settled += other.settled;
  nodes += other.nodes;
  iterated += other.iterated;
  iterates += other.iterates;
  cubes += other.cubes;
  return *this;
}

LevelSet::LevelSet(const Device& device, const RationalMap& map, const StopRadii& stops,
                   int iterations, Precision precision)
    : map_(device, map, stops, precision), iterations_(iterations) {
  below_ = static_cast<float>(map_.log_inner());
  above_ = static_cast<float>(map_.log_outer());
}

double LevelSet::certainly_inside_below(double level) const {
  return iterations_ == 1 ? level : std::min<double>(below_, level);
}

double LevelSet::certainly_outside_above(double level) const {
  return iterations_ == 1 ? level : std::max<double>(above_, level);
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
  return precision() == Precision::dbl ? densely_over_in<double>(grid, block, level)
                                       : densely_over_in<float>(grid, block, level);
}

void LevelSet::at(const Grid& grid, const GridBlock& block, std::span<const std::int32_t> numbers,
                  std::span<float> values) const {
  precision() == Precision::dbl ? at_in<double>(grid, block, numbers, values)
                                : at_in<float>(grid, block, numbers, values);
}

void LevelSet::clamped_at(const Grid& grid, const GridBlock& block,
                          std::span<const std::int32_t> numbers, const Clamp& clamp,
                          std::span<float> values) const {
  precision() == Precision::dbl ? clamped_at_in<double>(grid, block, numbers, clamp, values)
                                : clamped_at_in<float>(grid, block, numbers, clamp, values);
}

std::vector<float> LevelSet::at(const PointList& points) const {
  return precision() == Precision::dbl ? at_in<double>(points) : at_in<float>(points);
}

FieldBounds LevelSet::bounds(const PointList& centers, double half_side) const {
  return precision() == Precision::dbl ? bounds_in<double>(centers, half_side)
                                       : bounds_in<float>(centers, half_side);
}

template <class Real>
std::vector<float> LevelSet::densely_over_in(const Grid& grid, const GridBlock& block,
                                             double level) const {
  auto& context = map_.context();
  std::vector<Real> values(block.size());
  const auto dense_kernel = kernel("level_set_dense");
  const std::size_t all = map_.groups(values.size());
  const std::size_t most = std::min(all, map_.groups_per_launch(DeviceMap::kVersorsPerLaunch));
  const auto field = context.allocate<Real>(most * map_.lanes());
  for (std::size_t first = 0; first < all; first += most) {
    const std::size_t groups = std::min(most, all - first);
    context.launch(dense_kernel, {{groups, 1, 1}},
                   {block.count[0], block.count[1], block.first[0], block.first[1], block.first[2],
                    map_.real(grid.origin.x()), map_.real(grid.origin.y()),
                    map_.real(grid.origin.z()), map_.real(grid.step), narrow(first), narrow(groups),
                    map_.buffer(), map_.factors(), iterations_, map_.real(level), field});
    const std::size_t begin = first * map_.lanes();
    context.read<Real>(field, std::span(values).subspan(
                                  begin, std::min(groups * map_.lanes(), values.size() - begin)));
  }
  counts_.potentials += values.size();
  return rounded(std::move(values));
}

template <class Real>
void LevelSet::at_in(const Grid& grid, const GridBlock& block,
                     std::span<const std::int32_t> numbers, std::span<float> values) const {
  auto& context = map_.context();
  const auto numbered_kernel = kernel("level_set_numbered");
  device::Buffer<std::int32_t> sent;
  const auto start = [&](std::size_t begin, std::size_t count, const Orbits<Real>& orbits) {
    if (sent.size() == 0) sent = context.allocate<std::int32_t>(orbits.stride);
    context.write<std::int32_t>(sent, numbers.subspan(begin, count));
    const std::size_t groups = map_.groups(count);
    context.launch(numbered_kernel, {{groups, 1, 1}},
                   {sent, block.count[0], block.count[1], block.first[0], block.first[1],
                    block.first[2], map_.real(grid.origin.x()), map_.real(grid.origin.y()),
                    map_.real(grid.origin.z()), map_.real(grid.step), narrow(orbits.stride),
                    narrow(groups), map_.buffer(), map_.factors(), orbits.points, orbits.field});
  };
  iterate<Real>(numbers.size(), start, [&](std::size_t begin, std::span<const Real> found) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      values[static_cast<std::size_t>(numbers[begin + i])] = static_cast<float>(found[i]);
    }
  });
}

template <class Real>
void LevelSet::clamped_at_in(const Grid& grid, const GridBlock& block,
                             std::span<const std::int32_t> numbers, const Clamp& clamp,
                             std::span<float> values) const {
  if (iterations_ == 1) {
    at_in<Real>(grid, block, numbers, values);
    return;
  }
  InterpolatedOrbits<Real> orbits(map_, grid, block,
                                  std::min<double>(below_, clamp.level - clamp.reach), clamp.level,
                                  std::max<double>(above_, clamp.level + clamp.reach));
  const std::vector<std::int32_t> others = orbits.settle(numbers, values);
  counts_.settled += numbers.size() - others.size();
  counts_.nodes += orbits.nodes();
  at_in<Real>(grid, block, others, values);
}

template <class Real>
std::vector<float> LevelSet::at_in(const PointList& points) const {
  auto& context = map_.context();
  const auto points_kernel = kernel("level_set_points");
  std::vector<Real> sent;
  const auto start = [&](std::size_t begin, std::size_t count, const Orbits<Real>& orbits) {
    sent.resize(3 * orbits.stride);
    points.copy<Real>(begin, count, orbits.stride, sent);
    context.write<Real>(orbits.points, sent);
    const std::size_t groups = map_.groups(count);
    context.launch(points_kernel, {{groups, 1, 1}},
                   {orbits.points, narrow(orbits.stride), narrow(groups), map_.buffer(),
                    map_.factors(), orbits.field});
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
  auto& context = map_.context();
  const auto advance = kernel("level_set_advance");
  const std::size_t stride =
      std::min(map_.groups(count), map_.groups_per_launch(DeviceMap::kPairsPerLaunch)) *
      map_.lanes();
  const std::size_t most = map_.groups_per_launch(DeviceMap::kVersorsPerLaunch);
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
      const std::size_t groups = map_.groups(place.size());
      live.resize(groups * map_.lanes(), live.back());
      context.write<std::int32_t>(live_numbers, live);
      for (std::size_t first = 0; first < groups; first += most) {
        const std::size_t part = std::min(most, groups - first);
        context.launch(
            advance, {{part, 1, 1}},
            {orbits[0].points, orbits[0].field, narrow(stride), live_numbers, narrow(first),
             narrow(part), map_.buffer(), map_.factors(), orbits[1].points, orbits[1].field});
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
  auto& context = map_.context();
  const auto bounds_kernel = kernel("level_set_bounds");
  std::vector<Real> lows(centers.size()), highs(centers.size());
  const std::size_t all = map_.groups(centers.size());
  const std::size_t stride =
      std::min(all, map_.groups_per_launch(DeviceMap::kVersorsPerLaunch)) * map_.lanes();
  const auto positions = context.allocate<Real>(3 * stride);
  const auto low = context.allocate<Real>(stride);
  const auto high = context.allocate<Real>(stride);
  std::vector<Real> sent(3 * stride);
  for (std::size_t begin = 0; begin < centers.size(); begin += stride) {
    const std::size_t count = std::min(stride, centers.size() - begin);
    centers.copy<Real>(begin, count, stride, sent);
    context.write<Real>(positions, sent);
    const std::size_t groups = map_.groups(count);
    context.launch(bounds_kernel, {{groups, 1, 1}},
                   {positions, narrow(stride), narrow(groups), map_.real(half_side), map_.buffer(),
                    map_.factors(), low, high});
    context.read<Real>(low, std::span(lows).subspan(begin, count));
    context.read<Real>(high, std::span(highs).subspan(begin, count));
  }
  counts_.cubes += centers.size();
  return {rounded(std::move(lows)), rounded(std::move(highs))};
}

}  // namespace qjulia

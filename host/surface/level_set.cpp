#include "surface/level_set.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "device/point_batch.hpp"
#include "surface/grid_block.hpp"
#include "surface/interpolated_orbits.hpp"

namespace qjulia::surface {
namespace {

/// Points on the device at a time, for memory's sake.
constexpr std::size_t kMostPoints = std::size_t{1} << 20;

/// Points on the device with their F.
template <class Real>
struct Orbits {
  std::size_t stride = 0;
  device::Buffer<Real> points;  ///< arrays X, Y, Z, W of `stride`
  device::Buffer<Real> field;   ///< `stride`
};

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
  counts_.potentials += block.size();
  const device::Argument points = grid_block(grid, block, precision());
  device::PointBatch batch(map_.context(), kernel("level_set_dense"), precision(), map_.lanes(),
                           map_.step_cost() * iterations_);
  std::vector<float> values(block.size());
  batch.run<0, 1>(
      values.size(), device::PointBatch::NoInputs{},
      [&](const device::PointBatch::Part& part) {
        return std::vector<device::Argument>{points,
                                             device::narrow(part.first / map_.lanes()),
                                             device::narrow(part.items),
                                             map_.buffer(),
                                             map_.factors(),
                                             iterations_,
                                             map_.real(level),
                                             part.out};
      },
      [&](std::size_t i, const std::array<double, 1>& f) { values[i] = static_cast<float>(f[0]); });
  return values;
}

void LevelSet::at(const Grid& grid, const GridBlock& block, std::span<const std::int32_t> numbers,
                  std::span<float> values) const {
  precision() == Precision::dbl ? at_in<double>(grid, block, numbers, values)
                                : at_in<float>(grid, block, numbers, values);
}

void LevelSet::clamped_at(const Grid& grid, const GridBlock& block,
                          std::span<const std::int32_t> numbers, const ClampRange& clamp,
                          std::span<float> values) const {
  precision() == Precision::dbl ? clamped_at_in<double>(grid, block, numbers, clamp, values)
                                : clamped_at_in<float>(grid, block, numbers, clamp, values);
}

std::vector<float> LevelSet::at(const PointList& points) const {
  return precision() == Precision::dbl ? at_in<double>(points) : at_in<float>(points);
}

FieldBounds LevelSet::bounds(const PointList& centers, double half_side) const {
  counts_.cubes += centers.size();
  device::PointBatch batch(map_.context(), kernel("level_set_bounds"), precision(), map_.lanes(),
                           map_.step_cost());
  FieldBounds bounds{std::vector<float>(centers.size()), std::vector<float>(centers.size())};
  batch.run<3, 2>(
      centers.size(),
      [&](std::size_t i) {
        return std::array{centers.x[i], centers.y[i], centers.z[i]};
      },
      [&](const device::PointBatch::Part& part) {
        return std::vector<device::Argument>{part.in,
                                             device::narrow(part.stride),
                                             device::narrow(part.items),
                                             map_.real(half_side),
                                             map_.buffer(),
                                             map_.factors(),
                                             iterations_,
                                             part.out};
      },
      [&](std::size_t i, const std::array<double, 2>& f) {
        bounds.low[i] = static_cast<float>(f[0]);
        bounds.high[i] = static_cast<float>(f[1]);
      });
  return bounds;
}

template <class Real>
void LevelSet::at_in(const Grid& grid, const GridBlock& block,
                     std::span<const std::int32_t> numbers, std::span<float> values) const {
  auto& context = map_.context();
  const auto numbered_kernel = kernel("level_set_numbered");
  const device::Argument points = grid_block(grid, block, precision());
  device::Buffer<std::int32_t> sent;
  const auto start = [&](std::size_t begin, std::size_t count, const Orbits<Real>& orbits) {
    if (sent.size() == 0) sent = context.allocate<std::int32_t>(orbits.stride);
    context.write<std::int32_t>(sent, numbers.subspan(begin, count));
    const std::size_t groups = map_.groups(count);
    context.launch(numbered_kernel, {{groups, 1, 1}},
                   {sent, points, device::narrow(orbits.stride), device::narrow(groups),
                    map_.buffer(), map_.factors(), orbits.points, orbits.field},
                   work(groups));
  };
  iterate<Real>(
      numbers.size(), numbered_kernel, start, [&](std::size_t begin, std::span<const Real> found) {
        for (std::size_t i = 0; i < found.size(); ++i) {
          values[static_cast<std::size_t>(numbers[begin + i])] = static_cast<float>(found[i]);
        }
      });
}

template <class Real>
void LevelSet::clamped_at_in(const Grid& grid, const GridBlock& block,
                             std::span<const std::int32_t> numbers, const ClampRange& clamp,
                             std::span<float> values) const {
  // Bounds of what interpolated orbits are off by know nothing of paint.
  if (iterations_ == 1 || !map_.interpolates() || map_.is_painted()) {
    at_in<Real>(grid, block, numbers, values);
    return;
  }
  InterpolatedOrbits<Real> orbits(map_, grid, block,
                                  std::min<double>(below_, clamp.level - clamp.below), clamp.level,
                                  std::max<double>(above_, clamp.level + clamp.above));
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
                   {orbits.points, device::narrow(orbits.stride), device::narrow(groups),
                    map_.buffer(), map_.factors(), orbits.field},
                   work(groups));
  };
  std::vector<float> values(points.size());
  iterate<Real>(points.size(), points_kernel, start,
                [&](std::size_t begin, std::span<const Real> found) {
                  std::ranges::transform(found, values.begin() + static_cast<std::ptrdiff_t>(begin),
                                         [](Real f) { return static_cast<float>(f); });
                });
  return values;
}

template <class Real, class Start, class Take>
void LevelSet::iterate(std::size_t count, const device::Kernel& first_kernel, Start start,
                       Take take) const {
  if (count == 0) return;
  auto& context = map_.context();
  const auto advance = kernel("level_set_advance");
  const std::size_t most = std::min(context.items_per_launch(first_kernel, work(1)),
                                    std::max<std::size_t>(1, kMostPoints / map_.lanes()));
  const std::size_t stride = std::min(map_.groups(count), most) * map_.lanes();
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
      if (undecided(values[i])) live.push_back(device::narrow(i));
    }
    place = live;
    counts_.iterated += live.size();
    for (int iterate = 1; iterate < iterations_ && !place.empty(); ++iterate) {
      if (live_numbers.size() == 0) live_numbers = context.allocate<std::int32_t>(stride);
      const std::size_t groups = map_.groups(place.size());
      live.resize(groups * map_.lanes(), live.back());
      context.write<std::int32_t>(live_numbers, live);
      device::launch_in_parts(context, advance, groups, map_.step_cost() * map_.points_per_item(),
                              [&](std::size_t first, std::size_t part) {
                                return std::vector<device::Argument>{
                                    orbits[0].points, orbits[0].field,       device::narrow(stride),
                                    live_numbers,     device::narrow(first), device::narrow(part),
                                    map_.buffer(),    map_.factors(),        orbits[1].points,
                                    orbits[1].field};
                              });
      context.read<Real>(orbits[1].field, std::span(reached).first(place.size()));
      std::swap(orbits[0], orbits[1]);
      counts_.iterates += place.size();
      std::size_t kept = 0;
      for (std::size_t i = 0; i < place.size(); ++i) {
        values[static_cast<std::size_t>(place[i])] = reached[i];
        if (!undecided(reached[i])) continue;
        live[kept] = device::narrow(i);
        place[kept++] = place[i];
      }
      live.resize(kept);
      place.resize(kept);
    }
    take(begin, std::span<const Real>(values).first(points));
  }
  counts_.potentials += count;
}

}  // namespace qjulia::surface

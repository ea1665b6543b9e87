#include "lattice/level_set.hpp"

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <utility>

#include "device/point_batch.hpp"
#include "lattice/interpolated_orbits.hpp"
#include "lattice/orbit_lookup.hpp"

namespace qjulia::surface {
namespace {

/// Points on the device at a time, for memory's sake.
constexpr std::size_t kMostPoints = std::size_t{1} << 20;

/// Points on the device with their F.
template <class Real>
struct Orbits {
  using Number = Real;
  std::size_t stride = 0;
  device::Buffer<Real> points;  ///< arrays X, Y, Z, W of `stride`
  device::Buffer<Real> field;   ///< `stride`
};

}  // namespace

LevelSet::LevelSet(const Device& device, const Map& map, const StopRadii& stops, int iterations,
                   Precision precision)
    : map_(device, map, stops, precision),
      iterations_(iterations),
      below_(static_cast<float>(map_.log_inner())),
      above_(static_cast<float>(map_.log_outer())) {}

double LevelSet::certainly_inside_below(double level) const {
  return iterations_ == 1 ? level : std::min<double>(below_, level);
}

double LevelSet::certainly_outside_above(double level) const {
  return iterations_ == 1 ? level : std::max<double>(above_, level);
}

std::vector<float> LevelSet::over(const Grid& grid, const GridBlock& block) const {
  std::vector<float> values(block.size());
  at(grid, block, all_numbers(block.size()), values);
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
        return device::PartCall{
            {points, device::narrow(part.first / map_.lanes()), device::narrow(part.items),
             map_.buffer(), map_.factors(), iterations_, map_.real(level), part.out},
            map_.work(part.stride, cost::field(iterations_), 1, iterations_ > 1)};
      },
      [&](std::size_t i, const std::array<double, 1>& f) { values[i] = static_cast<float>(f[0]); });
  return values;
}

void LevelSet::at(const Grid& grid, const GridBlock& block, std::span<const std::int32_t> numbers,
                  std::span<float> values) const {
  auto& context = map_.context();
  const auto numbered_kernel = kernel("level_set_numbered");
  const device::Argument points = grid_block(grid, block, precision());
  device::Buffer<std::int32_t> sent;
  const auto start = [&](std::size_t begin, std::size_t count, const auto& orbits) {
    if (sent.size() == 0) sent = context.allocate<std::int32_t>(orbits.stride);
    context.write<std::int32_t>(sent, numbers.subspan(begin, count));
    const std::size_t groups = map_.groups(count);
    context.launch(numbered_kernel, {{groups, 1, 1}},
                   {sent, points, device::narrow(orbits.stride), device::narrow(groups),
                    map_.buffer(), map_.factors(), orbits.points, orbits.field},
                   map_.work(groups * map_.lanes(), cost::kLogNorm, 6), work(groups));
  };
  iterate(numbers.size(), numbered_kernel, start, [&](std::size_t begin, const auto& found) {
    for (std::size_t i = 0; i < found.size(); ++i) {
      values[static_cast<std::size_t>(numbers[begin + i])] = static_cast<float>(found[i]);
    }
  });
}

void LevelSet::clamped_at(const Grid& grid, const GridBlock& block,
                          std::span<const std::int32_t> numbers, const ClampRange& clamp,
                          std::span<float> values) const {
  if (lookup_) {
    std::vector<std::int32_t> left;
    for (const std::size_t i : looked_up(
             numbers.size(),
             [&](std::size_t i) {
               const auto number = static_cast<std::size_t>(numbers[i]);
               return grid.point(block.first + index_of(number, block.count));
             },
             [&](std::size_t i, float f) { values[static_cast<std::size_t>(numbers[i])] = f; })) {
      left.push_back(numbers[i]);
    }
    at(grid, block, left, values);
    return;
  }
  // Bounds of what interpolated orbits are off by know nothing of paint.
  if (iterations_ == 1 || !map_.interpolates() || map_.is_painted()) {
    at(grid, block, numbers, values);
    return;
  }
  const Unsettled others = settle_by_interpolation(
      map_, grid, block, std::min<double>(below_, clamp.level - clamp.below), clamp.level,
      std::max<double>(above_, clamp.level + clamp.above), numbers, values);
  counts_.nodes += others.nodes;
  counts_.settled += numbers.size() - others.numbers.size();
  at(grid, block, others.numbers, values);
}

template <class At, class Take>
std::vector<std::size_t> LevelSet::looked_up(std::size_t count, const At& point,
                                             const Take& take) const {
  std::vector<std::size_t> others;
  device::PointBatch batch(map_.context(), map_.kernel("look_up.cl", "look_up_points"), precision(),
                           1, kLookUpCost);
  batch.run<3, 1>(
      count,
      [&](std::size_t i) {
        const Eigen::Vector3d x = point(i);
        return std::array{x.x(), x.y(), x.z()};
      },
      [&](const device::PointBatch::Part& part) {
        Arguments arguments{part.in,
                            device::narrow(part.stride),
                            device::narrow(part.count),
                            map_.buffer(),
                            lookup_->tabled,
                            iterations_};
        append_lattice(lookup_->lattice, arguments);
        append_table(lookup_->table, arguments);
        arguments.emplace_back(part.out);
        return look_up_call(std::move(arguments), part.count);
      },
      [&](std::size_t i, const std::array<double, 1>& f) {
        if (std::isnan(f[0])) {
          others.push_back(i);
        } else {
          take(i, static_cast<float>(f[0]));
        }
      });
  counts_.settled += count - others.size();
  return others;
}

std::vector<float> LevelSet::at(std::span<const Eigen::Vector3d> points) const {
  if (!lookup_) return iterated_at(points);
  std::vector<float> values(points.size());
  const std::vector<std::size_t> others = looked_up(
      points.size(), [&](std::size_t i) { return points[i]; },
      [&](std::size_t i, float f) { values[i] = f; });
  std::vector<Eigen::Vector3d> left;
  left.reserve(others.size());
  for (const std::size_t i : others) left.push_back(points[i]);
  const std::vector<float> found = iterated_at(left);
  for (std::size_t i = 0; i < others.size(); ++i) values[others[i]] = found[i];
  return values;
}

std::vector<float> LevelSet::iterated_at(std::span<const Eigen::Vector3d> points) const {
  auto& context = map_.context();
  const auto points_kernel = kernel("level_set_points");
  const auto start = [&](std::size_t begin, std::size_t count, const auto& orbits) {
    using Real = typename std::decay_t<decltype(orbits)>::Number;
    std::vector<Real> sent(3 * orbits.stride);
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3d& x = points[begin + i];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        sent[axis * orbits.stride + i] = static_cast<Real>(x[static_cast<Eigen::Index>(axis)]);
      }
    }
    context.template write<Real>(orbits.points, sent);
    const std::size_t groups = map_.groups(count);
    context.launch(points_kernel, {{groups, 1, 1}},
                   {orbits.points, device::narrow(orbits.stride), device::narrow(groups),
                    map_.buffer(), map_.factors(), orbits.field},
                   map_.work(groups * map_.lanes(), cost::kLogNorm, 5), work(groups));
  };
  std::vector<float> values(points.size());
  iterate(points.size(), points_kernel, start, [&](std::size_t begin, const auto& found) {
    std::ranges::transform(found, values.begin() + static_cast<std::ptrdiff_t>(begin),
                           [](auto f) { return static_cast<float>(f); });
  });
  return values;
}

FieldBounds LevelSet::bounds(std::span<const Eigen::Vector3d> centers, double half_side) const {
  counts_.bounded_blocks += centers.size();
  device::PointBatch batch(map_.context(), kernel("level_set_bounds"), precision(), map_.lanes(),
                           map_.step_cost());
  FieldBounds bounds{std::vector<float>(centers.size()), std::vector<float>(centers.size())};
  batch.run<3, 2>(
      centers.size(),
      [&](std::size_t i) {
        return std::array{centers[i].x(), centers[i].y(), centers[i].z()};
      },
      [&](const device::PointBatch::Part& part) {
        return device::PartCall{
            {part.in, device::narrow(part.stride), device::narrow(part.items), map_.real(half_side),
             map_.buffer(), map_.factors(), iterations_, part.out},
            map_.work(part.stride, cost::kFieldBounds, 5)};
      },
      [&](std::size_t i, const std::array<double, 2>& f) {
        bounds.low[i] = static_cast<float>(f[0]);
        bounds.high[i] = static_cast<float>(f[1]);
      });
  return bounds;
}

template <class Real, class Start, class Take>
void LevelSet::iterate_in(std::size_t count, const device::Kernel& first_kernel, const Start& start,
                          const Take& take) const {
  if (count == 0) return;
  auto& context = map_.context();
  const auto advance =
      lookup_ ? map_.kernel("look_up.cl", "look_up_rest") : kernel("level_set_advance");
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
      const auto call = [&](std::size_t first, std::size_t part) {
        Arguments list{orbits[0].points, orbits[0].field,       device::narrow(stride),
                       live_numbers,     device::narrow(first), device::narrow(part),
                       map_.buffer(),    map_.factors()};
        if (lookup_) {
          list.emplace_back(iterate);
          list.emplace_back(iterations_);
          append_table(lookup_->table, list);
        } else {
          list.emplace_back(orbits[1].points);
        }
        list.emplace_back(orbits[1].field);
        const std::size_t advanced = part * map_.lanes();
        const int iterates = lookup_ ? iterations_ - iterate : 1;
        return device::PartCall{std::move(list), map_.work(advanced, iterates * cost::kStep,
                                                           lookup_ ? 6 : 10, lookup_ != nullptr)};
      };
      device::launch_in_parts(context, advance, groups, map_.step_cost() * map_.points_per_item(),
                              call);
      context.read<Real>(orbits[1].field, std::span(reached).first(place.size()));
      std::swap(orbits[0], orbits[1]);
      counts_.iterates += place.size();
      std::size_t kept = 0;
      for (std::size_t i = 0; i < place.size(); ++i) {
        values[static_cast<std::size_t>(place[i])] = reached[i];
        if (lookup_ || !undecided(reached[i])) continue;
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

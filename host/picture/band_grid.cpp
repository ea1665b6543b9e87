#include "picture/band_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "device/point_batch.hpp"
#include "lattice/grid_layout.hpp"
#include "picture/framing.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/map/slope.hpp"

namespace qjulia::picture {
namespace {

constexpr int kFirstCells = 64;  ///< along the ball, to find the band's box
/// The share of a step that is safe when the step comes from a coarser grid: F₁ bends between its
/// points.
constexpr double kCoarseShare = 0.75;
constexpr double kNone = 1e30;
/// Values at the grid's points are clamped to it: the surface lies where they are near 0.
constexpr double kMostValue = 1;
/// Rays end before they are this many shells deep in the band.
constexpr double kDeepest = 2.5;

/// A grid over the box, `cells` along its longest side.
surface::Grid grid_over(const Box& box, int cells) {
  return surface::grid_around(box, box.size().maxCoeff() / cells, 0);
}

/// Trilinear between the grid's points; beyond it, as at its nearest face.
double interpolated(const surface::Grid& grid, const std::vector<double>& values,
                    const Eigen::Vector3d& p) {
  const Eigen::Array3d last = (grid.points.cast<double>().array() - 1.001).max(0.0);
  const Eigen::Array3d at = ((p - grid.origin) / grid.step).array().max(0.0).min(last);
  const Eigen::Array3i low = at.cast<int>();
  const Eigen::Array3d way = at - at.floor();
  const auto row = static_cast<std::size_t>(grid.points[0]);
  const std::size_t slice = row * static_cast<std::size_t>(grid.points[1]);
  const double* c = values.data() + surface::number_of(low, grid.points);
  const auto along_x = [&](const double* v) { return std::lerp(v[0], v[1], way[0]); };
  const auto along_y = [&](const double* v) {
    return std::lerp(along_x(v), along_x(v + row), way[1]);
  };
  return std::lerp(along_y(c), along_y(c + slice), way[2]);
}

/// The box of the points whose safe step is shorter than a cell, and a cell around.
Box close_box(const surface::Grid& grid, const std::vector<double>& safe) {
  const Eigen::Vector3d cell = Eigen::Vector3d::Constant(grid.step);
  const auto close =
      surface::marked_indices(grid, [&](std::size_t i) { return safe[i] < grid.step; });
  if (!close) return {-cell, cell};
  return {grid.point(close->first) - cell, grid.point(close->second) + cell};
}

/// The mean length, over rays through the box, that lies among this many of the grid's points.
double mean_way(std::ptrdiff_t points, const surface::Grid& grid, const Box& box) {
  const Eigen::Vector3d size = box.size();
  const double face = (size.x() * size.y() + size.y() * size.z() + size.z() * size.x()) / 3;
  return face > 0 ? static_cast<double>(points) * std::pow(grid.step, 3) / face : 0;
}

/// The points of bodies that hold at least a hundredth as many inside points as the largest body.
/// Bodies are connected sets of blocks of 2 × 2 × 2 points, so that thin necks do not divide them.
template <class IsInside>
std::vector<bool> large_bodies(const Eigen::Vector3i& points, const IsInside& is_inside) {
  constexpr double kLeast = 0.01;
  const Eigen::Vector3i blocks = (points.array() + 1) / 2;
  const auto block_of = [&](const Eigen::Vector3i& index) {
    return surface::number_of(Eigen::Vector3i(index.array() / 2), blocks);
  };
  std::vector<std::size_t> held(surface::number_of(blocks.array() - 1, blocks) + 1);
  surface::for_points(points, [&](std::size_t number, const Eigen::Vector3i& index) {
    if (is_inside(number)) ++held[block_of(index)];
  });
  std::vector<int> body(held.size(), -1);
  std::vector<double> sizes;
  surface::for_points(blocks, [&](std::size_t first, const Eigen::Vector3i& at) {
    if (held[first] == 0 || body[first] >= 0) return;
    const int number = static_cast<int>(sizes.size());
    sizes.push_back(0);
    std::vector<Eigen::Vector3i> waiting{at};
    body[first] = number;
    while (!waiting.empty()) {
      const Eigen::Vector3i block = waiting.back();
      waiting.pop_back();
      sizes.back() += static_cast<double>(held[surface::number_of(block, blocks)]);
      surface::for_around(blocks, block, 1, [&](std::size_t other, const Eigen::Vector3i& next) {
        if (held[other] == 0 || body[other] >= 0) return;
        body[other] = number;
        waiting.push_back(next);
      });
    }
  });
  const double largest = sizes.empty() ? 0 : *std::ranges::max_element(sizes);
  std::vector<bool> counts;
  surface::for_points(points, [&](std::size_t number, const Eigen::Vector3i& index) {
    counts.push_back(is_inside(number) &&
                     sizes[static_cast<std::size_t>(body[block_of(index)])] >= kLeast * largest);
  });
  return counts;
}

}  // namespace

Band find_band(const Device& device, const MarchedSet& set, const Box& shape) {
  const Map& map = set.map;
  Band band;
  band.stops = find_stop_radii(device, map, set.escape, set.stop);
  band.radius = 1.001 * std::min(band.stops.outer, band.stops.escape);
  band.level = set.iterations == 1 ? map.dynamics.surface_level
                                   : std::log(std::min(band.stops.outer, band.stops.escape));
  const Box ball = surface::cube(band.radius);
  const Box within{shape.low.cwiseMax(ball.low), shape.high.cwiseMin(ball.high)};
  // Steps are those that are safe without paint (plain_safe_step in kernels/map.clh).
  const Field field(device, without_paint(without_portals(map)), Precision::single, band.stops);
  std::optional<double> steepest = steepest_slope(field, map.dynamics.slice, band.level, within);
  if (!steepest) steepest = steepest_slope(field, map.dynamics.slice, band.level, ball);
  band.steepest = steepest.value_or(20 / ball.diagonal());
  return band;
}

BandGrid::BandGrid(const Device& device, const MarchedSet& set, const Band& band)
    : set_(set),
      band_(band),
      map_(device, set.map, band.stops, set.precision),
      inner_(map_.has_portals() ? -kNone : (map_.log_inner() - band.level) / band.steepest),
      deepest_(std::max(inner_, -kDeepest / band.steepest)) {
  device::Context& context = map_.context();
  const surface::Grid first = grid_over(surface::cube(band.radius), kFirstCells);
  const std::vector<double> first_steps =
      safe_steps(first, surface::all_numbers(surface::whole(first).size()));
  bounds_ = close_box(first, first_steps);
  if (set.part) {
    const Box seen{bounds_.low.cwiseMax(set.part->low), bounds_.high.cwiseMin(set.part->high)};
    is_empty_ = !(seen.size().array() > 0).all();
    bounds_ = is_empty_ ? *set.part : seen;
  }
  grid_ = grid_over(bounds_, set.cells);
  layout_ = context.upload_real(surface::grid_layout(grid_, bounds_), set_.precision);
  steps_ = safe_steps(grid_, first, first_steps);
  safe_ = context.upload_real(steps_, set_.precision);
  if (map_.has_portals()) return;
  const auto undecided =
      std::ranges::count_if(steps_, [this](double step) { return step < 0 && step > deepest_; });
  way_in_band_ = mean_way(undecided, grid_, bounds_);
}

std::vector<double> BandGrid::safe_steps(const surface::Grid& grid,
                                         std::vector<std::int32_t> numbers) const {
  std::vector<double> safe(numbers.size());
  if (numbers.empty()) return safe;
  device::Context& context = map_.context();
  const auto layout = context.upload_real(surface::grid_layout(grid), set_.precision);
  numbers.resize(map_.groups(numbers.size()) * map_.lanes(), numbers.back());
  const auto sent = context.upload<std::int32_t>(numbers);
  device::PointBatch batch(context, map_.kernel("ray_march.cl", "safe_steps"), set_.precision,
                           map_.lanes(), map_.modulus_cost());
  batch.run<0, 1>(
      safe.size(), device::PointBatch::NoInputs{},
      [&](const device::PointBatch::Part& part) {
        return device::PartCall{
            {layout, sent, device::narrow(part.first / map_.lanes()), device::narrow(part.items),
             map_.buffer(), map_.factors(), set_.iterations, map_.real(band_.level),
             map_.real(band_.steepest), part.out},
            map_.work(part.stride, cost::kLogNorm, 2)};
      },
      [&](std::size_t i, const std::array<double, 1>& step) { safe[i] = step[0]; });
  return safe;
}

std::vector<double> BandGrid::safe_steps(const surface::Grid& grid, const surface::Grid& coarse,
                                         const std::vector<double>& coarse_steps) const {
  const std::size_t points = surface::whole(grid).size();
  // Between points of the coarse grid there may be a portal.
  if (map_.has_portals()) return safe_steps(grid, surface::all_numbers(points));
  const double near = coarse.step + grid.step;
  std::vector<double> safe(points);
  std::vector<std::int32_t> numbers;
  surface::for_points(grid.points, [&](std::size_t number, const Eigen::Vector3i& index) {
    const double step = interpolated(coarse, coarse_steps, grid.point(index));
    safe[number] = (step > 0 ? kCoarseShare : 1) * step;
    if (step < near && step > deepest_ - near) numbers.push_back(device::narrow(number));
  });
  const std::vector<double> found = safe_steps(grid, numbers);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    safe[static_cast<std::size_t>(numbers[i])] = found[i];
  }
  return safe;
}

bool BandGrid::has_orbits_near(const Eigen::Vector3d& p, double reach) const {
  const double step = interpolated(grid_, steps_, p);
  return step < 0.25 * grid_.step + reach && step > deepest_ - reach;
}

surface::LevelSet BandGrid::level_set() const {
  surface::LevelSet set(map_.device(), set_.map, band_.stops, set_.iterations, set_.precision);
  set.look_up(lookup_);
  return set;
}

const std::vector<float>& BandGrid::values() {
  if (!values_.empty()) return values_;
  // Where F₁ alone decides the side, F₁ follows from the safe step.
  const double outside = band_.level - set_.map.dynamics.surface_level;
  values_.resize(steps_.size());
  std::vector<std::int32_t> undecided;
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    values_[i] = static_cast<float>(outside + band_.steepest * steps_[i]);
    if (steps_[i] < 0 && steps_[i] > inner_ - grid_.step) undecided.push_back(device::narrow(i));
  }
  std::vector<float> found(steps_.size());
  // No look-ups: they depend on the view, and the outline must not.
  surface::LevelSet(map_.device(), set_.map, band_.stops, set_.iterations, set_.precision)
      .clamped_at(grid_, surface::whole(grid_), undecided,
                  {set_.map.dynamics.surface_level, kMostValue, kMostValue}, found);
  for (const std::int32_t i : undecided) {
    const auto number = static_cast<std::size_t>(i);
    values_[number] = found[number] - static_cast<float>(set_.map.dynamics.surface_level);
  }
  // Far values say nothing about where between two points the surface lies.
  constexpr auto kMost = static_cast<float>(kMostValue);
  for (float& value : values_) value = std::clamp(value, -kMost, kMost);
  return values_;
}

std::vector<float> BandGrid::ways_inside(const std::vector<Eigen::Vector3d>& points) const {
  const surface::LevelSet potential(map_.device(), set_.map, band_.stops, 1, set_.precision);
  std::vector<float> ways = potential.at(points);
  for (float& way : ways) {
    way = static_cast<float>((set_.map.dynamics.surface_level - double{way}) / band_.steepest);
  }
  return ways;
}

std::vector<Eigen::Vector3d> BandGrid::outline() {
  if (is_empty_) return {};
  // What was left out since then counts as before: no outline depends on what was drawn first.
  std::vector<float> f = values();
  for (const auto& [number, value] : left_out_) f[number] = value;
  const auto is_inside = [&](std::size_t number) { return f[number] < 0; };
  const std::vector<bool> counts = map_.has_portals() ? std::vector<bool>(f.size(), true)
                                                      : large_bodies(grid_.points, is_inside);
  const auto row = static_cast<std::size_t>(grid_.points[0]);
  const std::array strides{std::size_t{1}, row, row * static_cast<std::size_t>(grid_.points[1])};
  std::vector<Eigen::Vector3d> points;
  surface::for_points(grid_.points, [&](std::size_t number, const Eigen::Vector3i& index) {
    if (!is_inside(number) || !counts[number]) return;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) {
        const int next = index[axis] + sign;
        Eigen::Vector3d point = grid_.point(index);
        if (next >= 0 && next < grid_.points[axis]) {
          const std::size_t stride = strides.at(static_cast<std::size_t>(axis));
          const std::size_t other = sign > 0 ? number + stride : number - stride;
          if (is_inside(other)) continue;
          point[axis] += sign * grid_.step * double{f[number] / (f[number] - f[other])};
        }
        // The grid may reach beyond the part that is seen by less than a cell.
        points.push_back(point.cwiseMax(bounds_.low).cwiseMin(bounds_.high));
      }
    }
  });
  return extremes(points);
}

double BandGrid::near() const { return 0.25 * grid_.step; }

surface::Insides BandGrid::insides(const std::stop_token& stop) const {
  return [this, stop, set = level_set()](const std::vector<Eigen::Vector3d>& points) {
    throw_if_stopped(stop);
    std::vector<bool> found(points.size());
    std::vector<Eigen::Vector3d> asked;
    std::vector<std::size_t> numbers;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (interpolated(grid_, steps_, points[i]) > near()) continue;
      asked.push_back(points[i]);
      numbers.push_back(i);
    }
    const std::vector<float> values = set.at(asked);
    for (std::size_t i = 0; i < values.size(); ++i) {
      found[numbers[i]] = double{values[i]} < set_.map.dynamics.surface_level;
    }
    return found;
  };
}

surface::LoosePlaces BandGrid::loose_places() {
  std::vector<bool> is_inside(steps_.size()), may_be_inside(steps_.size());
  for (std::size_t i = 0; i < steps_.size(); ++i) {
    is_inside[i] = values()[i] < 0;
    may_be_inside[i] = steps_[i] < near();
  }
  const double cells = grid_.points.maxCoeff();
  const int divisions = std::max(2, static_cast<int>(std::ceil(set_.finest_cells / cells)));
  return surface::find_loose_places(grid_, is_inside, may_be_inside, divisions, insides(set_.stop));
}

void BandGrid::look_finer(surface::LoosePlaces& places, int finer,
                          const surface::Sight& is_in_sight, const std::stop_token& stop) const {
  surface::look_finer(places, finer, is_in_sight, insides(stop));
}

void BandGrid::leave_out(const surface::LoosePlaces& places) {
  values();
  surface::for_points(grid_.points, [&](std::size_t number, const Eigen::Vector3i& index) {
    if (!(values_[number] < 0) || !places.holds(grid_.point(index))) return;
    left_out_.emplace_back(number, values_[number]);
    values_[number] = 1;
  });
}

std::vector<float> BandGrid::depths(const View& view, int first_row, int rows) {
  device::Context& context = map_.context();
  if (sent_values_.size() == 0) {
    sent_values_ =
        context.upload_real(std::vector<double>(values().begin(), values().end()), set_.precision);
    grid_depth_ = context.kernel("ray_grid.cl", "grid_depth", {1, set_.precision, {}});
  }
  const auto wide = static_cast<std::size_t>(view.columns);
  const auto deep = static_cast<std::size_t>(rows);
  const auto out = context.allocate_real(wide * deep, set_.precision);
  context.launch(grid_depth_, {{(wide + 7) / 8 * 8, (deep + 7) / 8 * 8, 1}, {8, 8, 1}},
                 {context.upload_real(view.packed(), set_.precision), view.columns, first_row, rows,
                  layout_, safe_, sent_values_, out},
                 device::moving(static_cast<double>(wide * deep)));
  std::vector<double> depths(wide * deep);
  context.read(out, depths);
  return {depths.begin(), depths.end()};
}

}  // namespace qjulia::picture

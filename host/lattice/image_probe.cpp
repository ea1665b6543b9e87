#include "lattice/image_probe.hpp"

#include <algorithm>
#include <cmath>

#include "base/median.hpp"

namespace qjulia::surface {
namespace {

/// How far points are moved to see how their images move, map units.
constexpr double kMove = 1e-4;
/// Points that the first stretch is measured at.
constexpr std::size_t kStretchProbes = 8192;

/// A random unit vector along the first `axes` axes.
Point4 direction(std::size_t axes, base::Random& random) {
  for (;;) {
    Point4 p{};
    for (std::size_t c = 0; c < axes; ++c) p[c] = random.uniform(-1, 1);
    const double size = length(p);
    if (!(size > 0.1 && size < 1)) continue;
    for (double& c : p) c /= size;
    return p;
  }
}

auto numbered(const std::vector<Point4>& points) {
  return [&points](std::size_t i) { return points[i]; };
}

}  // namespace

double length(const Point4& p) {
  return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
}

double distance(const Point4& a, const Point4& b) {
  return length({a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]});
}

Point4 image_of(double f, const std::array<float, 4>& u) {
  Point4 p{};
  std::ranges::transform(u, p.begin(), [scale = std::exp(f)](float c) { return scale * c; });
  return p;
}

template <std::size_t kOutputs, class Take>
void ImageProbe::run(const char* kernel, std::size_t points, const PointOf& point_of, double slots,
                     double reals, const std::vector<device::Argument>& more,
                     const Take& take) const {
  device::PointBatch batch(map_.context(), map_.kernel("image_table.cl", kernel), map_.precision(),
                           map_.lanes(), map_.step_cost());
  batch.run<4, kOutputs>(
      points, point_of,
      [&](const device::PointBatch::Part& part) {
        std::vector<device::Argument> list{part.in, device::narrow(part.stride),
                                           device::narrow(part.items)};
        for (const device::Argument& argument : more) list.push_back(argument);
        list.emplace_back(map_.buffer());
        list.emplace_back(map_.factors());
        list.emplace_back(part.out);
        return device::PartCall{std::move(list), map_.work(part.stride, slots, reals)};
      },
      take, 0, stop_);
}

std::vector<float> ImageProbe::fields(std::size_t points, const PointOf& point_of) const {
  std::vector<float> fields(points);
  run<1>(
      "node_fields", points, point_of, cost::kLogNorm, 5, {},
      [&](std::size_t i, const std::array<double, 1>& f) { fields[i] = static_cast<float>(f[0]); });
  return fields;
}

std::vector<std::array<float, 4>> ImageProbe::versors(std::size_t points,
                                                      const PointOf& point_of) const {
  std::vector<std::array<float, 4>> versors(points);
  run<4>("node_versors", points, point_of, cost::kVersorAlone, 8, {},
         [&](std::size_t i, const Point4& u) {
           std::ranges::transform(u, versors[i].begin(),
                                  [](double c) { return static_cast<float>(c); });
         });
  return versors;
}

std::vector<std::array<double, 2>> ImageProbe::bounds(const std::vector<Point4>& points,
                                                      double half_side) const {
  std::vector<std::array<double, 2>> bounds(points.size());
  run<2>("cube_bounds", points.size(), numbered(points), cost::kFieldBounds, 6,
         {map_.real(half_side)},
         [&](std::size_t i, const std::array<double, 2>& found) { bounds[i] = found; });
  return bounds;
}

ImageProbe::Moved ImageProbe::moved_images(const std::vector<Point4>& points, std::size_t axes,
                                           base::Random& random) const {
  const std::vector<float> all_fields = fields(points.size(), numbered(points));
  std::vector<Point4> undecided, nearby;
  Moved moved;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (all_fields[i] < map_.log_inner() || all_fields[i] > map_.log_outer()) continue;
    moved.from.push_back(i);
    undecided.push_back(points[i]);
    const Point4 way = direction(axes, random);
    nearby.push_back(points[i]);
    for (std::size_t c = 0; c < 4; ++c) nearby.back()[c] += kMove * way[c];
  }
  const auto turns = versors(undecided.size(), numbered(undecided)),
             nearby_turns = versors(nearby.size(), numbered(nearby));
  const std::vector<float> nearby_fields = fields(nearby.size(), numbered(nearby));
  for (std::size_t i = 0; i < undecided.size(); ++i) {
    moved.images.push_back(image_of(all_fields[moved.from[i]], turns[i]));
    moved.stretches.push_back(
        distance(moved.images[i], image_of(nearby_fields[i], nearby_turns[i])) / kMove);
  }
  return moved;
}

ImageProbe::Moved ImageProbe::first_images(std::size_t count, base::Random& random) const {
  const double radius = std::exp(map_.log_outer());
  std::vector<Point4> starts;
  for (std::size_t i = 0; i < count; ++i) {
    Point4 p{0, 0, 0, map_.slice()};
    for (std::size_t c = 0; c < 3; ++c) p[c] = random.uniform(-radius, radius);
    starts.push_back(p);
  }
  return moved_images(starts, 3, random);
}

double first_stretch(const map::DeviceMap& map, const std::stop_token& stop) {
  base::Random random(1);
  std::vector<double> stretches =
      ImageProbe(map, stop).first_images(kStretchProbes, random).stretches;
  return stretches.empty() ? 1 : std::max(base::median(stretches), 1.0);
}

std::vector<double> stretches_at(const map::DeviceMap& map,
                                 const std::vector<Eigen::Vector3d>& points, int most,
                                 double quantile, const std::stop_token& stop) {
  base::Random random(1);
  const ImageProbe probe(map, stop);
  std::vector<Point4> at;
  at.reserve(points.size());
  for (const Eigen::Vector3d& p : points) at.push_back({p.x(), p.y(), p.z(), map.slice()});
  std::vector<double> so_far(at.size(), 1), found;
  while (static_cast<int>(found.size()) < most) {
    ImageProbe::Moved moved = probe.moved_images(at, found.empty() ? 3 : 4, random);
    if (moved.from.empty()) break;
    for (std::size_t i = 0; i < moved.from.size(); ++i) {
      moved.stretches[i] *= so_far[moved.from[i]];
    }
    at = std::move(moved.images);
    so_far = std::move(moved.stretches);
    std::vector<double> sorted = so_far;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(
                                             quantile * static_cast<double>(sorted.size() - 1));
    std::ranges::nth_element(sorted, middle);
    found.push_back(std::max(*middle, 1.0));
  }
  return found;
}

}  // namespace qjulia::surface

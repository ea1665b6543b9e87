#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/random.hpp"
#include "map/checks.hpp"
#include "map/portals.hpp"
#include "map/sphere_directions.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {

using namespace map;

namespace {

constexpr double kRadiusMargin = 0.02;  // subtracted from radii, and asked of F against ln r
/// How far ln r_in stays below L, and ln r_out above it, so that they differ in single precision.
constexpr double kLevelMargin = 1e-5;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Even directions over the 4-D sphere and over the slice's own sphere, and those of centres: the
/// shape's tips are thin, and centres sit in them. Of very many centres an evenly spaced part
/// stands for all, since each direction costs a sum over all factors.
std::vector<Quaternion> probe_directions(const Map& map) {
  std::vector<Quaternion> directions = sphere_directions(4096);
  for (std::size_t i = 0; i < 2048; ++i) {
    Quaternion u = directions[i];
    u.w = 0;
    if (norm(u) > 0) directions.push_back((1 / norm(u)) * u);
  }
  constexpr std::size_t kMostCenters = 4096;
  const std::size_t stride = (map.dynamics.factors.size() + kMostCenters - 1) / kMostCenters;
  for (std::size_t k = 0; k < map.dynamics.factors.size(); k += stride) {
    const Quaternion& center = map.dynamics.factors[k].center;
    if (norm(center) > 0) directions.push_back((1 / norm(center)) * center);
  }
  return directions;
}

/// Half of where r_in is looked for when nothing else says how far: the longest |c_k|, or what the
/// modulus says.
double reach(const Map& map) {
  double longest = std::visit(
      [](const auto& modulus) {
        if constexpr (requires { modulus.reach(); }) return modulus.reach();
        return 0.0;
      },
      map.dynamics.modulus);
  for (const Factor& factor : map.dynamics.factors)
    longest = std::max(longest, norm(factor.center));
  return longest;
}

/// F_1 in all directions at each radius. Several spheres make a launch that is worth its while.
std::vector<std::vector<double>> field_on_spheres(const Field& field,
                                                  const std::vector<Quaternion>& directions,
                                                  const std::vector<double>& radii) {
  std::vector<Quaternion> points;
  points.reserve(radii.size() * directions.size());
  for (const double radius : radii) {
    for (const Quaternion& u : directions) points.push_back(radius * u);
  }
  const std::vector<double> values = field.at(points);
  std::vector<std::vector<double>> spheres;
  const auto count = static_cast<std::ptrdiff_t>(directions.size());
  for (auto from = values.begin(); from != values.end(); from += count) {
    spheres.emplace_back(from, from + count);
  }
  return spheres;
}

std::vector<double> on_sphere(const Field& field, const std::vector<Quaternion>& directions,
                              double radius) {
  return field_on_spheres(field, directions, {radius}).front();
}

enum class Extreme { lowest, highest };

/// The extremes of F_1 over 4-D spheres about the origin, by local search from many directions.
class SphereSearch {
 public:
  SphereSearch(const Field& field, Extreme wanted) : field_(field), wanted_(wanted) {}

  /// Begins anew from the best of `directions` (unit), judged by `values` = F_1 there.
  void seed(const std::vector<Quaternion>& directions, const std::vector<double>& values) {
    constexpr std::size_t kSeeds = 512;
    std::vector<std::size_t> order(directions.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto kept = static_cast<std::ptrdiff_t>(std::min(kSeeds, order.size()));
    std::partial_sort(order.begin(), order.begin() + kept, order.end(),
                      [&](std::size_t a, std::size_t b) {
                        return better(values[a], values[b]) || (values[a] == values[b] && a < b);
                      });
    order.resize(static_cast<std::size_t>(kept));
    seeds_.clear();
    for (const std::size_t i : order) seeds_.push_back(directions[i]);
  }

  /// The most extreme F_1 found on the sphere of `radius`; the seeds move to where it is.
  double refine(double radius) {
    constexpr std::size_t kTries = 6;
    std::vector<double> best = on_sphere(field_, seeds_, radius);
    std::vector<Quaternion> tries(kTries * seeds_.size());
    for (double size = 0.12; size > 0.003; size *= 0.6) {
      for (std::size_t i = 0; i < tries.size(); ++i) {
        tries[i] = perturbed(seeds_[i / kTries], size);
      }
      const std::vector<double> values = on_sphere(field_, tries, radius);
      for (std::size_t i = 0; i < tries.size(); ++i) {
        const std::size_t seed = i / kTries;
        if (!better(values[i], best[seed])) continue;
        best[seed] = values[i];
        seeds_[seed] = tries[i];
      }
    }
    return wanted_ == Extreme::lowest ? *std::ranges::min_element(best)
                                      : *std::ranges::max_element(best);
  }

 private:
  bool better(double a, double b) const { return wanted_ == Extreme::lowest ? a < b : a > b; }

  Quaternion perturbed(const Quaternion& direction, double size) {
    const auto offset = [&] { return size * random_.uniform(-1, 1); };
    const Quaternion moved = direction + Quaternion{offset(), offset(), offset(), offset()};
    return (1 / norm(moved)) * moved;
  }

  const Field& field_;
  Extreme wanted_;
  std::vector<Quaternion> seeds_;
  base::Random random_{1};
};

constexpr int kSpheres = 8;  ///< a launch

/// Comes down from the certain bound until a sphere has a point that might return, then searches
/// about the worst directions of that sphere and goes up again as far as any is left.
double outer_radius(const Field& field, const Map& map, const std::vector<Quaternion>& directions) {
  const auto [certain, is_sharp] = std::visit(
      [&](const auto& modulus) { return modulus.outer_bound(map.dynamics); }, map.dynamics.modulus);
  if (is_sharp) return certain;
  const double far = 2 * reach(map);
  const double least = 1e-3 * certain;
  SphereSearch search(field, Extreme::lowest);
  const auto next = [far](double radius) { return radius / (radius > far ? 1.1 : 1.02); };
  const auto may_return = [](const std::vector<double>& values, double radius) {
    return *std::ranges::min_element(values) <= std::log(radius) + kRadiusMargin;
  };
  double radius = certain;
  for (bool is_found = false; radius > least && !is_found;) {
    std::vector<double> radii{radius};
    while (radii.size() < kSpheres) radii.push_back(next(radii.back()));
    for (const auto& values : field_on_spheres(field, directions, radii)) {
      is_found = may_return(values, radius);
      const bool is_last = is_found || next(radius) <= least;
      if (is_last) search.seed(directions, values);
      if (!is_found) radius = next(radius);
      if (is_last) break;
    }
  }
  while (radius < certain && search.refine(radius) <= std::log(radius) + kRadiusMargin) {
    radius *= 1.005;
  }
  return std::min(certain, (1 + kRadiusMargin) * radius);
}

/// The largest radius r ≤ limit such that F_1 ≤ ln((1 − margin) r) in the whole ball, or 0.
double inner_radius(const Field& field, const Map& map, const std::vector<Quaternion>& directions,
                    double limit) {
  constexpr int kSteps = 96, kHalvings = 4;
  const auto allowed = [](double radius) { return std::log((1 - kRadiusMargin) * radius); };
  // Close to a pole F_1 is high in a neighbourhood that no direction need meet.
  std::vector<Quaternion> near_poles;
  for (const auto& [center, exponent] : map.dynamics.factors) {
    if (exponent < 0) near_poles.push_back(center + Quaternion{1e-3, 0, 0, 0});
  }
  const std::vector<double> pole_values = field.at(near_poles);
  const auto highest_by_poles = [&](double radius) {
    double highest = -kInfinity;
    for (std::size_t k = 0; k < near_poles.size(); ++k) {
      if (norm(near_poles[k]) <= radius) highest = std::max(highest, pole_values[k]);
    }
    return highest;
  };

  // Highest F_1 in the ball of each radius, until none larger could be allowed.
  std::vector<double> radii;
  double highest = -kInfinity;
  static_assert(kSteps % kSpheres == 0);
  for (int step = 0; step < kSteps && highest <= allowed(limit);) {
    std::vector<double> next;
    for (int i = 1; i <= kSpheres; ++i) next.push_back(limit * (step + i) / kSteps);
    for (const auto& values : field_on_spheres(field, directions, next)) {
      const double radius = limit * ++step / kSteps;
      highest = std::max({highest, *std::ranges::max_element(values), highest_by_poles(radius)});
      if (highest <= allowed(radius)) radii.push_back(radius);
      if (highest > allowed(limit)) break;
    }
  }
  // From the largest down, the first that stands a local search; then up again by part of a step.
  SphereSearch search(field, Extreme::highest);
  const auto stands = [&](double radius) {
    if (highest_by_poles(radius) > allowed(radius)) return false;
    search.seed(directions, on_sphere(field, directions, radius));
    return search.refine(radius) <= allowed(radius);
  };
  while (!radii.empty() && !stands(radii.back())) radii.pop_back();
  if (radii.empty()) return 0;
  double radius = radii.back();
  double step = limit / kSteps;
  for (int halving = 0; halving < kHalvings; ++halving) {
    step /= 2;
    if (radius + step <= limit && stands(radius + step)) radius += step;
  }
  return radius;
}

}  // namespace

StopRadii find_stop_radii(const Device& device, const Map& map, std::optional<double> escape,
                          const std::stop_token& stop) {
  map.validate();
  if (escape) expect_escape(*escape, map.dynamics.surface_level);
  // With r_in below e^L and r_out above it, all later iterates of an orbit that stops would be on
  // the side of L on which it stops.
  const double inside_level = std::exp(map.dynamics.surface_level - kLevelMargin);
  const double outside_level = std::exp(map.dynamics.surface_level + kLevelMargin);
  if (!(outside_level < kLargestEscape)) {
    throw InputError(fmt::format(
        "the map's surface_level is {}: the set may reach radius e^surface_level, which must be "
        "below {}, map units",
        map.dynamics.surface_level, kLargestEscape));
  }
  // F_1 itself, however far out: no escape radius.
  const Field field(device, without_portals(map), Precision::single, {0, 0, kInfinity}, stop);
  const std::vector<Quaternion> directions = probe_directions(map);
  StopRadii stops;
  stops.outer = map.dynamics.degree() > 1
                    ? std::max(outer_radius(field, map, directions), outside_level)
                    : kInfinity;
  const bool bounded = std::isfinite(stops.outer);
  // Portals lead back from anywhere in their balls: no orbit stops there.
  const auto [nearest, farthest] = portal_reach(map.layers.portals);
  stops.outer = std::max(stops.outer, farthest);
  stops.escape = std::min(
      kLargestEscape, bounded ? 1.25 * stops.outer : std::max(kUsualEscape, 1.25 * outside_level));
  stops.inner =
      inner_radius(field, map, directions,
                   std::min({nearest, inside_level, bounded ? stops.outer : 2 * reach(map)}));
  if (escape) {
    stops.escape = *escape;
    // Orbits that stay in this ball may leave the smaller one.
    if (*escape < stops.inner) stops.inner = 0;
  }
  return stops;
}

}  // namespace qjulia

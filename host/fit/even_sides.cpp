#include "fit/even_sides.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "map/sphere_directions.hpp"

namespace qjulia::fitting {
namespace {

constexpr int kMostSweeps = 4;
/// Factors times directions: half a second at most, for all sweeps.
constexpr std::size_t kPairs = std::size_t{5} << 20;
constexpr std::size_t kMostDirections = 4096;
constexpr std::size_t kLeastDirections = 256;

std::vector<Quaternion> sphere(const RationalMap& map) {
  const std::size_t count = std::clamp(kPairs / std::max<std::size_t>(1, map.factors.size()),
                                       kLeastDirections, kMostDirections);
  std::vector<Quaternion> points = map::sphere_directions(count);
  for (Quaternion& q : points) q = std::exp(map.surface_level) * q;
  return points;
}

double log_distance(const Quaternion& q, const Quaternion& center) {
  constexpr double kTiny = 1e-15;
  return std::log(norm(q - center) + kTiny);
}

double unevenness(const std::vector<double>& field, std::vector<double>& scratch) {
  scratch = field;
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
  std::ranges::nth_element(scratch, middle);
  const double median = *middle;
  double sum = 0;
  for (const double f : field) sum += std::min(std::abs(f - median), 1.0);
  return sum / static_cast<double>(field.size());
}

/// F₁ less S.
std::vector<double> field_of(const RationalMap& map, const std::vector<Quaternion>& points) {
  std::vector<double> field(points.size(), 0);
  for (const auto& [center, exponent] : map.factors) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      field[i] += exponent * log_distance(points[i], center);
    }
  }
  return field;
}

}  // namespace

double unevenness(const RationalMap& map) {
  std::vector<double> scratch;
  return unevenness(field_of(map, sphere(map)), scratch);
}

RationalMap with_even_sides(const RationalMap& given) {
  RationalMap map = given;
  const std::vector<Quaternion> points = sphere(map);
  const auto mirrored = [&map](Quaternion center) {
    center.w = 2 * map.slice - center.w;
    return center;
  };
  for (Factor& factor : map.factors) {
    if (factor.center.w < map.slice) factor.center = mirrored(factor.center);
  }
  std::vector<double> field = field_of(map, points);
  std::vector<double> scratch;
  double least = unevenness(field, scratch);
  std::vector<double> tried(points.size());
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    bool moved = false;
    for (auto& [center, exponent] : map.factors) {
      const Quaternion other = mirrored(center);
      for (std::size_t i = 0; i < points.size(); ++i) {
        tried[i] = field[i] +
                   exponent * (log_distance(points[i], other) - log_distance(points[i], center));
      }
      const double value = unevenness(tried, scratch);
      if (value >= least) continue;
      least = value;
      field.swap(tried);
      center = other;
      moved = true;
    }
    if (!moved) break;
  }
  return least < unevenness(field_of(given, points), scratch) ? map : given;
}

}  // namespace qjulia::fitting

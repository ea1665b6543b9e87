#include "map/sphere_search.hpp"

#include <algorithm>
#include <numeric>

namespace qjulia::map {

void SphereSearch::seed(const std::vector<Quaternion>& directions,
                        const std::vector<double>& values) {
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

double SphereSearch::refine(double radius) {
  constexpr std::size_t kTries = 6;
  std::vector<double> best = values_at(seeds_, radius);
  std::vector<Quaternion> tries(kTries * seeds_.size());
  for (double size = 0.12; size > 0.003; size *= 0.6) {
    for (std::size_t i = 0; i < tries.size(); ++i) {
      tries[i] = perturbed(seeds_[i / kTries], size);
    }
    const std::vector<double> values = values_at(tries, radius);
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

Quaternion SphereSearch::perturbed(const Quaternion& direction, double size) {
  const auto offset = [&] { return size * random_.uniform(-1, 1); };
  const double x = offset();
  const double y = offset();
  const double z = offset();
  const double w = offset();
  const Quaternion moved = direction + Quaternion{x, y, z, w};
  return (1 / norm(moved)) * moved;
}

std::vector<double> SphereSearch::values_at(const std::vector<Quaternion>& directions,
                                            double radius) const {
  std::vector<Quaternion> points(directions.size());
  std::ranges::transform(directions, points.begin(),
                         [radius](const Quaternion& u) { return radius * u; });
  return field_.at(points);
}

}  // namespace qjulia::map

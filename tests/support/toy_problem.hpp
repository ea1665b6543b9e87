#pragma once
/// A problem whose answers come from a test.

#include <functional>
#include <utility>

#include "fit/problem.hpp"

namespace qjulia::test {

/// Unless a test says otherwise, the reference evaluates, every point is on the surface, overlaps
/// are 0.5, and maps are finished as they are.
struct ToyProblem : fitting::Problem {
  using Draw = std::function<energy::Samples(const fitting::Level&, base::Random&)>;
  explicit ToyProblem(Draw draw) : on_draw(std::move(draw)) {}

  energy::Samples draw(const fitting::Level& level, base::Random& random) const override {
    return on_draw(level, random);
  }
  std::unique_ptr<energy::Evaluator> evaluator(
      const energy::Samples& samples, const energy::EnergySettings& options) const override {
    return make_evaluator(samples, options);
  }
  std::vector<double> distances(const std::vector<Eigen::Vector3d>& points) const override {
    return on_distances ? on_distances(points) : std::vector<double>(points.size(), 0);
  }
  double overlap(const Map& map, int iterations) const override {
    return on_overlap ? on_overlap(map, iterations) : 0.5;
  }
  fitting::FinishedMap finished(const Map& map) const override {
    return {on_finished ? on_finished(map) : map, {}};
  }

  Draw on_draw;
  energy::EvaluatorFactory make_evaluator = energy::make_reference_evaluator;
  std::function<std::vector<double>(const std::vector<Eigen::Vector3d>&)> on_distances{};
  std::function<double(const Map&, int)> on_overlap{};
  std::function<Map(const Map&)> on_finished{};
};

/// Signed distances from the unit sphere.
inline std::vector<double> from_unit_sphere(const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> distances;
  for (const auto& x : points) distances.push_back(x.norm() - 1);
  return distances;
}

}  // namespace qjulia::test

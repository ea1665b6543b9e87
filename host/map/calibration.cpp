#include <algorithm>
#include <cmath>

#include "map/sphere_directions.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {

using namespace map;
namespace {

constexpr std::size_t kDirections = 4096;

/// Along each ray from the origin a step with F_1 below the level at its start and not at its end.
struct Bracket {
  std::vector<double> low;
  std::vector<double> high;
};

Bracket first_crossings(const Field& field, const std::vector<Quaternion>& directions, double level,
                        double limit) {
  constexpr int kSteps = 128;
  Bracket bracket{std::vector(directions.size(), limit), std::vector(directions.size(), limit)};
  std::vector<std::size_t> open(directions.size());
  for (std::size_t i = 0; i < open.size(); ++i) open[i] = i;
  std::vector<Quaternion> points;
  for (int step = 0; step <= kSteps && !open.empty(); ++step) {
    const double radius = limit * step / kSteps;
    points.clear();
    for (const std::size_t i : open) points.push_back(radius * directions[i]);
    const std::vector<double> values = field.at(points);
    std::vector<std::size_t> still_open;
    for (std::size_t j = 0; j < open.size(); ++j) {
      const std::size_t i = open[j];
      if (values[j] < level) {
        still_open.push_back(i);
      } else {
        bracket.low[i] = limit * std::max(step - 1, 0) / kSteps;
        bracket.high[i] = radius;
      }
    }
    open = std::move(still_open);
  }
  return bracket;
}

}  // namespace

double effective_radius(const Field& field, double level, double limit) {
  const std::vector<Quaternion> directions = sphere_directions(kDirections);
  Bracket bracket = first_crossings(field, directions, level, limit);
  constexpr int kBisections = 24;
  std::vector<Quaternion> points(directions.size());
  for (int step = 0; step < kBisections; ++step) {
    const auto middle = [&](std::size_t i) { return 0.5 * (bracket.low[i] + bracket.high[i]); };
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = middle(i) * directions[i];
    const std::vector<double> values = field.at(points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      (values[i] < level ? bracket.low : bracket.high)[i] = middle(i);
    }
  }
  std::vector<double>& radii = bracket.high;
  const auto half = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2);
  std::ranges::nth_element(radii, half);
  return 0.5 * (*half + *std::max_element(radii.begin(), half));
}

Map calibrated(const Device& device, const Map& map) {
  map.validate();
  // Nothing of a shape lies beyond the diagonal of a cube of its longest side.
  const double limit = kMapSide * std::sqrt(3.0);
  const double radius =
      effective_radius(Field(device, without_portals(map)), map.dynamics.surface_level, limit);
  if (!(radius > 1e-6 * limit)) {
    throw InputError("the map cannot be calibrated: its origin is not inside the fitted shape");
  }
  Map result = map;
  result.dynamics.log_scale += std::log(radius) - map.dynamics.surface_level;
  result.dynamics.surface_level = std::log(radius);
  return result;
}

}  // namespace qjulia

#include "qjulia/map/map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "base/range_check.hpp"
#include "map/checks.hpp"
#include "map/kinds.hpp"
#include "map/portals.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {
namespace {

// Squares of numbers up to this are finite in single precision.
constexpr double kLargest = 1e15;
// Map coordinates: fourth powers of distances between them are, as those of orbits' points.
constexpr double kLargestCoordinate = kLargestEscape;

void check_number(double value, const std::string& name, double most = kLargest) {
  if (std::abs(value) <= most) return;
  throw InputError(
      fmt::format("the map's {} is {}: it must be a finite number within ±{}", name, value, most));
}

void check_quaternion(const Quaternion& q, const std::string& name, double most = kLargest) {
  for (const double value : coordinates(q)) check_number(value, name, most);
}

void check_vector(const Eigen::Vector3d& v, const std::string& name) {
  for (const double value : v) check_number(value, name);
}

void check_positive(double value, const std::string& name) {
  check_number(value, name);
  if (value > 0) return;
  throw InputError(fmt::format("the map's {} is {}: it must be positive", name, value));
}

using map::Overloaded;

/// A file holds one number of each name.
void check_members(const Map& map) {
  std::map<std::string, Quaternion> seen;
  const auto check_one = [&](const char* name, const Quaternion& value) {
    check_quaternion(value, name, kLargestCoordinate);
    if (seen.emplace(name, value).first->second == value) return;
    throw InputError(fmt::format("the map's {} differs between its modulus and its versor", name));
  };
  const auto validate = [](const auto& kind) {
    if constexpr (requires { kind.validate(); }) kind.validate();
  };
  std::visit(validate, map.dynamics.modulus);
  std::visit(validate, map.dynamics.versor);
  map::visit_map_members(map,
                         Overloaded{check_one, [](const char* /*name*/, const auto& /*kind*/) {}});
}

void check_dynamics(const Map& map) {
  const Dynamics& dynamics = map.dynamics;
  if (dynamics.factors.empty() && map::takes_factors(map)) {
    throw InputError("the map has no factors: it needs at least one");
  }
  if (!dynamics.factors.empty() && !map::takes_factors(map)) {
    throw InputError(fmt::format("the map has factors: a {} map has none", dynamics.kind()));
  }
  check_members(map);
  check_number(dynamics.slice, "slice", kLargestCoordinate);
  check_number(dynamics.log_scale, "log_scale");
  check_number(dynamics.surface_level, "surface_level");
  check_quaternion(dynamics.phase, "phase");
  constexpr double kUnitTolerance = 1e-6;
  if (std::abs(norm(dynamics.phase) - 1) > kUnitTolerance) {
    throw InputError(fmt::format(
        "the map's phase has norm {}: it must be a unit quaternion; divide it by its norm",
        norm(dynamics.phase)));
  }
  for (std::size_t k = 0; k < dynamics.factors.size(); ++k) {
    const Factor& factor = dynamics.factors[k];
    check_quaternion(factor.center, fmt::format("factors[{}].center", k), kLargestCoordinate);
    check_number(factor.exponent, fmt::format("factors[{}].exponent", k));
  }
}

void check_layers(const Layers& layers) {
  map::check_within("steepness", layers.steepness, 1, kMostSteepness);
  map::check_portals(layers.portals);
  if (layers.paint) layers.paint->validate();
}

void check_frame(const Frame& frame) {
  const ShapeToMap& to_map = frame.shape_to_map;
  check_positive(to_map.scale, "shape_to_map.scale");
  if (to_map.scale < 1 / kLargest) {
    throw InputError(fmt::format("the map's shape_to_map.scale is {}: it must be at least {}",
                                 to_map.scale, 1 / kLargest));
  }
  check_vector(to_map.translation, "shape_to_map.translation");
  if (frame.detail) check_positive(*frame.detail, "detail");
  if (frame.diagonal) check_positive(*frame.diagonal, "diagonal");
  if (frame.inradius) check_positive(*frame.inradius, "inradius");
  if (!frame.box) return;
  check_vector(frame.box->low, "box[0]");
  check_vector(frame.box->high, "box[1]");
  if ((frame.box->size().array() < 0).any() || frame.box->diagonal() <= 0) {
    throw InputError("the map's box is empty: its second corner must lie above its first");
  }
}

}  // namespace

double Dynamics::degree() const {
  return std::visit([this](const auto& kind) { return kind.degree(*this); }, modulus);
}

bool Dynamics::is_rational() const {
  return std::holds_alternative<FactorsModulus>(modulus) &&
         std::holds_alternative<FactorsVersor>(versor);
}

std::string Dynamics::kind() const {
  if (is_rational()) return "rational";
  const std::string of_modulus = map::name_of(modulus), of_versor = map::name_of(versor);
  return of_modulus == of_versor ? of_modulus : of_modulus + '/' + of_versor;
}

Map without_portals(Map map) {
  map.layers.portals.clear();
  return map;
}

Map without_paint(Map map) {
  map.layers.paint.reset();
  return map;
}

Map quadratic_map(const Quaternion& c) {
  Map map;
  map.dynamics.modulus = QuadraticModulus{c};
  map.dynamics.versor = QuadraticVersor{c};
  return map;
}

void Map::validate() const {
  check_dynamics(*this);
  check_layers(layers);
  check_frame(frame);
  if (!provenance.json().is_object()) {
    throw InputError("the map's provenance must be a JSON object");
  }
}

double longest_side(const Map& map) {
  map.validate();
  if (!map.frame.box) throw InputError("the map does not hold the size of its shape");
  return std::min(map.frame.box->size().maxCoeff(), kMapSide / map.frame.shape_to_map.scale);
}

Map with_longest_side(Map map, double length) {
  base::expect_positive("length", length);
  const double factor = length / longest_side(map);
  map.frame.box = Box{factor * map.frame.box->low, factor * map.frame.box->high};
  if (map.frame.inradius) *map.frame.inradius *= factor;
  if (map.frame.diagonal) *map.frame.diagonal *= factor;
  map.frame.shape_to_map.scale /= factor;
  map.validate();  // a map has no room for every length
  return map;
}

}  // namespace qjulia

#include "qjulia/rational_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "base/range_check.hpp"
#include "map/checks.hpp"
#include "map/kinds.hpp"
#include "map/portals.hpp"
#include "qjulia/field.hpp"

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
void check_members(const RationalMap& map) {
  std::map<std::string, Quaternion> seen;
  const auto check_one = [&](const char* name, const Quaternion& value) {
    check_quaternion(value, name, kLargestCoordinate);
    if (seen.emplace(name, value).first->second == value) return;
    throw InputError(fmt::format("the map's {} differs between its modulus and its versor", name));
  };
  map::visit_map_members(
      map, Overloaded{check_one, [](const char* /*name*/, const auto& kind) { kind.validate(); }});
}

}  // namespace

double RationalMap::degree() const {
  return std::visit([this](const auto& kind) { return kind.degree(*this); }, modulus);
}

bool RationalMap::is_rational() const {
  return std::holds_alternative<FactorsModulus>(modulus) &&
         std::holds_alternative<FactorsVersor>(versor);
}

std::string RationalMap::kind() const {
  if (is_rational()) return "rational";
  const std::string of_modulus = map::name_of(modulus), of_versor = map::name_of(versor);
  return of_modulus == of_versor ? of_modulus : of_modulus + '/' + of_versor;
}

RationalMap without_portals(RationalMap map) {
  map.portals.clear();
  return map;
}

RationalMap without_paint(RationalMap map) {
  map.paint.reset();
  return map;
}

RationalMap quadratic_map(const Quaternion& c) {
  RationalMap map;
  map.modulus = QuadraticModulus{c};
  map.versor = QuadraticVersor{c};
  return map;
}

void RationalMap::validate() const {
  if (factors.empty() && map::takes_factors(*this)) {
    throw InputError("the map has no factors: it needs at least one");
  }
  if (!factors.empty() && !map::takes_factors(*this)) {
    throw InputError(fmt::format("the map has factors: a {} map has none", kind()));
  }
  check_members(*this);
  check_number(slice, "slice", kLargestCoordinate);
  check_number(log_scale, "log_scale");
  check_number(surface_level, "surface_level");
  map::check_within("steepness", steepness, 1, kMostSteepness);
  map::check_portals(portals);
  if (paint) paint->validate();
  check_quaternion(phase, "phase");
  constexpr double kUnitTolerance = 1e-6;
  if (std::abs(norm(phase) - 1) > kUnitTolerance) {
    throw InputError(fmt::format(
        "the map's phase has norm {}: it must be a unit quaternion; divide it by its norm",
        norm(phase)));
  }
  for (std::size_t k = 0; k < factors.size(); ++k) {
    check_quaternion(factors[k].center, fmt::format("factors[{}].center", k), kLargestCoordinate);
    check_number(factors[k].exponent, fmt::format("factors[{}].exponent", k));
  }
  check_positive(shape_to_map.scale, "shape_to_map.scale");
  if (shape_to_map.scale < 1 / kLargest) {
    throw InputError(fmt::format("the map's shape_to_map.scale is {}: it must be at least {}",
                                 shape_to_map.scale, 1 / kLargest));
  }
  check_vector(shape_to_map.translation, "shape_to_map.translation");
  if (detail) check_positive(*detail, "detail");
  if (inradius) check_positive(*inradius, "inradius");
  if (!provenance.json().is_object())
    throw InputError("the map's provenance must be a JSON object");
  if (box) {
    check_vector(box->low, "box[0]");
    check_vector(box->high, "box[1]");
    if ((box->size().array() < 0).any() || box->diagonal() <= 0) {
      throw InputError("the map's box is empty: its second corner must lie above its first");
    }
  }
}

double longest_side(const RationalMap& map) {
  map.validate();
  if (!map.box) throw InputError("the map does not hold the size of its shape");
  return std::min(map.box->size().maxCoeff(), kMapSide / map.shape_to_map.scale);
}

RationalMap with_longest_side(RationalMap map, double length) {
  base::expect_positive("length", length);
  const double factor = length / longest_side(map);
  map.box = Box{factor * map.box->low, factor * map.box->high};
  if (map.inradius) *map.inradius *= factor;
  map.shape_to_map.scale /= factor;
  return map;
}

}  // namespace qjulia

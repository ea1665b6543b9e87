#pragma once
/// What is done alike with every kind of modulus and versor.

#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "qjulia/map/map.hpp"

namespace qjulia::map {

/// A visitor made of several functions.
template <class... Functions>
struct Overloaded : Functions... {
  using Functions::operator()...;
};
template <class... Functions>
Overloaded(Functions...) -> Overloaded<Functions...>;

/// The name of a modulus' or a versor's kind.
template <class Kinds>
std::string name_of(const Kinds& kinds) {
  return std::visit([](const auto& kind) -> std::string { return kind.kName; }, kinds);
}

/// Whether the modulus or the versor is made of the map's factors.
inline bool takes_factors(const Map& map) {
  const auto takes = [](const auto& kind) { return kind.kTakesFactors; };
  return std::visit(takes, map.dynamics.modulus) || std::visit(takes, map.dynamics.versor);
}

/// The kind of that name; none where there is no such kind.
template <class Kinds, std::size_t kIndex = 0>
std::optional<Kinds> kind_named(std::string_view name) {
  if constexpr (kIndex < std::variant_size_v<Kinds>) {
    using Kind = std::variant_alternative_t<kIndex, Kinds>;
    return name == Kind::kName ? Kind{} : kind_named<Kinds, kIndex + 1>(name);
  } else {
    return {};
  }
}

/// Calls `visit(name, member)` for each member of a modulus or versor.
template <class Kinds, class Visit>
void visit_members(Kinds& kinds, const Visit& visit) {
  std::visit([&](auto& kind) { kind.members(kind, visit); }, kinds);
}

/// Visits the members of a map's modulus and versor.
template <class AnyMap, class Visit>
void visit_map_members(AnyMap& map, const Visit& visit) {
  visit_members(map.dynamics.modulus, visit);
  visit_members(map.dynamics.versor, visit);
}

}  // namespace qjulia::map

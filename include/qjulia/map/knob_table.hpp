#pragma once
/// Every knob, described: options of commands, sweeps, requests, pages, provenance and the
/// reference come from this table.

#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "qjulia/base/setting.hpp"
#include "qjulia/map/knobs.hpp"

namespace qjulia {

struct Knob : SettingOf<MapKnobs> {
  /// Why the map does not bear the knob; empty where it does.
  std::function<std::string(const Map&)> why_not = [](const Map&) { return std::string(); };
  /// The largest value that this map bears.
  std::function<double(const Map&)> most_of = [](const Map&) {
    return std::numeric_limits<double>::infinity();
  };

  bool is_turned(MapKnobs knobs) const;
};

/// In the order in which `with_knobs` turns them.
std::span<const Knob> knob_table();

/// The knob whose member of the struct has this name. @throws InputError where there is none.
const Knob& knob_named(std::string_view name);

/// The knobs as the map has them: turned so, they change nothing. Without `order_seed`.
MapKnobs knobs_of(const Map& map);

}  // namespace qjulia

#pragma once
/// Values of settings as JSON, for provenance, reports and the keys of checkpoints.

#include <nlohmann/json.hpp>

#include "qjulia/base/setting.hpp"

namespace qjulia::base {

nlohmann::json value_json(const Box& box);          ///< low and high corner
nlohmann::json value_json(const Palette& palette);  ///< the stops

/// The value as users give it: a number, a word, true or false, an array of numbers; of a palette
/// its stops. An optional value that is left out is null, or the setting's word for it.
nlohmann::json value_json(const Setting& setting, const ValuePlace& place);

/// Adds a member for each setting of a table.
template <class Table, class Options>
void add_json(nlohmann::json& json, const Table& table, Options options) {
  for (const auto& setting : table) {
    json[setting.name] = value_json(setting, setting.place(options));
  }
}

}  // namespace qjulia::base

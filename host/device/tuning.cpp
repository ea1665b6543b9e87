#include "qjulia/device/tuning.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

struct TuningSetting {
  const char* name;
  int Tuning::*value;
  int most;
};

/// Far above anything sensible, and low enough for memory and 32-bit counts.
constexpr std::array<TuningSetting, 8> kSettings{{{"lane_width", &Tuning::lane_width, 16},
                                                  {"energy_vectors", &Tuning::energy_vectors, 4096},
                                                  {"gradient_rows", &Tuning::gradient_rows, 65536},
                                                  {"orbit_items", &Tuning::orbit_items, 1 << 20},
                                                  {"orbit_group", &Tuning::orbit_group, 256},
                                                  {"panel_samples", &Tuning::panel_samples, 16384},
                                                  {"panel_block", &Tuning::panel_block, 16384},
                                                  {"product_side", &Tuning::product_side, 16}}};

}  // namespace

void Tuning::validate() const {
  for (const TuningSetting& s : kSettings) {
    if (this->*s.value >= 1 && this->*s.value <= s.most) continue;
    throw InputError(fmt::format("{} is {}, but must be 1 to {}", s.name, this->*s.value, s.most));
  }
  if (lane_width != 1 && lane_width != 8 && lane_width != 16) {
    throw InputError(fmt::format("lane width must be 1, 8 or 16, not {}", lane_width));
  }
  if (product_side != 1 && (product_side != 16 || panel_samples % 16 != 0)) {
    throw InputError(fmt::format(
        "product_side must be 1, or 16 with a multiple of 16 panel_samples, not {}", product_side));
  }
  if (panel_samples % panel_block != 0) {
    throw InputError(fmt::format("panel_samples ({}) must be a multiple of panel_block ({})",
                                 panel_samples, panel_block));
  }
}

nlohmann::json to_json(const Tuning& tuning) {
  nlohmann::json json = nlohmann::json::object();
  for (const TuningSetting& s : kSettings) json[s.name] = tuning.*s.value;
  return json;
}

Tuning tuning_from(const nlohmann::json& json) {
  if (!json.is_object() || json.size() != kSettings.size()) {
    throw InputError("the settings are not those of this program");
  }
  Tuning tuning;
  for (const TuningSetting& s : kSettings) {
    const auto found = json.find(s.name);
    if (found == json.end() || !found->is_number_integer()) {
      throw InputError(fmt::format("{} is missing, or no whole number", s.name));
    }
    // Out of an int's range is out of every setting's.
    const auto value = found->get<std::int64_t>();
    tuning.*s.value = value > 0 && value <= s.most ? static_cast<int>(value) : 0;
  }
  tuning.validate();
  return tuning;
}

}  // namespace qjulia

#include <fmt/format.h>

#include <algorithm>

#include "base/range_check.hpp"
#include "picture/environment.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/light.hpp"

namespace qjulia {
namespace {

LightColor kelvin(double value) { return {value, Rgb::Ones()}; }

}  // namespace

Rig rig_named(RigName name) {
  switch (name) {
    case RigName::studio:
      return {.lamps = {{-61.7, 41.4, 1, kelvin(5500), 3}, {128.7, 22.6, 0.44, kelvin(7500), 9}}};
    case RigName::rim:  // two from behind draw the outline
      return {.lamps = {{138, 34, 4.2, kelvin(5200), 6},
                        {-134, 30, 3.4, kelvin(8500), 6},
                        {-25, 30, 0.12, kelvin(6500), 12}},
              .fill = 0.1,
              .fill_color = kelvin(8000),
              .wall = 0.02};
    case RigName::low_key:  // one large lamp from the side; the rest is nearly dark
      return {.lamps = {{-74, 38, 1.5, kelvin(5000), 8}, {140, 18, 0.6, kelvin(9000), 6}},
              .fill = 0.12,
              .fill_color = kelvin(8000),
              .wall = 0.06};
    case RigName::noon:  // a small, high sun, and a blue sky
      return {
          .lamps = {{-35, 66, 1.6, kelvin(5800), 0.5}}, .fill = 0.8, .fill_color = kelvin(9000)};
    case RigName::dusk:  // the last sun, and a darker sky
      return {.lamps = {{-74, 12, 1.9, kelvin(3000), 1.5}},
              .fill = 0.5,
              .fill_color = kelvin(9500),
              .wall = 0.7};
    case RigName::museum:  // spots from above, before a dim wall
      return {.lamps = {{-42, 52, 0.95, kelvin(5200), 7},
                        {48, 46, 0.5, kelvin(4900), 7},
                        {165, 38, 0.8, kelvin(6000), 6}},
              .fill = 0.35,
              .fill_color = kelvin(6200),
              .wall = 0.3};
  }
  return {};
}

Rig Lighting::whole() const {
  Rig made = environment.empty() ? rig_named(rig) : Rig{};
  made.lamps.resize(std::max(made.lamps.size(), lamps.size()));
  std::ranges::copy(lamps, made.lamps.begin());
  std::erase_if(made.lamps, [](const Lamp& lamp) { return lamp.strength == 0; });
  made.fill = fill.value_or(made.fill);
  made.fill_color = fill_color.value_or(made.fill_color);
  return made;
}

void Lighting::validate() const {
  if (lamps.size() > Rig::kMostLamps) {
    throw OptionError("lamp",
                      fmt::format("{} are given; give {} at most", lamps.size(), Rig::kMostLamps));
  }
  for (const Lamp& lamp : lamps) lamp.validate();
  if (lamp_turn) base::expect_finite("lamp_turn", *lamp_turn);
  base::expect_finite("environment_turn", environment_turn);
  if (fill_color) fill_color->validate("fill_color");
  if (!environment.empty()) picture::expect_environment(environment);
}

}  // namespace qjulia

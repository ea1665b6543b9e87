/// Prints docs/reference/knobs.md: every knob of a map and every setting of a picture.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "qjulia/knob_table.hpp"
#include "qjulia/picture_settings.hpp"

namespace {

using namespace qjulia;

/// "0.001 to 0.07" where one slider sets it.
std::string slider_text(const Setting& setting) {
  if (setting.controls.size() != 1 || setting.group.empty()) return "";
  const Control& control = setting.controls.front();
  return control.words.empty() ? fmt::format("{} to {}", control.least, control.most)
                               : fmt::format("{}", fmt::join(control.words, ", "));
}

void print_setting(const Setting& setting) {
  fmt::print("### {}\n\n`--{} {}`\n\n{}.", setting.option(), setting.option(), setting.values,
             setting.help);
  if (!setting.more.empty()) fmt::print(" {}", setting.more);
  fmt::print("\n\n| range | unit | on pages | between two values |\n|---|---|---|---|\n");
  fmt::print("| {} | {} | {} | {} |\n\n", setting.range_text(), setting.unit, slider_text(setting),
             to_string(setting.interpolation));
}

/// Maps of the kinds that exist, as far as knobs care.
std::vector<Map> kinds_of_maps() {
  Map fitted;
  fitted.dynamics.factors = {{{}, 2}};
  fitted.frame.detail = 0.02;
  fitted.frame.inradius = 1;
  Map exact = fitted;
  exact.dynamics.modulus = DistanceModulus{};
  Map noise = exact;
  noise.dynamics.factors.clear();
  noise.dynamics.versor = NoiseVersor{};
  return {fitted, exact, noise, quadratic_map({})};
}

void print_bearing() {
  fmt::print(
      "## Which maps bear which knobs\n\nWhere a map does not bear a knob, commands say why and "
      "pages leave it out.\n\n| knob | fitted | exact | exact, of noise | quadratic |\n"
      "|---|---|---|---|---|\n");
  for (const Knob& knob : knob_table()) {
    fmt::print("| {} |", knob.option());
    for (const Map& map : kinds_of_maps()) {
      fmt::print(" {} |", knob.why_not(map).empty() ? "yes" : "");
    }
    fmt::print("\n");
  }
}

}  // namespace

int main() {
  fmt::print(
      "# Knobs of maps and settings of pictures\n\nThis page is made from the tables in "
      "`include/qjulia/knob_table.hpp` and `picture_settings.hpp`, from which options, sweeps, "
      "provenance, and the controls of pages come as well. `cmake --build --preset release "
      "--target reference` makes it again.\n\n## Knobs of a map\n\nThey are turned in this order; "
      "the two that move the origin of iteration are one move.\n\n");
  for (const Knob& knob : knob_table()) print_setting(knob);
  fmt::print("## Settings of a picture\n\n");
  for (const PictureSetting& setting : picture_settings()) print_setting(setting);
  print_bearing();
  return 0;
}

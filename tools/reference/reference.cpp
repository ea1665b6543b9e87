/// Prints pages of docs/reference: knobs.md, every knob of a map and every setting of a picture,
/// and with the argument `files` file-types.md, what commands read and write.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <string_view>
#include <type_traits>
#include <variant>

#include "base/file_types.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/picture/picture_settings.hpp"

namespace {

using namespace qjulia;

/// "0.001 to 0.07" where one slider sets it.
std::string slider_text(const Setting& setting) {
  if (setting.controls.size() != 1 || setting.group.empty()) return "";
  const Control& control = setting.controls.front();
  const std::vector<std::string>& words = control.words.empty() ? setting.words : control.words;
  return words.empty() ? fmt::format("{} to {}", control.least, control.most)
                       : fmt::format("{}", fmt::join(words, ", "));
}

/// Whether a setting's value is a number or several, for which it has a range.
bool has_numbers(const ValuePlace& place) {
  const auto is_number = []<class Value>(const Value& /*value*/) {
    return std::is_same_v<Value, int*> || std::is_same_v<Value, std::uint64_t*> ||
           std::is_same_v<Value, double*> || std::is_same_v<Value, std::optional<int>*> ||
           std::is_same_v<Value, std::optional<std::uint64_t>*> ||
           std::is_same_v<Value, std::optional<double>*> ||
           std::is_same_v<Value, std::optional<Eigen::Vector3d>*> ||
           std::is_same_v<Value, DetailChoice*>;
  };
  return std::visit(is_number, place);
}

/// @param place of the usual value.
void print_setting(const Setting& setting, const ValuePlace& place) {
  std::string spelling = "--" + option_of(setting, place);
  if (const std::string values = setting.values_text(); !values.empty()) spelling += ' ' + values;
  const bool is_on = spelling.starts_with("--no-");
  fmt::print("### {}\n\n`{}`\n\n{}{}.", setting.option(), spelling,
             is_on ? "It is on, and this option turns it off. " : "", setting.help);
  if (!setting.left_out.empty()) fmt::print(" Default: {}.", setting.left_out);
  if (!setting.more.empty()) fmt::print(" {}", setting.more);
  fmt::print("\n\n| range | unit | on pages | between two values |\n|---|---|---|---|\n");
  fmt::print("| {} | {} | {} | {} |\n\n", has_numbers(place) ? setting.range_text() : "",
             setting.unit, slider_text(setting), to_string(setting.interpolation));
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

void print_file_types() {
  fmt::print(
      "# File types\n\nA file's type is known by its extension. This page is made from the table "
      "in "
      "`host/base/file_types.cpp`; `cmake --build --preset release --target reference` makes it "
      "again. [map-format.md](map-format.md) describes the map file, [batch.md](../guide/batch.md) "
      "the manifest.\n\n| contents | read | written |\n|---|---|---|\n");
  constexpr std::array kContents = {
      base::FileContent::mesh,         base::FileContent::map,
      base::FileContent::original_map, base::FileContent::sampled_distance,
      base::FileContent::picture,      base::FileContent::field,
      base::FileContent::volume,       base::FileContent::manifest,
      base::FileContent::report,       base::FileContent::formula};
  for (const base::FileContent content : kContents) {
    fmt::print("| {} | {} | {} |\n", to_string(content),
               fmt::join(base::extensions(content, base::FileUse::read), ", "),
               fmt::join(base::extensions(content, base::FileUse::write), ", "));
  }
}

void print_knobs() {
  fmt::print(
      "# Knobs of maps and settings of pictures\n\nThis page is made from the tables in "
      "`include/qjulia/map/knob_table.hpp` and `picture_settings.hpp`, from which options, sweeps, "
      "provenance, and the controls of pages come as well. `cmake --build --preset release "
      "--target reference` makes it again.\n\n## Knobs of a map\n\nThey are turned in this order; "
      "the two that move the origin of iteration are one move.\n\n");
  MapKnobs knobs;
  for (const Knob& knob : knob_table()) print_setting(knob, knob.place(knobs));
  fmt::print("## Settings of a picture\n\n");
  PictureOptions picture;
  for (const PictureSetting& setting : picture_settings()) {
    print_setting(setting, setting.place(picture));
  }
  print_bearing();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && argv[1] == std::string_view("files")) {
    print_file_types();
  } else {
    print_knobs();
  }
  return 0;
}

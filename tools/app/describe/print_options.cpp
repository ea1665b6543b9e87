#include "describe/print_options.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "base/setting_json.hpp"
#include "describe/options.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/surface/print_settings.hpp"

namespace qjulia::tools {
namespace {

/// What became of the triangles, as a line.
std::string decimation_text(const DecimationReport& report, bool is_measured) {
  const auto from_to = [&] {
    return fmt::format("\ndecimated from {} to {} triangles", report.before, report.after);
  };
  const std::string apart =
      is_measured ? fmt::format("; at most {:.3g} lies between mesh and result", report.farthest)
                  : "";
  switch (report.end) {
    case DecimationEnd::none:
      return fmt::format("\nnot decimated: {} triangles are no more than --max-triangles",
                         report.before);
    case DecimationEnd::number:
      return from_to() + ", which --max-triangles ended" + apart;
    case DecimationEnd::error:
      if (report.after == report.before) {
        return fmt::format(
            "\nnot decimated: none of the {} triangles can be left out within "
            "--max-error",
            report.before);
      }
      return from_to() + ", which --max-error ended" + apart;
    case DecimationEnd::folds:
      return from_to() + ", where any further step would fold the surface";
  }
  return {};
}

/// What ended the decimation, as options name it.
const char* ended_by(DecimationEnd end) {
  switch (end) {
    case DecimationEnd::none:
      return "none";
    case DecimationEnd::number:
      return "max_triangles";
    case DecimationEnd::error:
      return "max_error";
    case DecimationEnd::folds:
      return "folds";
  }
  return "";
}

}  // namespace

void add_print_options(Command command, PrintOptions& options, const Option& millimetres,
                       const Option& metres) {
  std::map<std::string, Option> added;
  for (const auto& setting : print_settings()) {
    const Option option = add_setting(command, setting, setting.place(options));
    if (setting.values == "LENGTH" && setting.name != "drain") option.excludes({metres});
    added.emplace(setting.name, option);
  }
  added.at("height").excludes({millimetres});
  added.at("longest").excludes({millimetres, added.at("height")});
  added.at("drain").needs(added.at("shell"));
}

nlohmann::json print_json(const PrintOptions& options) {
  nlohmann::json json = nlohmann::json::object();
  PrintOptions read = options;
  for (const auto& setting : print_settings()) {
    if (setting.name == "drain" && !options.shell) continue;
    const nlohmann::json value = base::value_json(setting, setting.place(read));
    if (!value.is_null()) json[setting.name] = value;
  }
  return json;
}

std::string print_text(const PrintReport& report, const PrintOptions& options) {
  std::string text;
  if (options.min_wall) {
    text += fmt::format(
        "\nwalls: the thinnest 1 % of the surface was under {:.3g} and is under {:.3g} now",
        report.thinnest_before, report.thinnest);
  }
  if (options.min_wall || options.flat_foot || options.shell) {
    text += fmt::format("\nvolume: {:.6g}, which is {:+.2f} %", report.printed_volume,
                        100 * (report.printed_volume / report.volume - 1));
  }
  if (options.shell) text += fmt::format("\ncavity: {:.4g}", report.cavity);
  if (report.decimation) text += decimation_text(*report.decimation, options.max_error.has_value());
  return text + left_out_text(report.loose, "\n");
}

nlohmann::json print_json(const PrintReport& report, const PrintOptions& options) {
  nlohmann::json json{{"scale", report.scale},
                      {"volume_before", report.volume},
                      {"volume", report.printed_volume},
                      {"volume_change", report.printed_volume / report.volume - 1}};
  if (options.min_wall) {
    json["thinnest_wall_before"] = report.thinnest_before;
    json["thinnest_wall"] = report.thinnest;
  }
  if (options.shell) json["cavity"] = report.cavity;
  if (report.decimation) {
    nlohmann::json& decimation = json["decimation"];
    decimation = {{"triangles_before", report.decimation->before},
                  {"triangles", report.decimation->after},
                  {"ended_by", ended_by(report.decimation->end)}};
    if (options.max_error) decimation["farthest"] = report.decimation->farthest;
  }
  json["loose_pieces"] = report.loose.count;
  json["loose_volume"] = report.loose.volume;
  return json;
}

}  // namespace qjulia::tools

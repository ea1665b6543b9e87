#include "print_options.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "options.hpp"

namespace qjulia::tools {
namespace {

constexpr double kShortest = 1e-6, kLongest = 1e9;

/// Calls `use(name, value)` for lengths that are given, as the command names them.
template <class Use>
void for_given(const PrintOptions& options, const Use& use) {
  const std::initializer_list<std::pair<const char*, const std::optional<double>&>> lengths{
      {"height", options.height},       {"longest", options.longest},
      {"max_error", options.max_error}, {"min_wall", options.min_wall},
      {"flat_foot", options.flat_foot}, {"shell", options.shell}};
  for (const auto& [name, value] : lengths) {
    if (value) use(name, *value);
  }
}

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
  const auto length = [&](const char* name, std::optional<double>& target, const char* text) {
    return command.add(name, &target, "LENGTH", text).range(kShortest, kLongest).excludes({metres});
  };
  const Option height = length("--height", options.height,
                               "Scale the mesh to this height along its up axis, in millimetres")
                            .excludes({millimetres});
  length("--longest", options.longest,
         "Scale the mesh so that the longest side of its box has this length, in millimetres")
      .excludes({millimetres, height});
  command
      .add("--max-triangles", &options.max_triangles, "INT",
           "Decimate the mesh to at most this number of triangles, edge by edge, the flattest "
           "places first")
      .range(4, 1e9);
  length(
      "--max-error", options.max_error,
      "Decimate the mesh as long as the result and the mesh stay within this distance of each "
      "other, in millimetres if the mesh has a size in millimetres, else in the shape's units; "
      "with --max-triangles, until the first of the two limits is reached. The summary says which "
      "one ended it, and the farthest distance that was measured");
  length("--min-wall", options.min_wall,
         "Thicken walls that are thinner than this, until at most a hundredth of the surface has "
         "thinner ones, as 'info --printable' measures them. This rounds edges");
  length("--flat-foot", options.flat_foot,
         "Cut this length off the lower end, flat, so that the print stands");
  const Option shell = length("--shell", options.shell,
                              "Hollow the mesh out, with a wall of this thickness, and drain it");
  command
      .add("--drain", &options.drain, "LENGTH",
           "Diameter of the hole from the cavity's lowest place straight down; 0 for none")
      .range(0, kLongest)
      .needs(shell);
}

nlohmann::json print_json(const PrintOptions& options) {
  nlohmann::json json = nlohmann::json::object();
  for_given(options, [&](const char* name, double value) { json[name] = value; });
  if (options.max_triangles) json["max_triangles"] = *options.max_triangles;
  if (options.shell) json["drain"] = options.drain;
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

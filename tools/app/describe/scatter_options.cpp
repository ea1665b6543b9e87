#include "describe/scatter_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

const std::map<std::string, ScatterField>& scatter_fields() {
  static const std::map<std::string, ScatterField> all{{"outward", ScatterField::outward},
                                                       {"wind", ScatterField::wind},
                                                       {"gravity", ScatterField::gravity}};
  return all;
}

}  // namespace

ScatterOptions Scatter::chosen() const {
  ScatterOptions all = options;
  if (field) all.field = *field;
  return all;
}

nlohmann::json to_json(const Scatter& scatter) {
  nlohmann::json json{{"scatter", nullptr},
                      {"scatter_seconds", scatter.options.seconds},
                      {"scatter_distance", scatter.options.distance},
                      {"scatter_seed", scatter.options.seed}};
  for (const auto& [word, field] : scatter_fields()) {
    if (scatter.field == field) json["scatter"] = word;
  }
  return json;
}

Option add_scatter(Command command, Scatter& scatter, const std::string& help) {
  std::vector<std::string> fields;
  for (const auto& [word, field] : scatter_fields()) fields.push_back(word);
  Option chosen = command
                      .word(
                          "--scatter", fmt::format("{}", fmt::join(fields, "|")),
                          [&scatter](const std::string& word) {
                            const auto found = scatter_fields().find(word);
                            if (found == scatter_fields().end()) {
                              throw InputError("'" + word +
                                               "' is no way to fly; give outward, wind or gravity");
                            }
                            scatter.field = found->second;
                          },
                          help)
                      .offers(fields);
  command.add("--scatter-seconds", &scatter.options.seconds, "SECONDS", "How long the flight lasts")
      .range(0.1, 600)
      .needs(chosen);
  command
      .add("--scatter-distance", &scatter.options.distance, "TIMES",
           "How far parts fly by the end, in longest sides of the mesh; what falls ends on the "
           "floor")
      .range(0, 100)
      .needs(chosen);
  command
      .add("--scatter-seed", &scatter.options.seed, "SEED",
           "Seed of when parts set off, how far they fly and how they turn")
      .needs(chosen);
  return chosen;
}

}  // namespace qjulia::tools

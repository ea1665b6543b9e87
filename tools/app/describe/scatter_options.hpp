#pragma once
/// How a set's connected parts fly: of meshes that move, and of pictures.

#include <nlohmann/json.hpp>
#include <optional>

#include "describe/command_line.hpp"
#include "qjulia/mesh/moving_mesh.hpp"

namespace qjulia::tools {

struct Scatter {
  std::optional<ScatterField> field;  ///< none: nothing flies
  ScatterOptions options{};           ///< but for its field

  ScatterOptions chosen() const;
};

/// By the options' names; the field is null where nothing flies.
nlohmann::json to_json(const Scatter& scatter);

/// --scatter, --scatter-seconds, --scatter-distance, --scatter-seed. `scatter` must stay where it
/// is. @param help of --scatter. @return that option
Option add_scatter(Command command, Scatter& scatter, const std::string& help);

}  // namespace qjulia::tools

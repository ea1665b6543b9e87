#pragma once
/// How rough a set is, in words and for programs, and the options that ask for a roughness.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "jobs/session.hpp"
#include "qjulia/surface/roughness.hpp"
#include "qjulia/surface/roughness_target.hpp"

namespace qjulia::tools {

/// A table of areas by scale, and the porosity.
std::string roughness_text(const Roughness& roughness);
/// The same table for a mesh, without the porosity.
std::string scales_text(const MeshScales& scales);
std::string porosity_text(const Porosity& porosity);

/// What is asked for; null where nothing is.
nlohmann::json asked_json(const RoughnessTarget& target);

/// What the options asked for, and what came of it; both empty where they asked for nothing.
struct ReachedRoughness {
  std::string text;
  nlohmann::json json;
};

/// Gives the map the roughness that is asked for, and says so in its provenance.
/// @param mesh what areas and volumes are measured against; null: the map's smooth set.
ReachedRoughness reach_target(const Device& device, Map& map, const RoughnessTarget& target,
                              const TriangleMesh* mesh, Session& session);

}  // namespace qjulia::tools

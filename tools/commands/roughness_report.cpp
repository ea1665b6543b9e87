#include "commands/roughness_report.hpp"

#include <fmt/format.h>

#include <cmath>

#include "base/setting_json.hpp"

namespace qjulia::tools {

std::string porosity_text(const Porosity& porosity) {
  return fmt::format(
      "porosity      {:.2f} % of its outline is not filled, where no ball of radius {:.3g} fits in",
      100 * porosity.share, porosity.radius);
}

std::string roughness_text(const Roughness& roughness) {
  std::string text =
      "cells         area ratio   volume ratio   area / volume   dimension\n"
      "(smooth)           1.000          1.000";
  text += fmt::format("   {:13.5g}", roughness.smooth.area / roughness.smooth.volume);
  for (const SurfaceAtScale& scale : roughness.scales) {
    const SurfaceFigures& figures = scale.figures;
    text += fmt::format(
        "\n{:<13} {:10.3f}   {:12.4f}   {:13.5g}   {}", scale.resolution,
        figures.area / roughness.smooth.area, figures.volume / roughness.smooth.volume,
        figures.area / figures.volume,
        std::isnan(figures.dimension)
            ? "-"
            : fmt::format("{:.3f} +- {:.3f}", figures.dimension, figures.dimension_error));
  }
  return text +
         fmt::format("\narea slope    {:.3f}: the area grows as cells^{:.3f}\n",
                     roughness.area_slope, roughness.area_slope) +
         porosity_text(roughness.porosity);
}

nlohmann::json asked_json(const RoughnessTarget& target) {
  nlohmann::json asked;
  if (target.is_set()) base::add_json(asked, target_settings(), target);
  return asked;
}

ReachedRoughness reach_target(const Device& device, Map& map, const RoughnessTarget& target,
                              const TriangleMesh* mesh, Session& session) {
  if (!target.is_set()) return {};
  const TraceStage stage(session.trace(), "find the detail");
  std::optional<RoughnessReference> reference;
  if (mesh != nullptr) reference = reference_of(device, *mesh, session.stop());
  TargetedMap reached = with_roughness(device, map, target, reference, session.monitor());
  ReachedRoughness told;
  told.json = to_json(reached);
  told.json["asked"] = asked_json(target);
  map = std::move(reached.map);
  map.provenance.set("target", told.json);
  const char* const whose = mesh != nullptr ? "the mesh's" : "the smooth set's";
  told.text = fmt::format(
      "detail {:.4g}{}: {:.3f} times {} area, {:.3f} times its volume{}, at {} cells\n",
      reached.detail, reached.scale == 1 ? "" : fmt::format(", scale {:.4g}", reached.scale),
      reached.figures.area / reached.reference.area, whose,
      reached.figures.volume / reached.reference.volume,
      std::isnan(reached.figures.dimension)
          ? ""
          : fmt::format(", dimension {:.3f} +- {:.3f}", reached.figures.dimension,
                        reached.figures.dimension_error),
      target.resolution);
  return told;
}

}  // namespace qjulia::tools

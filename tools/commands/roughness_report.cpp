#include "commands/roughness_report.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "base/setting_json.hpp"

namespace qjulia::tools {
namespace {

/// @param whole what ratios are over, and `name` what the table calls it.
std::string table_of(const char* name, const SurfaceFigures& whole,
                     const std::vector<SurfaceAtScale>& scales, double area_slope) {
  std::string text = fmt::format(
      "cells         area ratio   volume ratio   area / volume   dimension\n"
      "{:<13}      1.000          1.000   {:13.5g}",
      name, whole.area / whole.volume);
  for (const SurfaceAtScale& scale : scales) {
    const SurfaceFigures& figures = scale.figures;
    text += fmt::format(
        "\n{:<13} {:10.3f}   {:12.4f}   {:13.5g}   {}", scale.resolution, figures.area / whole.area,
        figures.volume / whole.volume, figures.area / figures.volume,
        std::isnan(figures.dimension)
            ? "-"
            : fmt::format("{:.3f} +- {:.3f}", figures.dimension, figures.dimension_error));
  }
  return text + fmt::format("\narea slope    {0:.3f}: the area grows as cells^{0:.3f}", area_slope);
}

}  // namespace

std::string porosity_text(const Porosity& porosity) {
  return fmt::format(
      "porosity      {:.2f} % of its outline is not filled, where no ball of radius {:.3g} fits in",
      100 * porosity.share, porosity.radius);
}

std::string roughness_text(const Roughness& roughness) {
  return table_of("(smooth)", roughness.smooth, roughness.scales, roughness.area_slope) + "\n" +
         porosity_text(roughness.porosity);
}

std::string scales_text(const MeshScales& scales) {
  return table_of("(the mesh)", scales.whole, scales.scales, scales.area_slope);
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

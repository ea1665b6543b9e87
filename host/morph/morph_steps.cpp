#include "qjulia/morph/morph_steps.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "base/range_check.hpp"

namespace qjulia {

std::span<const SettingOf<MorphOptions>> morph_settings() {
  static const std::vector<SettingOf<MorphOptions>> all{
      {{.name = "steps",
        .values = "N",
        .least = 2,
        .most = 9999,
        .example = "4",
        .help = "How many maps to make, the first and the last included"},
       [](MorphOptions& o) -> ValuePlace { return &o.steps; }},
      {{.name = "flicker_cells",
        .values = "N",
        .least = 0,
        .most = kMostFlickerCells,
        .example = "8",
        .help = fmt::format("Cells along the longest side of the box that flicker is measured "
                            "over, {} to {}; 0 leaves it out",
                            kLeastFlickerCells, kMostFlickerCells)},
       [](MorphOptions& o) -> ValuePlace { return &o.flicker_cells; }},
  };
  return all;
}

void MorphOptions::validate() const {
  expect_in_ranges(morph_settings(), *this);
  if (flicker_cells == 0) return;
  base::expect_between("flicker_cells", flicker_cells, kLeastFlickerCells, kMostFlickerCells);
}

Flicker make_steps(const Device& device, const Morph& morph, const MorphOptions& options,
                   const std::function<void(Map map, int step)>& take,
                   const ProgressMonitor& monitor) {
  options.validate();
  std::optional<FlickerMeter> meter;
  if (options.flicker_cells > 0) meter.emplace(device, morph.box(), options.flicker_cells);
  for (int step = 1; step <= options.steps; ++step) {
    throw_if_stopped(monitor.stop);
    const double t = static_cast<double>(step - 1) / (options.steps - 1);
    Map map = morph.at(t);
    if (meter) meter->add(map, monitor.stop);
    map.provenance.set("morph", {{"t", t}, {"step", step}});
    take(std::move(map), step);
    monitor.report({"morphing", static_cast<double>(step) / options.steps, -1, ""});
  }
  return meter ? meter->flicker() : Flicker();
}

}  // namespace qjulia

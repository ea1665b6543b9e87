#include "qjulia/edit/paint_settings.hpp"

#include <vector>

namespace qjulia {

std::span<const SettingOf<PaintOptions>> paint_settings() {
  static const std::vector<SettingOf<PaintOptions>> all{
      {{.name = "thickness",
        .values = "FRACTION",
        .unit = "of the shape's own",
        .least = 0.01,
        .most = 2,
        .left_out = "no bound",
        .example = "0.15",
        .help = "Bounds the shell by this share of the shape's own thickness, 0.01 to 2: thin "
                "limbs then keep their shape, and thick parts all of the detail. 0.15 is a good "
                "value"},
       [](PaintOptions& o) -> ValuePlace { return &o.thickness; }},
      {{.name = "elsewhere",
        .values = "SHARE",
        .unit = "of the detail",
        .least = 0,
        .most = 1,
        .example = "0.5",
        .help = "The share of the detail in all other places"},
       [](PaintOptions& o) -> ValuePlace { return &o.elsewhere; }},
  };
  return all;
}

}  // namespace qjulia

#include "qjulia/edit/portal_settings.hpp"

#include <vector>

namespace qjulia {

std::span<const SettingOf<PortalOptions>> portal_settings() {
  static const std::vector<SettingOf<PortalOptions>> all{
      {{.name = "count",
        .values = "N",
        .least = 1,
        .most = 16,
        .example = "1",
        .help = "Copies on the shape itself, 1 to 16"},
       [](PortalOptions& o) -> ValuePlace { return &o.count; }},
      {{.name = "size",
        .values = "FRACTION",
        .unit = "of the shape's",
        .least = 0.02,
        .most = 0.6,
        .example = "0.25",
        .help = "Size of a copy as a fraction of the shape's, 0.02 to 0.6"},
       [](PortalOptions& o) -> ValuePlace { return &o.size; }},
      {{.name = "mask",
        .words = {"none", "outside", "inside"},
        .example = "none",
        .help = "Points of its ball that a portal takes: those outside the shape, so that the copy "
                "is added to it; those inside, so that of the shape only what lies in the copy is "
                "left; or all, so that the copy stands in place of the shape",
        .interpolation = Interpolation::none},
       [](PortalOptions& o) -> ValuePlace { return WordPlace(o.mask); }},
  };
  return all;
}

}  // namespace qjulia

#include "qjulia/surface/selection.hpp"

#include <utility>

#include "qjulia/base/error.hpp"
#include "qjulia/surface/cut_mesh.hpp"

namespace qjulia {

void Selection::validate() const {
  if (static_cast<int>(keep_loose) + static_cast<int>(largest_component) +
          static_cast<int>(min_component.has_value()) >
      1) {
    throw InputError(
        "keep_loose, largest_component and min_component exclude each other; give one of them");
  }
  expect_in_ranges(selection_settings(), *this);
  for (const Cut& cut : cuts) cut.validate();
}

std::span<const SettingOf<Selection>> selection_settings() {
  static const std::vector<SettingOf<Selection>> all{
      {{.name = "cut",
        .values = "AXIS=PLACE",
        .example = "z=90%",
        .help = "Cut away what lies beyond a place along an axis, which leaves the mesh open: a "
                "coordinate, shape units, or per cent of the shape's box; several with commas, "
                "x=0.2,z=50%",
        .interpolation = Interpolation::none},
       [](Selection& s) -> ValuePlace { return &s.cuts; }},
      {{.name = "keep_loose",
        .example = "",
        .help = "Keep all connected parts. Default: parts that enclose less than a hundredth of "
                "the largest one's volume are left out",
        .interpolation = Interpolation::none},
       [](Selection& s) -> ValuePlace { return &s.keep_loose; }},
      {{.name = "largest_component",
        .example = "",
        .help = "Leave out all but the largest connected part",
        .interpolation = Interpolation::none},
       [](Selection& s) -> ValuePlace { return &s.largest_component; }},
      {{.name = "min_component",
        .values = "FRACTION",
        .least = 0,
        .most = 1,
        .example = "0.5",
        .help = "Leave out connected parts with less than this fraction, 0 to 1, of the largest "
                "one's area"},
       [](Selection& s) -> ValuePlace { return &s.min_component; }},
  };
  return all;
}

LoosePieces select_parts(TriangleMesh& mesh, const Selection& selection) {
  selection.validate();
  mesh.validate();
  if (mesh.triangles.empty()) return {};
  if (selection.drops_loose()) return drop_loose_pieces(mesh);
  const double least = selection.largest_component ? 1 : selection.min_component.value_or(0);
  if (least > 0) mesh = large_components(mesh, least);
  return {};
}

TriangleMesh cut_open(TriangleMesh mesh, const Selection& selection,
                      const std::optional<Box>& box) {
  if (selection.cuts.empty() || mesh.triangles.empty()) return mesh;
  for (const Cut& cut : selection.cuts) mesh = cut_away(mesh, cut, box);
  if (mesh.triangles.empty()) throw OptionError("cut", "nothing is left of the set; cut less away");
  return mesh;
}

}  // namespace qjulia

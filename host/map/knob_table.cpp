#include "qjulia/map/knob_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "qjulia/map/detail.hpp"

namespace qjulia {
namespace {

bool has_grid(const Map& map) {
  return std::holds_alternative<DistanceModulus>(map.dynamics.modulus);
}

bool has_noise(const Map& map) { return std::holds_alternative<NoiseVersor>(map.dynamics.versor); }

bool has_factors_versor(const Map& map) {
  return std::holds_alternative<FactorsVersor>(map.dynamics.versor);
}

/// Whether its modulus is of factors, and its versor a noise.
bool is_factors_with_noise(const Map& map) {
  return has_noise(map) && std::holds_alternative<FactorsModulus>(map.dynamics.modulus);
}

/// Whether the origin of iteration can move: quadratic parts stay about it.
bool can_move(const Map& map) {
  return map.dynamics.is_rational() || is_factors_with_noise(map) ||
         (has_grid(map) && (has_factors_versor(map) || has_noise(map)));
}

std::string changes_factors(const Map& map) {
  return fmt::format("it changes factors, and a {} map has {}", map.dynamics.kind(),
                     map.dynamics.factors.empty() ? "none" : "more than these");
}

std::string why_no_detail(const Map& map) {
  if (!map.dynamics.is_rational() && !has_grid(map) && !is_factors_with_noise(map)) {
    return changes_factors(map);
  }
  if (map.frame.detail) return {};
  return "the map does not say its own \"detail\"; fit it again, or add that key to the file";
}

std::string why_no_order(const Map& map) {
  return map.dynamics.is_rational() || (has_grid(map) && has_factors_versor(map))
             ? ""
             : changes_factors(map);
}

std::string why_no_turn(const Map& map) {
  if (map.layers.paint) return "it turns factors, and the axes of the map's paint stay";
  return map.dynamics.is_rational() ? "" : changes_factors(map);
}

std::string why_no_move(const Map& map) { return can_move(map) ? "" : changes_factors(map); }

std::string why_no_drift(const Map& map) {
  if (!can_move(map)) return changes_factors(map);
  return map.frame.inradius ? "" : "the map does not say its \"inradius\"";
}

/// The largest detail that leaves the sum of the exponents well above 1, so that the set is
/// bounded.
double most_detail(const Map& map) {
  constexpr double kMargin = 0.97;
  return has_grid(map) ? 1
                       : kMargin * map.frame.detail.value_or(kMostDetail) * map.dynamics.degree();
}

/// Detail and the order of factors.
std::vector<Knob> knobs_of_factors() {
  return {
      {{{.name = "detail",
         .values = "WORD|FRACTION",
         .unit = "of the box's diagonal",
         .least = kLeastDetail,
         .most = kMostDetail,
         .left_out = "the map's own",
         .example = "0.03",
         .help =
             "Thickness of the fractal shell, as a fraction of the shape's box diagonal: thicker "
             "is wilder",
         .more =
             "The exponents, or the grid's slope, are scaled so that the field rises by 1 over "
             "this distance. The shape at one iteration stays. At 0.005 the set has but a grain, "
             "at 0.02 a round body is clearly grooved, at 0.05 heavily, and past 0.07 it "
             "dissolves; thin limbs bear less.",
         .interpolation = Interpolation::logarithmic,
         .group = "Fractal",
         .controls = {{.name = "detail",
                       .label = "detail",
                       .help = "",
                       .least = 0.001,
                       .most = 0.07,
                       .step = 0,
                       .is_logarithmic = true}}},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.detail; }},
       why_no_detail,
       most_detail},
      {{{.name = "order_seed",
         .values = "N",
         .least = 0,
         .left_out = "the map's own",
         .example = "5",
         .help = "Shuffles the map's factors by this seed: another pattern of grooves on the same "
                 "shape",
         .more = "The modulus is a plain product and stays; the versor depends on the order.",
         .interpolation = Interpolation::none,
         .group = "Pattern",
         .controls = {{.name = "order",
                       .label = "order seed",
                       .help =
                           "Shuffles the map's factors by this seed: another pattern of grooves "
                           "on the same shape; 0 is the map's own order",
                       .least = 0,
                       .most = 999999,
                       .step = 1,
                       .is_whole = true,
                       .needs_server = true}}},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.order_seed; }},
       why_no_order},
  };
}

/// Phase and slice.
std::vector<Knob> knobs_of_images() {
  return {
      {{{.name = "phase",
         .values = "X Y Z W",
         .left_out = "the map's own",
         .example = "0.8 0.6 0 0",
         .help = "Unit quaternion in front of the map, X its real part, normalised for you: turns "
                 "the pattern of grooves and keeps the shape; vary it little by little for "
                 "animations",
         .more =
             "Every image is multiplied by it. Pages and sweeps give it by angles: cos A + sin A "
             "(i cos B + j sin B cos C + k sin B sin C).",
         .interpolation = Interpolation::rotation,
         .group = "Pattern",
         .controls = {{.name = "phase1",
                       .label = "phase",
                       .help = "First angle of the unit quaternion in front of the map, degrees: "
                               "turns the pattern of grooves and keeps the shape",
                       .least = 0,
                       .most = 180,
                       .step = 1},
                      {.name = "phase2",
                       .label = "phase, 2nd",
                       .help = "Second angle of the phase, degrees; it matters where the first is "
                               "not 0",
                       .least = 0,
                       .most = 180,
                       .step = 1},
                      {.name = "phase3",
                       .label = "phase, 3rd",
                       .help = "Third angle of the phase, degrees; it matters where the first two "
                               "are not 0",
                       .least = -180,
                       .most = 180,
                       .step = 1}}},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.phase; }}},
      {{{.name = "slice",
         .values = "W",
         .unit = "map units",
         .left_out = "the map's own",
         .example = "0.05",
         .help = "Fourth coordinate of the slice that is looked at, map units (the shape's longest "
                 "side is 3): away from 0 thin parts vanish first",
         .group = "Shape",
         .controls = {{.name = "slice",
                       .label = "slice",
                       .help = "",
                       .least = -1.5,
                       .most = 1.5,
                       .step = 0.005}}},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.slice; }}},
  };
}

/// What turns and moves the shape about the origin of iteration.
std::vector<Knob> knobs_of_origin() {
  return {
      {{{.name = "rotate",
         .values = "X Y Z DEGREES",
         .unit = "degrees",
         .example = "0 0 1 20",
         .help =
             "Turns the factors, and the shape with them, about this axis through the origin of "
             "iteration: about x, the real axis, the grooves turn along; about any other, they "
             "change",
         .group = "Shape",
         .controls = {{.name = "rotate",
                       .label = "rotate",
                       .help = "Turns the factors, and the shape with them, about an axis through "
                               "the origin of iteration, degrees",
                       .least = -180,
                       .most = 180,
                       .step = 1,
                       .needs_server = true},
                      {.name = "axis",
                       .label = "about",
                       .help =
                           "The axis: about x, the real axis, the grooves turn along; about the "
                           "others they change",
                       .words = {"x", "y", "z"}}}},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.rotate; }},
       why_no_turn},
      {{{.name = "drift",
         .values = "F",
         .unit = "inradii",
         .example = "0.1",
         .help = "Moves the origin of iteration inside the shape, along z, in inradii: grooves "
                 "deepen from 0.3 on, near 1 the set is a hollow crust, past 1.1 dust",
         .more = "The shape stays in its own coordinates, and the map is calibrated again.",
         .group = "Shape",
         .controls = {{.name = "drift",
                       .label = "drift",
                       .help = "",
                       .least = 0,
                       .most = 1.1,
                       .step = 0.01}}},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.drift; }},
       why_no_drift},
      {{{.name = "translate",
         .values = "X Y Z",
         .unit = "shape units",
         .example = "0.1 0 0",
         .help =
             "Moves the factors by this vector, shape units, and the window with them: the shape "
             "stays where it is, and iteration turns about another point of it",
         .more =
             "The origin of iteration moves the opposite way, and the map is calibrated again."},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.translate; }},
       why_no_move},
  };
}

/// What moves the level, and the slope above it.
std::vector<Knob> knobs_of_level() {
  return {
      {{{.name = "scale",
         .values = "S",
         .least = Setting::kAboveZero,
         .example = "1.1",
         .help = "Above 1 the set swells, below 1 it wears away; 1 changes nothing",
         .more = "ln S is taken from the map's log scale: the set is that of a level ln S higher.",
         .interpolation = Interpolation::logarithmic,
         .group = "Shape",
         .controls = {{.name = "scale",
                       .label = "scale",
                       .help = "",
                       .least = 0.3,
                       .most = 3,
                       .step = 0,
                       .is_logarithmic = true}}},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.scale; }}},
      {{{.name = "steepness",
         .values = "K",
         .least = 1,
         .most = kMostSteepness,
         .left_out = "the map's own",
         .example = "2",
         .help = "How many times as steep the field is outside the shape, 1 to 100: above 1 tufts "
                 "that stand off the shape are shorter, and fewer pieces come loose",
         .more = "Where F exceeds the level L, it is L + K (F - L) instead.",
         .interpolation = Interpolation::logarithmic,
         .group = "Fractal",
         .controls = {{.name = "steepness",
                       .label = "steepness",
                       .help = "",
                       .least = 1,
                       .most = kMostSteepness,
                       .step = 0,
                       .is_logarithmic = true}}},
        [](MapKnobs& knobs) -> ValuePlace { return &knobs.steepness; }}},
  };
}

std::vector<Knob> made_table() {
  std::vector<Knob> all;
  for (const auto part : {knobs_of_factors, knobs_of_images, knobs_of_origin, knobs_of_level}) {
    std::ranges::move(part(), std::back_inserter(all));
  }
  return all;
}

}  // namespace

bool Knob::is_turned(MapKnobs knobs) const {
  const auto has_value = [](const auto& value) {
    if constexpr (requires { value->has_value(); }) return value->has_value();
    return false;
  };
  return std::visit(has_value, place(knobs));
}

std::span<const Knob> knob_table() {
  static const std::vector<Knob> all = made_table();
  return all;
}

const Knob& knob_named(std::string_view name) { return setting_named(knob_table(), name, "maps"); }

MapKnobs knobs_of(const Map& map) {
  return {.detail = map.frame.detail,
          .order_seed = {},
          .phase = map.dynamics.phase,
          .slice = map.dynamics.slice,
          .rotate = Rotation{},
          .drift = 0,
          .translate = Eigen::Vector3d::Zero(),
          .scale = 1,
          .steepness = map.layers.steepness};
}

}  // namespace qjulia

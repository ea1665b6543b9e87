#include "map_options.hpp"

#include <fmt/format.h>

#include <functional>
#include <nlohmann/json.hpp>

#include "options.hpp"
#include "provenance.hpp"
#include "qjulia/detail.hpp"
#include "qjulia/error.hpp"
#include "qjulia/surface.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kGroup = "Map options";

constexpr const char* kTuftsText =
    "How many times as steep the field is outside the shape, 1 to 100: above 1 tufts that stand "
    "off the shape are shorter, and fewer pieces come loose. ";

/// Longest side of the grid on which a map's own shape is measured, cells.
constexpr int kShapeCells = 128;

/// The detail that a word asks for, for the shape as the map has it.
double detail_of(DetailWord word, const Device& device, const RationalMap& map) {
  SurfaceOptions options;
  options.iterations = 1;
  options.resolution = kShapeCells;
  const TriangleMesh mesh = extract_surface(device, without_portals(map), options);
  if (mesh.triangles.empty()) {
    throw OptionError("detail",
                      "the map's own shape is empty, so that no word suits it; give a "
                      "number");
  }
  const bool is_exact = std::holds_alternative<DistanceModulus>(map.modulus);
  const double detail =
      chosen_detail(word, radial_spread(mesh, map.shape_to_map.to_shape(Eigen::Vector3d::Zero())),
                    is_exact ? kExactRule : kFittedRule);
  // The map's box, of which its detail is a fraction, is larger than a shape that has been turned.
  return map.box ? detail * mesh.box().diagonal() / map.box->diagonal() : detail;
}

/// Takes a number or a word.
Option add_detail(Command command, std::function<void(const DetailChoice&)> take,
                  const std::string& description) {
  const auto read = [take = std::move(take)](const std::string& text) {
    for (const auto word :
         {DetailWord::automatic, DetailWord::smooth, DetailWord::clear, DetailWord::wild}) {
      if (text == to_string(word)) return take(word);
    }
    double number = 0;
    try {
      number = finite_number(text);
    } catch (const InputError& error) {
      throw InputError(fmt::format("{}; give one, or auto, smooth, clear or wild", error.what()));
    }
    expect_detail(number);
    take(number);
  };
  return command.word(
      "--detail", "WORD|FRACTION", read,
      "Thickness of the fractal shell: 'auto' gives the set a roughness of about 1.2 on a grid of "
      "256 cells, by how unevenly the shape's radii are spread; 'smooth' is an eighth of it, "
      "'clear' half, 'wild' twice as much. Or a number, the fraction of the shape's box diagonal, "
      "from 0.0001 to 0.1: at 0.02 a round body is clearly grooved, at 0.01 a thin figure (in an "
      "exact map at half of that). " +
          description);
}

}  // namespace

void expect_detail(double detail) {
  if (detail >= kLeastDetail && detail <= kMostDetail) return;
  throw InputError(fmt::format("{} is out of range; give {} to {} of the box's diagonal", detail,
                               kLeastDetail, kMostDetail));
}

const char* const kMapOptionsHelp =
    "The map's options work together, in this order: --detail, --order-seed, --phase, --slice,\n"
    "--rotate, then --drift and --translate as one move, after which the map is calibrated again,\n"
    "and --scale and --tufts last.";

void MapOptions::keep(std::initializer_list<Option> added) {
  for (const Option& option : added) options.push_back(option.group(kGroup));
}

std::vector<std::string> MapOptions::given() const {
  std::vector<std::string> names;
  for (const Option& option : options) {
    if (option.given()) names.push_back(option.name());
  }
  return names;
}

void add_detail(Command command, DetailChoice& detail) {
  add_detail(
      command, [&detail](const DetailChoice& given) { detail = given; },
      "'surface' and 'render' can change it later")
      .default_text(to_string(detail));
}

void add_tufts_and_up(Command command, double& tufts, std::optional<UpAxis>& up) {
  command.add("--tufts", &tufts, "NUMBER",
              std::string(kTuftsText) + "'surface' and 'render' can change it later");
  add_up(command, up,
         "The mesh's axis that points up in pictures, and in files that have an up of their own. "
         "auto: the mesh's flattest, widest end is down; where none is, y is up");
}

void add_knobs(Command command, MapOptions& options) {
  MapKnobs& knobs = options.knobs;
  const auto set_phase = [&knobs](const std::vector<double>& p) {
    knobs.phase = Quaternion{p[0], p[1], p[2], p[3]};
  };
  const auto set_rotation = [&knobs](const std::vector<double>& r) {
    knobs.rotate = Rotation{{r[0], r[1], r[2]}, r[3]};
  };
  options.keep({
      add_detail(
          command, [&options](const DetailChoice& detail) { options.detail = detail; },
          "Default: the map's own"),
      command.add("--order-seed", &knobs.order_seed, "N",
                  "Shuffles the map's factors by this seed: another pattern of grooves on the same "
                  "shape. Default: the map's own order"),
      command.numbers("--phase", "X Y Z W", set_phase,
                      "Unit quaternion in front of the map, X its real part, normalised for you: "
                      "turns the pattern of grooves and keeps the shape; vary it little by little "
                      "for animations. Default: the map's own"),
      command.add(
          "--slice", &knobs.slice, "W",
          "Fourth coordinate of the slice that is looked at, map units (the shape's "
          "longest side is 3): away from 0 thin parts vanish first. Default: the map's own"),
      command.numbers("--rotate", "X Y Z DEGREES", set_rotation,
                      "Turns the factors, and the shape with them, about this axis through the "
                      "origin of iteration: about x, the real axis, the grooves turn along; about "
                      "any other, they change"),
      command.add("--drift", &knobs.drift, "F",
                  "Moves the origin of iteration inside the shape, along z, in inradii: grooves "
                  "deepen from 0.3 on, near 1 the set is a hollow crust, past 1.1 dust"),
      add_vector(command, "--translate", knobs.translate,
                 "Moves the factors by this vector, shape units, and the window with them: the "
                 "shape stays where it is, and iteration turns about another point of it"),
      command.add("--scale", &knobs.scale, "S",
                  "Above 1 the set swells, below 1 it wears away; 1 changes nothing"),
      command.add("--tufts", &knobs.tufts, "K", std::string(kTuftsText) + "Default: the map's own"),
  });
}

void add_map_options(Command command, MapOptions& options, const std::string& box,
                     const std::string& escape) {
  options.keep({command.add(
      "--iterations", &options.iterations, "INT",
      "Iterations n, 1 to 16: 1 is the fitted shape itself, 2 and 3 have fewer octaves of detail, "
      "6 is the set as it stays (8 where --detail is above 0.03)")});
  add_knobs(command, options);
  options.keep({
      add_box(command, "--box", options.box, "Part of space to look at, shape units. " + box),
      command.add("--escape", &options.escape, "R",
                  "Radius, map units, beyond which an orbit ends as outside: a radius smaller than "
                  "the set's own cuts into it. " +
                      escape),
      add_precision(command, options.precision,
                    "Arithmetic of the orbits: single, or double where the device has it"),
  });
}

RationalMap with_knobs(const Device& device, const RationalMap& map, const MapOptions& options,
                       const std::string& file) {
  try {
    MapKnobs knobs = options.knobs;
    if (options.detail) {
      if (const auto* word = std::get_if<DetailWord>(&*options.detail)) {
        with_detail(map, 1e-4);  // throws where no detail can be had
        knobs.detail = detail_of(*word, device, map);
      } else {
        knobs.detail = std::get<double>(*options.detail);
      }
    }
    return with_knobs(device, map, knobs);
  } catch (const OptionError& error) {
    throw OptionError(error.field(), fmt::format("'{}': {}", file, error.problem()));
  } catch (const InputError& error) {
    throw InputError(fmt::format("'{}': {}", file, error.what()));
  }
}

nlohmann::json to_json(const MapOptions& options) {
  const MapKnobs& knobs = options.knobs;
  nlohmann::json detail, phase, rotate, translate, box;
  if (options.detail) detail = to_json(*options.detail);
  if (const auto& p = knobs.phase) phase = {p->x, p->y, p->z, p->w};
  if (const auto& r = knobs.rotate) {
    rotate = {r->axis.x(), r->axis.y(), r->axis.z(), r->degrees};
  }
  if (const auto& t = knobs.translate) translate = {t->x(), t->y(), t->z()};
  if (options.box) box = to_json(*options.box);
  const auto or_null = [](const auto& value) {
    return value ? nlohmann::json(*value) : nlohmann::json();
  };
  return {{"detail", detail},
          {"order_seed", or_null(knobs.order_seed)},
          {"phase", phase},
          {"slice", or_null(knobs.slice)},
          {"rotate", rotate},
          {"drift", or_null(knobs.drift)},
          {"translate", translate},
          {"scale", or_null(knobs.scale)},
          {"tufts", or_null(knobs.tufts)},
          {"iterations", options.iterations},
          {"precision", to_string(options.precision)},
          {"box", box},
          {"escape", or_null(options.escape)}};
}

nlohmann::json to_json(const Box& box) {
  const auto corner = [](const Eigen::Vector3d& p) {
    return nlohmann::json::array({p.x(), p.y(), p.z()});
  };
  return nlohmann::json::array({corner(box.low), corner(box.high)});
}

}  // namespace qjulia::tools

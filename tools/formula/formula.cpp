#include "formula/formula.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string_view>

#include "base/base64.hpp"
#include "base/deflate.hpp"
#include "formula/embedded_shaders.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"
#include "qjulia/map/slope.hpp"

namespace qjulia::formula {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr int kUsualIterations = 6;

/// A finite literal of type float.
std::string number(double value) {
  constexpr double kMost = 1e30;
  std::string text = fmt::format("{}", static_cast<float>(std::clamp(value, -kMost, kMost)));
  if (text.find_first_of(".e") == std::string::npos) text += ".0";
  return text;
}

std::string vec3(const Vector3d& v) {
  return fmt::format("vec3({}, {}, {})", number(v.x()), number(v.y()), number(v.z()));
}

std::string vec4(const std::array<double, 4>& v) {
  return fmt::format("vec4({}, {}, {}, {})", number(v[0]), number(v[1]), number(v[2]),
                     number(v[3]));
}

/// Two of them stand for a map: where its frame lies in map coordinates, and how it is turned.
struct ShapeFrame {
  double scale = 1;  ///< map units
  Vector3d center;   ///< map coordinates
  Matrix3d turn;     ///< its columns are X, to the right, Y, up, and Z, to the front
};

ShapeFrame shape_frame(const Frame& frame) {
  const Vector3d half = Vector3d::Constant(kMapSide / 2);
  const Box box = frame.box ? frame.shape_to_map.to_map(*frame.box) : Box{-half, half};
  const UpAxis up_axis = frame.up.value_or(kDefaultUp);
  ShapeFrame result;
  result.scale = box.size().maxCoeff() / 2;
  result.center = box.center();
  const Vector3d up = direction(up_axis), front = Vector3d::Unit((axis_number(up_axis) + 1) % 3);
  result.turn << up.cross(front), up, front;
  return result;
}

/// The angles of cos A + sin A (i cos B + j sin B cos C + k sin B sin C), degrees.
Vector3d phase_angles(const Quaternion& phase) {
  const double across = std::hypot(phase.z, phase.w);
  return Vector3d(std::atan2(std::hypot(phase.y, across), phase.x), std::atan2(across, phase.y),
                  std::atan2(phase.w, phase.z)) *
         (180 / std::numbers::pi);
}

std::string arrays(const std::vector<Factor>& factors) {
  const std::size_t groups = (factors.size() + 3) / 4;
  std::string exponents, centers;
  for (std::size_t k = 0; k < 4 * groups; ++k) {
    const Factor factor = k < factors.size() ? factors[k] : Factor{};
    const char* const end = k + 1 < 4 * groups ? ",\n" : "";
    centers += vec4(coordinates(factor.center)) + end;
    exponents += (k % 4 == 0 ? "vec4(" : "") + number(factor.exponent);
    exponents += k % 4 == 3 ? std::string(")") + end : ", ";
  }
  return fmt::format(
      "// The factors in their order, in groups of four; those that fill up the last have exponent "
      "0.\nconst vec4 exponents[{0}] = vec4[{0}](\n{1});\nconst vec4 centers[{2}] = "
      "vec4[{2}](\n{3});\n#define EXPONENTS(g) exponents[g]\n#define CENTER(k) centers[k]\n",
      groups, exponents, 4 * groups, centers);
}

/// The radius beyond which orbits escape. Mandelbulber knows none below 1.
double bailout(const Reach& reach) {
  return std::max(1.0, std::min(reach.stops.outer, reach.stops.escape));
}

/// What map_values.glsl declares, as constants.
std::string values(const Map& map, const Reach& reach) {
  const auto constant = [](const char* name, double value) {
    return fmt::format("const float {} = {};\n", name, number(value));
  };
  const double outer = std::min(reach.stops.outer, reach.stops.escape);
  const ShapeFrame frame = shape_frame(map.frame);
  return constant("map_log_scale", map.dynamics.log_scale) +
         constant("map_log_escape", std::log(reach.stops.escape)) +
         constant("map_log_inner", std::log(reach.stops.inner)) +
         constant("map_surface_level", map.dynamics.surface_level) +
         constant("far_level", std::log(outer)) + constant("ball_radius", outer) +
         constant("steepest", reach.steepest) + constant("frame_scale", frame.scale) +
         fmt::format("const vec3 frame_center = {};\nconst mat3 frame_turn = mat3({}, {}, {});\n",
                     vec3(frame.center), vec3(frame.turn.col(0)), vec3(frame.turn.col(1)),
                     vec3(frame.turn.col(2))) +
         "#define map_slice Slice\n#define map_phase phase_of(Phase)\n"
         "#define map_steepness Steepness\n#define VERSOR_SHARPNESS 1.0\n";
}

/// In place of knobs.glsl: these knobs have been turned, and iteration turns about the origin.
constexpr std::string_view kNoKnobs =
    "float map_turned(float f) { return f; }\nvec4 map_origin() { return vec4(0); }\n";

/// What can be turned. Fragmentarium makes sliders of its uniforms.
std::string knobs(const Map& map, Program program) {
  const double slice = map.dynamics.slice, steepness = map.layers.steepness;
  const Vector3d phase = phase_angles(map.dynamics.phase);
  const double most_slice = std::max(1.5, std::abs(slice));
  struct Knob {
    const char *help, *type, *name;
    std::string value, slider;
  };
  const auto triple = [](const Vector3d& v) {
    return fmt::format("({},{},{})", number(v.x()), number(v.y()), number(v.z()));
  };
  const Knob all[] = {
      {"Iterations of the map; 1 is the fitted shape itself", "int", "Iterations",
       fmt::format("{}", kUsualIterations),
       fmt::format("[1,{},{}]", kUsualIterations, kMostIterations)},
      {"Fourth coordinate of the slice, map units: away from 0 thin parts vanish first", "float",
       "Slice", number(slice),
       fmt::format("[{},{},{}]", number(-most_slice), number(slice), number(most_slice))},
      {"Angles of the unit quaternion in front of the map, degrees: turn the pattern of grooves",
       "vec3", "Phase", vec3(phase), fmt::format("[(0,0,-180),{},(180,180,180)]", triple(phase))},
      {"How many times as steep F is outside the shape: what stands off it gets shorter", "float",
       "Steepness", number(steepness),
       fmt::format("[1,{},{}]", number(steepness), number(std::max(10.0, steepness)))},
      {"The least step of a ray, in units of the picture: finer ones show more and take longer",
       "float", "FinestStep", "0.002", "[0.0005,0.002,0.02]"},
  };
  const bool has_sliders = program == Program::fragmentarium;
  std::string text = has_sliders ? "#group Julia\n" : "";
  for (const Knob& knob : all) {
    text += has_sliders ? fmt::format("// {}.\nuniform {} {}; slider{}\n", knob.help, knob.type,
                                      knob.name, knob.slider)
                        : fmt::format("const {} {} = {};  // {}.\n", knob.type, knob.name,
                                      knob.value, knob.help);
  }
  // A loop whose bound is no constant is not unrolled: some compilers would take minutes.
  return text + fmt::format("#define NORMAL_POINTS 16\n#define groups ({} + min(0, {}))\n",
                            (map.dynamics.factors.size() + 3) / 4,
                            has_sliders ? "Iterations" : "iFrame");
}

/// One line of a comment, whatever is in the name: a backslash would make it two.
std::string in_comment(const std::string& name) {
  std::string text = name;
  std::ranges::replace_if(
      text, [](unsigned char c) { return c < ' ' || c == 127 || c == '\\'; }, '?');
  return text;
}

constexpr const char* kComment = "// A quaternion Julia set: {}, {} factors. Made by qjulia {}.\n";

/// A literal of type float in OpenCL C.
std::string single(double value) { return fmt::format("{}f", number(value)); }

std::string float4(const std::array<double, 4>& v) {
  return fmt::format("(float4)({}, {}, {}, {})", single(v[0]), single(v[1]), single(v[2]),
                     single(v[3]));
}

std::string float4(const Vector3d& v) { return float4(std::array{v.x(), v.y(), v.z(), 0.0}); }

/// What mandelbulber.cl takes from the map.
std::string opencl_values(const Map& map, const Reach& reach) {
  const ShapeFrame frame = shape_frame(map.frame);
  std::string text;
  const auto define = [&text](const char* name, const std::string& value) {
    text += fmt::format("#define QJ_{} {}\n", name, value);
  };
  const double outer = bailout(reach);
  define("FACTORS", fmt::format("{}", map.dynamics.factors.size()));
  define("LOG_SCALE", single(map.dynamics.log_scale));
  define("SURFACE_LEVEL", single(map.dynamics.surface_level));
  define("FAR_LEVEL", single(std::log(outer)));
  define("BALL_RADIUS", single(outer));
  define("STEEPEST", single(reach.steepest));
  define("FRAME_SCALE", single(frame.scale));
  define("FRAME_CENTER", float4(frame.center));
  define("RIGHT", float4(Vector3d(frame.turn.col(0))));
  define("UP", float4(Vector3d(frame.turn.col(1))));
  define("FRONT", float4(Vector3d(frame.turn.col(2))));
  std::string exponents, centers;
  for (const Factor& factor : map.dynamics.factors) {
    const char* const between = exponents.empty() ? "" : ",\n";
    exponents += between;
    exponents += single(factor.exponent);
    centers += between;
    centers += float4(coordinates(factor.center));
  }
  return text + fmt::format(
                    "__constant float qj_exponents[QJ_FACTORS] = {{\n{}}};\n"
                    "__constant float4 qj_centers[QJ_FACTORS] = {{\n{}}};\n",
                    exponents, centers);
}

/// Text in the form of Mandelbulber's settings: its length in 4 bytes, the highest first, then a
/// zlib stream, all in base64.
std::string packed_code(const std::string& code) {
  std::string bytes;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    bytes.push_back(static_cast<char>((code.size() >> shift) & 0xFFU));
  }
  return base::base64(bytes + base::deflated(code));
}

/// A camera that shows the shape, and the formula with its knobs.
std::string mandelbulber_settings(const Map& map, const Reach& reach, const std::string& name) {
  const Vector3d phase = phase_angles(map.dynamics.phase);
  return fmt::format(
      "# Mandelbulber settings file\n# version 2.34\n# only modified parameters\n"
      "[main_parameters]\nbailout {};\ncamera 2.7 -4.68 1.45;\n"
      "camera_distance_to_target 5.594;\ncamera_top -0.1295 0.2245 0.9658;\nDE_factor 0.9;\n"
      "formula_1 10000;\nfov 28;\nimage_height 600;\nimage_width 800;\nlight1_is_defined true;\n"
      "mat1_is_defined true;\nN {};\ntarget 0 0 0;\nuse_default_bailout false;\n"
      "[fractal_1]\nformula_code {};\ntransf_offset_0 {};\ntransf_offset_0005 0.002;\n"
      "transf_rotation {} {} {};\ntransf_scale_1 {};\n",
      number(bailout(reach)), kUsualIterations, packed_code(opencl_formula(map, reach, name)),
      number(map.dynamics.slice), number(phase.x()), number(phase.y()), number(phase.z()),
      number(map.layers.steepness));
}

/// Shaders by the names they include each other by; `made` are those that depend on the map.
class Shaders {
 public:
  using Texts = std::map<std::string, std::string, std::less<>>;
  explicit Shaders(Texts made) : made_(std::move(made)) {}

  /// The text with all that it includes, each once.
  std::string joined(const std::string& name) {
    if (!included_.insert(name).second) return {};
    constexpr std::string_view kInclude = "#include ";
    std::string text;
    std::string_view rest = source(name);
    while (!rest.empty()) {
      const std::string_view line = rest.substr(0, rest.find('\n'));
      rest.remove_prefix(std::min(line.size() + 1, rest.size()));
      text += line.starts_with(kInclude) ? joined(std::string(line.substr(kInclude.size())))
                                         : std::string(line) + "\n";
    }
    return text;
  }

 private:
  std::string_view source(const std::string& name) const {
    if (const auto found = made_.find(name); found != made_.end()) return found->second;
    const auto& embedded = embedded_shaders();
    const auto own = embedded.find("formula/shaders/" + name);
    return own != embedded.end() ? own->second : embedded.at("explore/page/" + name);
  }

  Texts made_;
  std::set<std::string> included_;
};

}  // namespace

void expect_formula(const Map& map, Program program) {
  if (!map.dynamics.is_rational()) {
    throw InputError(fmt::format(
        "formulas are made of factors, and this is a {} map: give one that 'qjulia fit' made",
        map.dynamics.kind()));
  }
  for (const auto& [is_there, what] : {std::pair{!map.layers.portals.empty(), "portals"},
                                       std::pair{map.layers.paint.has_value(), "paint"}}) {
    if (!is_there) continue;
    throw InputError(
        fmt::format("a formula cannot hold the {0} of this map: give the map without {0}", what));
  }
  const std::size_t count = map.dynamics.factors.size();
  if (program == Program::shadertoy && count > kMostFactorsOfShadertoy) {
    throw InputError(
        fmt::format("the map has {0} factors, and a formula for Shadertoy may have {1}: give "
                    "--factors-at-most {1} or fewer, which fits them to the map's surface, or "
                    "write a .frag for "
                    "Fragmentarium",
                    count, kMostFactorsOfShadertoy));
  }
}

Reach reach_of(const Device& device, const Map& map, const std::stop_token& stop) {
  Map plain = map;
  plain.layers.steepness = 1;
  Reach reach;
  reach.stops = find_stop_radii(device, plain, {}, stop);
  const double radius = std::min(reach.stops.outer, reach.stops.escape);
  const Vector3d corner = Vector3d::Constant(radius);
  const Field field(device, plain, Precision::single, reach.stops, stop);
  reach.steepest = steepest_slope(field, map.dynamics.slice, std::log(radius), {-corner, corner})
                       .value_or(10 / radius);
  return reach;
}

std::string opencl_formula(const Map& map, const Reach& reach, const std::string& name) {
  map.validate();
  expect_formula(map, Program::mandelbulber);
  return fmt::format(kComment, in_comment(name), map.dynamics.factors.size(), version()) +
         opencl_values(map, reach) +
         std::string(embedded_shaders().at("formula/shaders/mandelbulber.cl"));
}

std::string formula_text(const Map& map, const Reach& reach, Program program,
                         const std::string& name) {
  map.validate();
  expect_formula(map, program);
  if (program == Program::mandelbulber) return mandelbulber_settings(map, reach, name);
  const bool is_fragmentarium = program == Program::fragmentarium;
  const std::string head = fmt::format(
      "{}// A quaternion Julia set: {}, {} factors. Made by qjulia {}.\n{}",
      is_fragmentarium ? "#version 130\n#info A quaternion Julia set, made by qjulia\n" : "",
      in_comment(name), map.dynamics.factors.size(), version(),
      is_fragmentarium
          ? "#define providesNormal\n#include \"MathUtils.frag\"\n#include \"DE-Raytracer.frag\"\n"
          : "");
  Shaders shaders({{"map_values.glsl", values(map, reach)},
                   {"factors.glsl", arrays(map.dynamics.factors)},
                   {"knobs.glsl", std::string(kNoKnobs)},
                   {"QJ_MODULUS", "#include factors_modulus.glsl\n"},
                   {"QJ_VERSOR", "#include factors_versor.glsl\n"},
                   {"QJ_PAINT", "#include unpainted.glsl\n"},
                   {"QJ_PORTALS", "#include without_portals.glsl\n"}});
  return head + knobs(map, program) +
         shaders.joined(is_fragmentarium ? "fragmentarium.glsl" : "shadertoy.glsl");
}

}  // namespace qjulia::formula

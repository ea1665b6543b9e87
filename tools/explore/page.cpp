#include "explore/page.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <string_view>
#include <variant>

#include "base/base64.hpp"
#include "explore/embedded_page.hpp"
#include "explore/page_scene.hpp"
#include "explore/page_settings.hpp"
#include "qjulia/base/colors.hpp"
#include "qjulia/base/version.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/picture/picture.hpp"
#include "report/html.hpp"

namespace qjulia::explore {
namespace {

std::string_view file_of_page(const std::string& name) { return embedded_page().at(name); }

/// Whether the page of this map needs the shader file.
bool is_needed(const Map& map, std::string_view file) {
  for (const char* ending : {"_modulus.glsl", "_versor.glsl", "painted.glsl", "portals.glsl"}) {
    if (!file.ends_with(ending)) continue;
    const auto chosen = shader_files(map);
    return std::ranges::any_of(chosen, [&](const auto& one) { return one.second == file; });
  }
  const bool has_grid = std::holds_alternative<DistanceModulus>(map.dynamics.modulus);
  if (file == "spline.glsl") return map.layers.paint || has_grid;
  for (const char* of_grid :
       {"unpack.glsl", "quarters.glsl", "widened.glsl", "coefficients.glsl"}) {
    if (file == of_grid) return has_grid;
  }
  return file.ends_with(".glsl");
}

std::string shaders_of_page(const Map& map) {
  std::string text;
  for (const auto& [file, source] : embedded_page()) {
    if (!is_needed(map, file)) continue;
    text += fmt::format("<script type=\"x-shader\" id=\"{}\">\n{}</script>\n", file, source);
  }
  return text;
}

/// Linear colours by the palettes' names, the default's first.
std::string palettes_json() {
  const auto rgb = [](const Rgb& c) { return nlohmann::json{c.x(), c.y(), c.z()}; };
  nlohmann::ordered_json all;
  for (const std::string& name : palette_names()) {
    const Palette palette = *palette_named(name);
    nlohmann::json stops = nlohmann::json::array();
    for (const Rgb& stop : palette.stops) stops.push_back(rgb(stop));
    all[name] = {{"clay", rgb(palette.clay)}, {"stops", stops}};
  }
  return all.dump();
}

/// JSON that no HTML parser takes for the end of a script.
std::string json_of(const Map& map) {
  const std::string plain =
      to_json(map).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string text;
  for (const char c : plain) text += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return text;
}

/// What a policy calls one of the page's files. The build has hashed it, in hexadecimals.
std::string policy_hash(const std::string& name) {
  const std::string_view digits = file_of_page(name + ".sha256");
  std::string bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    int byte = 0;
    std::from_chars(digits.data() + i, digits.data() + i + 2, byte, 16);
    bytes.push_back(static_cast<char>(byte));
  }
  return fmt::format("'sha256-{}'", base::base64(bytes));
}

constexpr std::string_view kByBrowser = "webgl";

/// What pages differ in.
struct PageKind {
  std::string markup;
  std::string entry;             ///< its script
  std::string_view renderer;     ///< what the root element says of it
  std::string_view connections;  ///< what the policy lets it connect to
};

/// @param map none where the page has none; its shaders go into a page that draws by itself.
std::string page_of(const PageKind& kind, const Map* map, const std::string& file,
                    const std::string& outline = {}, const PageScene* scene = nullptr) {
  const std::map<std::string_view, std::string> parts = {
      {"title", html::escaped(file.substr(file.find_last_of('/') + 1))},
      {"file", html::escaped(file)},
      {"generator", std::string("qjulia ") + version()},
      {"renderer", std::string(kind.renderer)},
      {"policy",
       fmt::format("default-src 'none'; script-src {}; style-src {}; connect-src {}; img-src blob: "
                   "data:; base-uri 'none'; form-action 'none'",
                   policy_hash(kind.entry), policy_hash("style.css"), kind.connections)},
      {"style", std::string(file_of_page("style.css"))},
      {"shaders", kind.renderer == kByBrowser ? shaders_of_page(*map) : ""},
      {"palettes", palettes_json()},
      {"settings", map == nullptr ? "" : page_settings(*map, scene)},
      {"scene", scene == nullptr ? "" : scene->json},
      {"outline", outline},
      {"map", map == nullptr ? "" : json_of(*map)},
      {"script", std::string(file_of_page(kind.entry))}};
  std::string page;
  std::string_view rest = file_of_page(kind.markup);
  for (auto begin = rest.find("{{"); begin != std::string_view::npos; begin = rest.find("{{")) {
    const auto end = rest.find("}}", begin);
    page += rest.substr(0, begin);
    page += parts.at(rest.substr(begin + 2, end - begin - 2));
    rest.remove_prefix(end + 2);
  }
  return page += rest;
}

}  // namespace

std::vector<Eigen::Vector3d> page_outline(const Device& device, const Map& map,
                                          const std::stop_token& stop) {
  const PictureOptions usual;
  return Studio::of_drafts(device, map, usual, stop).outline();
}

std::vector<Eigen::Vector3d> box_outline(const Map& map) {
  const Eigen::Vector3d half = Eigen::Vector3d::Constant(2);
  const ShapeToMap& to_map = map.frame.shape_to_map;
  const Box box = map.frame.box.value_or(Box{to_map.to_shape(-half), to_map.to_shape(half)});
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Array3d share(i & 1, i >> 1 & 1, i >> 2);
    corners.push_back(box.low.array() + share * box.size().array());
  }
  return corners;
}

std::vector<Eigen::Vector3d> turned_outline(const Map& map, std::vector<Eigen::Vector3d> outline,
                                            const Rotation& rotation) {
  const Eigen::Vector3d origin = map.frame.shape_to_map.to_shape(Eigen::Vector3d::Zero());
  const Eigen::Matrix3d turn = rotation.matrix();
  for (Eigen::Vector3d& point : outline) point = origin + turn * (point - origin);
  return outline;
}

std::string outline_json(std::span<const Eigen::Vector3d> outline) {
  std::vector<std::string> points;
  for (const Eigen::Vector3d& point : outline) {
    points.push_back(fmt::format("[{}]", fmt::join(point.cast<float>().eval(), ",")));
  }
  return fmt::format("[{}]", fmt::join(points, ","));
}

std::string shared_page(const Map& map, const std::string& file, const PageScene& scene,
                        std::span<const Eigen::Vector3d> outline) {
  return page_of({"index.html", "shared.js", kByBrowser, "'none'"}, &map, file,
                 outline_json(outline), &scene);
}

std::string served_page(const Map& map, const std::string& file,
                        std::span<const Eigen::Vector3d> outline) {
  return page_of({"index.html", "served.js", "server", "'self'"}, &map, file,
                 outline_json(outline));
}

std::string fitting_page(const std::string& file) {
  return page_of({"fitting.html", "fitting.js", "fit", "'self'"}, nullptr, file);
}

}  // namespace qjulia::explore

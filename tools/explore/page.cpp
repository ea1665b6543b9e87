#include "explore/page.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <variant>
#include <vector>

#include "base/base64.hpp"
#include "base/sha256.hpp"
#include "base/text.hpp"
#include "explore/embedded_page.hpp"
#include "explore/page_settings.hpp"
#include "qjulia/colors.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/version.hpp"
#include "report/html.hpp"

namespace qjulia::explore {
namespace {

std::string_view file_of_page(const std::string& name) { return embedded_page().at(name); }

/// Lines without what they are indented by.
std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines = base::split(text, '\n');
  for (std::string& line : lines) line.erase(0, line.find_first_not_of(' '));
  return lines;
}

bool is_comment(std::string_view line) {
  return line.empty() || line.starts_with("//") || line.starts_with("/**") ||
         line.starts_with("* ");
}

/// A module after all that it imports, each once: as one module, which needs no server. Imports, a
/// line each, stand at the top of modules; names there differ.
void add_module(const std::string& name, std::set<std::string>& added, std::string& script) {
  constexpr std::string_view kFrom = "from \"./", kExport = "export ";
  if (!added.insert(name).second) return;
  for (const std::string& line : lines_of(file_of_page(name))) {
    if (is_comment(line)) continue;
    if (line.starts_with("import ")) {
      const std::string file = line.substr(line.find(kFrom) + kFrom.size());
      add_module(file.substr(0, file.find('"')), added, script);
    } else {
      script += line.substr(line.starts_with(kExport) ? kExport.size() : 0) + '\n';
    }
  }
}

template <class Kinds>
std::string_view name_of(const Kinds& kinds) {
  return std::visit([](const auto& kind) -> std::string_view { return kind.kName; }, kinds);
}

/// Whether maps of this map's kinds need the shader file.
bool is_needed(const RationalMap& map, std::string_view file) {
  if (file.ends_with("_modulus.glsl")) return file.starts_with(name_of(map.modulus));
  if (file.ends_with("_versor.glsl")) return file.starts_with(name_of(map.versor));
  if (file == "painted.glsl") return map.paint.has_value();
  if (file == "unpainted.glsl") return !map.paint;
  if (file == "spline.glsl") {
    return map.paint || std::holds_alternative<DistanceModulus>(map.modulus);
  }
  if (file == "portals.glsl") return !map.portals.empty();
  if (file == "without_portals.glsl") return map.portals.empty();
  return file.ends_with(".glsl");
}

std::string shaders_of_page(const RationalMap& map) {
  std::string text;
  for (const auto& [file, source] : embedded_page()) {
    if (!is_needed(map, file)) continue;
    text += fmt::format("<script type=\"x-shader\" id=\"{}\">\n", file);
    for (const std::string& line : lines_of(source)) {
      if (!is_comment(line)) text += line + '\n';
    }
    text += "</script>\n";
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
std::string json_of(const RationalMap& map) {
  const std::string plain =
      to_json(map).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string text;
  for (const char c : plain) text += c == '<' ? std::string("\\u003c") : std::string(1, c);
  return text;
}

std::string policy_hash(std::string_view text) {
  return fmt::format("'sha256-{}'", base::base64(base::sha256(text)));
}

constexpr std::string_view kByBrowser = "webgl";

/// What pages differ in.
struct PageKind {
  std::string markup;
  std::string entry;             ///< the module that imports the others
  std::string_view renderer;     ///< what the root element says of it
  std::string_view connections;  ///< what the policy lets it connect to
};

/// @param map none where the page has none; its shaders go into a page that draws by itself.
std::string page_of(const PageKind& kind, const RationalMap* map, const std::string& file) {
  std::string style;
  for (const std::string& line : lines_of(file_of_page("style.css"))) style += line;
  std::set<std::string> added;
  std::string script;
  add_module(kind.entry, added, script);
  const std::map<std::string_view, std::string> parts = {
      {"title", html::escaped(file.substr(file.find_last_of('/') + 1))},
      {"file", html::escaped(file)},
      {"generator", std::string("qjulia ") + version()},
      {"renderer", std::string(kind.renderer)},
      {"policy",
       fmt::format("default-src 'none'; script-src {}; style-src {}; connect-src {}; img-src blob: "
                   "data:; base-uri 'none'; form-action 'none'",
                   policy_hash(script), policy_hash(style), kind.connections)},
      {"style", style},
      {"shaders", kind.renderer == kByBrowser ? shaders_of_page(*map) : ""},
      {"palettes", palettes_json()},
      {"settings", map == nullptr ? "" : page_settings(*map)},
      {"map", map == nullptr ? "" : json_of(*map)},
      {"script", script}};
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

std::string shared_page(const RationalMap& map, const std::string& file) {
  return page_of({"index.html", "shared.js", kByBrowser, "'none'"}, &map, file);
}

std::string served_page(const RationalMap& map, const std::string& file) {
  return page_of({"index.html", "served.js", "server", "'self'"}, &map, file);
}

std::string fitting_page(const std::string& file) {
  return page_of({"fitting.html", "fitting.js", "fit", "'self'"}, nullptr, file);
}

}  // namespace qjulia::explore

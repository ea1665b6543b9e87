#include "qjulia/map/map_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "base/file_types.hpp"
#include "base/html_script.hpp"
#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "base/text.hpp"
#include "kind_parts.hpp"
#include "map/kinds.hpp"
#include "map/leaves.hpp"
#include "map/map_parts.hpp"
#include "map/packed_map.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

using map::fail;
using map::Object;
using nlohmann::json;

constexpr const char* kMapFormat = "qjulia-map";
/// A map is written as the first version that can hold it.
constexpr int kNewestVersion = 2;

void check_header(const Object& top) {
  if (top.text("format") != kMapFormat) {
    top.refuse(fmt::format("\"format\" must be \"{}\": this is no map file", kMapFormat));
  }
  const json& version = top.at("version");
  if (!version.is_number_integer() || version < 1 || version > kNewestVersion) {
    top.refuse(
        fmt::format("\"version\" is {}, and this program reads versions 1 to {}: use a "
                    "newer program, or convert the file",
                    version.dump(), kNewestVersion));
  }
}

int file_version(const Map& map) {
  const auto version_of = [](const auto& kind) { return kind.kFileVersion; };
  return std::max({map.layers.steepness == 1 && map.layers.portals.empty() && !map.layers.paint &&
                           !map.frame.up && !map.frame.diagonal
                       ? 1
                       : 2,
                   std::visit(version_of, map.dynamics.modulus),
                   std::visit(version_of, map.dynamics.versor)});
}

/// Sets the map's modulus and versor to the kinds that the file's "kind" names.
/// @throws InputError for kinds that are not known.
void read_kinds(const Object& top, Map& map) {
  const std::string kind = top.text("kind");
  const std::string names = kind == "rational" ? "factors" : kind;
  const auto slash = names.find('/');
  const auto modulus = map::kind_named<Modulus>(names.substr(0, slash));
  const auto versor =
      map::kind_named<Versor>(slash == std::string::npos ? names : names.substr(slash + 1));
  if (modulus && versor) {
    map.dynamics.modulus = *modulus;
    map.dynamics.versor = *versor;
  }
  // One kind of map has one name.
  if (kind != map.dynamics.kind()) {
    top.refuse(
        fmt::format("unknown \"kind\" {}: it must be \"rational\", \"quadratic\", or a "
                    "modulus and a versor such as \"distance/noise\"",
                    json(kind).dump()));
  }
  if (top.at("version") < file_version(map)) {
    top.refuse(fmt::format("a {} map needs version {}, and \"version\" is {}", kind,
                           file_version(map), top.at("version").dump()));
  }
}

/// The keys of a map of these kinds, in the order in which they are written.
std::vector<std::string_view> keys_of(const Map& map) {
  std::vector<std::string_view> keys{"format",        "version",   "kind",  "slice",   "log_scale",
                                     "surface_level", "steepness", "phase", "portals", "paint"};
  map::visit_map_members(map, [&](const char* name, const auto&) {
    if (std::ranges::find(keys, std::string_view(name)) == keys.end()) keys.emplace_back(name);
  });
  keys.insert(keys.end(), {"shape_to_map", "detail", "diagonal", "inradius", "box", "up"});
  if (map::takes_factors(map)) keys.emplace_back("factors");
  keys.emplace_back("provenance");
  return keys;
}

/// What files called "steepness" at first.
constexpr const char* kFormerSteepness = "tufts";

bool needs_version_2(std::string_view key) {
  return key == "steepness" || key == kFormerSteepness || key == "portals" || key == "paint" ||
         key == "up" || key == "diagonal";
}

UpAxis read_up(const Object& top) {
  const auto up = up_axis_named(top.text("up"));
  if (!up) {
    top.refuse(
        fmt::format("\"up\" is {}: it must be one of \"x\", \"y\", \"z\", \"-x\", \"-y\", "
                    "\"-z\"",
                    top.at("up").dump()));
  }
  return *up;
}

/// One line a factor: maps are read by people too, and compared by line.
std::string factor_lines(const json& factors) {
  std::string text;
  for (const json& factor : factors) {
    text += fmt::format("{}    {}", text.empty() ? "[\n" : ",\n", factor.dump());
  }
  return text + "\n  ]";
}

/// The map's own text: all of it, or where it is a page, what the page holds of a map.
std::string_view map_text(std::string_view text, const std::string& source) {
  if (const auto first = text.find_first_not_of(" \t\r\n");
      first == std::string_view::npos || text[first] != '<') {
    return text;
  }
  const auto map = base::script_in(text, kMapFormat);  // the element's id, too
  if (!map) fail(source, "it is a page without a map in it");
  return *map;
}

Map parsed_map(std::string_view text, const std::string& source) {
  if (base::is_json_too_deep(text)) fail(source, "it is nested too deeply to be a map file");
  // Refuses what the parser lets pass: keys that stand twice in an object, of which it would take
  // the last.
  std::vector<std::set<std::string>> keys;  // keys of the enclosing objects
  const auto is_strict = [&](int, json::parse_event_t event, const json& parsed) {
    if (event == json::parse_event_t::object_start) keys.emplace_back();
    if (event == json::parse_event_t::object_end) keys.pop_back();
    if (event == json::parse_event_t::key &&
        !keys.back().insert(parsed.get<std::string>()).second) {
      fail(source, fmt::format("it has the key {} twice; leave one of them", parsed.dump()));
    }
    return true;
  };
  json value;
  try {
    value = json::parse(text, is_strict);
  } catch (const json::parse_error& error) {
    // The parser's own words quote the file, whatever bytes are in it.
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    fail(source, fmt::format("it is not complete, valid JSON (line {}); write it again",
                             1 + std::count(text.begin(), end, '\n')));
  } catch (const json::exception& error) {
    fail(source, fmt::format("it is not valid JSON ({}); write it again", error.id));
  }
  return map_from_json(value, source);
}

/// What `write_map` writes.
std::string file_text(const Map& map) {
  const json value = to_json(map);
  std::string text;
  for (const std::string_view key : keys_of(map)) {
    const auto member = value.find(key);
    if (member == value.end()) continue;
    // File names in the provenance may hold any bytes.
    text += fmt::format("{}  \"{}\": {}", text.empty() ? "{\n" : ",\n", key,
                        key == "factors"
                            ? factor_lines(*member)
                            : member->dump(-1, ' ', false, json::error_handler_t::replace));
  }
  return text + "\n}\n";
}

/// For a file whose name says that it can hold no map: what it is and what reads it. Else empty.
std::string other_use(const std::filesystem::path& path) {
  const auto content = base::content_of(path);
  if (!content || base::has_type(path, base::FileContent::map, base::FileUse::read)) return {};
  constexpr const char* kForOthers =
      "for other programs, which no command reads; give the map that it was made of";
  switch (*content) {
    case base::FileContent::mesh:
      if (base::has_type(path, base::FileContent::mesh, base::FileUse::read)) {
        return "it is a mesh: 'qjulia fit' and 'qjulia shape' make maps of meshes, and "
               "'qjulia info' describes them";
      }
      return fmt::format("it is a mesh {}, or write the mesh as {}", kForOthers,
                         base::extension_list(base::FileContent::mesh, base::FileUse::read));
    case base::FileContent::original_map:
      return "it is a map of the papers' programs: 'qjulia convert' makes a map file of it";
    case base::FileContent::sampled_distance:
      return "it is a distance field of the papers' programs: 'qjulia convert' makes a mesh of it";
    case base::FileContent::manifest:
      return "it is a manifest or a schedule: 'qjulia batch run' reads manifests";
    case base::FileContent::field:
    case base::FileContent::volume:
    case base::FileContent::formula:
      return fmt::format("it is a {} {}", to_string(*content), kForOthers);
    case base::FileContent::map:
    case base::FileContent::picture:
    case base::FileContent::report:
      break;  // some of them hold maps
  }
  return {};
}

}  // namespace

json to_json(const Map& map) {
  map.validate();
  json result = {{"format", kMapFormat},
                 {"version", file_version(map)},
                 {"kind", map.dynamics.kind()},
                 {"slice", map.dynamics.slice},
                 {"log_scale", map.dynamics.log_scale},
                 {"surface_level", map.dynamics.surface_level},
                 {"phase", map::json_of(map.dynamics.phase)},
                 {"shape_to_map",
                  {{"scale", map.frame.shape_to_map.scale},
                   {"translation", map::json_of(map.frame.shape_to_map.translation)}}},
                 {"provenance", map.provenance.json()}};
  map::visit_map_members(
      map, [&](const char* name, const auto& member) { result[name] = map::json_of(member); });
  if (map::takes_factors(map)) {
    json& factors = result["factors"] = json::array();
    for (const auto& [center, exponent] : map.dynamics.factors) {
      factors.push_back({{"center", map::json_of(center)}, {"exponent", exponent}});
    }
  }
  if (map.layers.steepness != 1) result["steepness"] = map.layers.steepness;
  if (!map.layers.portals.empty()) result["portals"] = map::json_of(map.layers.portals);
  if (map.layers.paint) result["paint"] = map::json_of(*map.layers.paint);
  if (map.frame.detail) result["detail"] = *map.frame.detail;
  if (map.frame.diagonal) result["diagonal"] = *map.frame.diagonal;
  if (map.frame.inradius) result["inradius"] = *map.frame.inradius;
  if (map.frame.box) {
    result["box"] =
        json::array({map::json_of(map.frame.box->low), map::json_of(map.frame.box->high)});
  }
  if (map.frame.up) result["up"] = to_string(*map.frame.up);
  return result;
}

Map map_from_json(const json& value, const std::string& source) {
  const Object top(value, source, "");
  check_header(top);
  Map map;
  read_kinds(top, map);
  std::vector<std::string_view> keys = keys_of(map);
  if (!top.has("steepness")) keys.emplace_back(kFormerSteepness);
  if (top.at("version") == 1) std::erase_if(keys, needs_version_2);
  top.expect_only(keys);
  map.dynamics.slice = top.number("slice");
  map.dynamics.log_scale = top.number("log_scale");
  if (top.has("surface_level")) map.dynamics.surface_level = top.number("surface_level");
  for (const char* key : {"steepness", kFormerSteepness}) {
    if (top.has(key)) map.layers.steepness = top.number(key);
  }
  if (top.has("portals")) map::read(top, "portals", map.layers.portals);
  if (top.has("paint")) map::read(top, "paint", map.layers.paint.emplace());
  if (top.has("phase")) map.dynamics.phase = top.quaternion("phase");
  map::visit_map_members(map,
                         [&](const char* name, auto& member) { map::read(top, name, member); });
  if (map::takes_factors(map)) {
    map.dynamics.factors.reserve(top.array("factors").size());
    top.for_each("factors", [&](const Object& factor) {
      factor.expect_only({"center", "exponent"});
      map.dynamics.factors.push_back({factor.quaternion("center"), factor.number("exponent")});
    });
  }
  const Object shape_to_map = top.object("shape_to_map");
  shape_to_map.expect_only({"scale", "translation"});
  map.frame.shape_to_map = {shape_to_map.number("scale"), shape_to_map.vector("translation")};
  if (top.has("detail")) map.frame.detail = top.number("detail");
  if (top.has("diagonal")) map.frame.diagonal = top.number("diagonal");
  if (top.has("inradius")) map.frame.inradius = top.number("inradius");
  if (top.has("box")) map.frame.box = top.box("box");
  if (top.has("up")) map.frame.up = read_up(top);
  if (top.has("provenance")) {
    static_cast<void>(top.object("provenance"));
    map.provenance = top.at("provenance");
  }
  try {
    map.validate();
  } catch (const InputError& error) {
    top.refuse(error.what());
  }
  return map;
}

Map read_map(const std::filesystem::path& path, std::stop_token stop) {
  const std::string source = path.string();
  if (const std::string other = other_use(path); !other.empty()) fail(source, other);
  if (map::is_map_carrier(path)) {
    const auto packed = map::packed_text_in(path, stop);
    if (!packed) {
      fail(source,
           "it holds no map; pictures of 'qjulia render' and scenes of 'qjulia surface' do, unless "
           "they were made without it or another program wrote them again");
    }
    return parsed_map(map::unpacked_text(*packed, source), source);
  }
  const std::string file = base::read_text_file(path, "map", map::kLargestMapText, std::move(stop));
  return parsed_map(map_text(file, source), source);
}

bool holds_map(const std::filesystem::path& path, const std::stop_token& stop) {
  return map::is_map_carrier(path) && map::packed_text_in(path, stop).has_value();
}

std::string packed_map(const Map& map) { return map::packed_text(file_text(map)); }

void write_map(const Map& map, const std::filesystem::path& path) {
  base::write_file(path, file_text(map));
}

}  // namespace qjulia

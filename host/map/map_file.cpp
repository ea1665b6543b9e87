#include "qjulia/map_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "map/distance_file.hpp"
#include "map/json_object.hpp"
#include "map/kinds.hpp"
#include "map/noise_file.hpp"
#include "map/paint_file.hpp"
#include "map/portals.hpp"
#include "qjulia/error.hpp"

namespace qjulia {
namespace {

using map::fail;
using map::Object;
using nlohmann::json;

constexpr const char* kFormat = "qjulia-map";
/// A map is written as the first version that can hold it.
constexpr int kNewestVersion = 2;
constexpr std::uintmax_t kLargestFile = std::uintmax_t{64} << 20U;  // bytes
constexpr int kDeepest = 64;                                        // levels of nesting

json to_json(const Quaternion& q) { return {q.x, q.y, q.z, q.w}; }
json to_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
json to_json(const Factor& factor) {
  return {{"center", to_json(factor.center)}, {"exponent", factor.exponent}};
}

void check_header(const Object& map, const std::string& source) {
  if (map.text("format") != kFormat) {
    fail(source, fmt::format("\"format\" must be \"{}\": this is no map file", kFormat));
  }
  const json& version = map.at("version");
  if (!version.is_number_integer() || version < 1 || version > kNewestVersion) {
    fail(source, fmt::format("\"version\" is {}, and this program reads versions 1 to {}: use a "
                             "newer program, or convert the file",
                             version.dump(), kNewestVersion));
  }
}

int file_version(const RationalMap& map) {
  return std::max({map.tufts == 1 && map.portals.empty() && !map.paint && !map.up ? 1 : 2,
                   map::file_version_of(map.modulus), map::file_version_of(map.versor)});
}

/// Sets the map's modulus and versor to the kinds that the file's "kind" names.
/// @throws InputError for kinds that are not known.
void read_kinds(const Object& top, const std::string& source, RationalMap& map) {
  const std::string kind = top.text("kind");
  const std::string names = kind == "rational" ? "factors" : kind;
  const auto slash = names.find('/');
  const auto modulus = map::kind_named<Modulus>(names.substr(0, slash));
  const auto versor =
      map::kind_named<Versor>(slash == std::string::npos ? names : names.substr(slash + 1));
  if (modulus && versor) {
    map.modulus = *modulus;
    map.versor = *versor;
  }
  // One kind of map has one name.
  if (kind != map.kind()) {
    fail(source, fmt::format("unknown \"kind\" {}: it must be \"rational\", \"quadratic\", or a "
                             "modulus and a versor such as \"distance/noise\"",
                             json(kind).dump()));
  }
  if (top.at("version") < file_version(map)) {
    fail(source, fmt::format("a {} map needs version {}, and \"version\" is {}", kind,
                             file_version(map), top.at("version").dump()));
  }
}

/// The keys of what the map's kinds keep, each once, modulus first.
std::vector<std::string_view> keys_of_kinds(const RationalMap& map) {
  std::vector<std::string_view> keys;
  map::visit_map_members(map, [&](const char* name, const auto&) {
    if (std::ranges::find(keys, std::string_view(name)) == keys.end()) keys.emplace_back(name);
  });
  return keys;
}

/// The factors in their order.
std::vector<Factor> read_factors(const Object& top, const std::string& source) {
  const json& factors = top.array("factors");
  std::vector<Factor> result;
  result.reserve(factors.size());
  for (std::size_t k = 0; k < factors.size(); ++k) {
    const Object factor(factors[k], source, fmt::format("factors[{}]", k));
    factor.expect_only(std::array<std::string_view, 2>{"center", "exponent"});
    result.push_back({factor.quaternion("center"), factor.number("exponent")});
  }
  return result;
}

UpAxis read_up(const Object& top, const std::string& source) {
  const auto up = up_axis_named(top.text("up"));
  if (!up) {
    fail(source, fmt::format("\"up\" is {}: it must be one of \"x\", \"y\", \"z\", \"-x\", \"-y\", "
                             "\"-z\"",
                             top.at("up").dump()));
  }
  return *up;
}

/// One line a factor: maps are read by people too, and compared by line.
std::string factor_lines(const json& factors) {
  std::string text = "  \"factors\": [\n";
  for (std::size_t k = 0; k < factors.size(); ++k) {
    text += fmt::format("    {}{}\n", factors[k].dump(), k + 1 < factors.size() ? "," : "");
  }
  return text + "  ],\n";
}

/// The map's own text: all of it, or where it is a page, what the page holds of a map.
std::string_view map_text(std::string_view text, const std::string& source) {
  constexpr std::string_view kBegin = "<script type=\"application/json\" id=\"qjulia-map\">";
  if (const auto first = text.find_first_not_of(" \t\r\n");
      first == std::string_view::npos || text[first] != '<') {
    return text;
  }
  const auto begin = text.find(kBegin);
  if (begin == std::string_view::npos) fail(source, "is a page without a map in it");
  text.remove_prefix(begin + kBegin.size());
  return text.substr(0, text.find("</script>"));
}

/// Refuses what the parser lets pass: values nested very deep, and keys that stand twice in an
/// object, of which it would take the last.
class StrictParsing {
 public:
  explicit StrictParsing(std::string source) : source_(std::move(source)) {}

  bool operator()(int depth, json::parse_event_t event, const json& parsed) {
    if (depth > kDeepest) fail(source_, "is nested too deep: no map file is");
    if (event == json::parse_event_t::object_start) keys_.emplace_back();
    if (event == json::parse_event_t::object_end) keys_.pop_back();
    if (event == json::parse_event_t::key &&
        !keys_.back().insert(parsed.get<std::string>()).second) {
      fail(source_, fmt::format("has the key {} twice; leave one of them", parsed.dump()));
    }
    return true;
  }

 private:
  std::string source_;
  std::vector<std::set<std::string>> keys_;  ///< of the objects around
};

}  // namespace

json to_json(const RationalMap& map) {
  json factors = json::array();
  for (const Factor& factor : map.factors) factors.push_back(to_json(factor));
  json result = {
      {"format", kFormat},
      {"version", file_version(map)},
      {"kind", map.kind()},
      {"slice", map.slice},
      {"log_scale", map.log_scale},
      {"surface_level", map.surface_level},
      {"phase", to_json(map.phase)},
      {"shape_to_map",
       {{"scale", map.shape_to_map.scale}, {"translation", to_json(map.shape_to_map.translation)}}},
      {"provenance", map.provenance.json()}};
  map::visit_map_members(map, map::Overloaded{[&](const char* name, const Quaternion& value) {
                                                result[name] = to_json(value);
                                              },
                                              [&](const char* name, const DistanceModulus& value) {
                                                result[name] = map::distance_json(value);
                                              },
                                              [&](const char* name, const NoiseVersor& value) {
                                                result[name] = map::noise_json(value);
                                              }});
  if (map::takes_factors(map)) result["factors"] = factors;
  if (map.tufts != 1) result["tufts"] = map.tufts;
  if (!map.portals.empty()) result["portals"] = map::portals_json(map.portals);
  if (map.paint) result["paint"] = map::paint_json(*map.paint);
  if (map.detail) result["detail"] = *map.detail;
  if (map.inradius) result["inradius"] = *map.inradius;
  if (map.box) result["box"] = json::array({to_json(map.box->low), to_json(map.box->high)});
  if (map.up) result["up"] = to_string(*map.up);
  return result;
}

RationalMap map_from_json(const json& value, const std::string& source) {
  const Object top(value, source, "");
  check_header(top, source);
  RationalMap map;
  read_kinds(top, source, map);
  std::vector<std::string_view> keys = keys_of_kinds(map);
  if (map::takes_factors(map)) keys.emplace_back("factors");
  keys.insert(keys.end(), {"format", "version", "kind", "slice", "log_scale", "surface_level",
                           "phase", "shape_to_map", "detail", "inradius", "box", "provenance"});
  if (top.at("version") > 1) keys.insert(keys.end(), {"tufts", "portals", "paint", "up"});
  top.expect_only(keys);
  map.slice = top.number("slice");
  map.log_scale = top.number("log_scale");
  if (top.has("surface_level")) map.surface_level = top.number("surface_level");
  if (top.has("tufts")) map.tufts = top.number("tufts");
  if (top.has("portals")) map.portals = map::read_portals(top.array("portals"), source);
  if (top.has("paint")) map.paint = map::read_paint(top.object("paint"));
  if (top.has("phase")) map.phase = top.quaternion("phase");
  map::visit_map_members(map, map::Overloaded{[&](const char* name, Quaternion& member) {
                                                member = top.quaternion(name);
                                              },
                                              [&](const char* name, DistanceModulus& member) {
                                                member = map::read_distance(top.object(name));
                                              },
                                              [&](const char* name, NoiseVersor& member) {
                                                member = map::read_noise(top.object(name));
                                              }});
  if (map::takes_factors(map)) map.factors = read_factors(top, source);
  const Object shape_to_map = top.object("shape_to_map");
  shape_to_map.expect_only(std::array<std::string_view, 2>{"scale", "translation"});
  map.shape_to_map = {shape_to_map.number("scale"), shape_to_map.vector("translation")};
  if (top.has("detail")) map.detail = top.number("detail");
  if (top.has("inradius")) map.inradius = top.number("inradius");
  if (top.has("box")) map.box = top.box("box");
  if (top.has("up")) map.up = read_up(top, source);
  if (top.has("provenance")) {
    static_cast<void>(top.object("provenance"));
    map.provenance = top.at("provenance");
  }
  try {
    map.validate();
  } catch (const InputError& error) {
    fail(source, error.what());
  }
  return map;
}

RationalMap read_map(const std::filesystem::path& path, std::stop_token stop) {
  const std::string file = base::read_text_file(path, "map", kLargestFile, std::move(stop));
  const std::string_view text = map_text(file, path.string());
  json value;
  try {
    value = json::parse(text, StrictParsing(path.string()));
  } catch (const json::parse_error& error) {
    // The parser's own words quote the file, whatever bytes are in it.
    const auto end = text.begin() + static_cast<std::ptrdiff_t>(std::min(error.byte, text.size()));
    fail(path.string(), fmt::format("is not complete, valid JSON (line {}); write it again",
                                    1 + std::count(text.begin(), end, '\n')));
  } catch (const json::exception& error) {
    fail(path.string(), fmt::format("is not valid JSON ({}); write it again", error.id));
  }
  return map_from_json(value, path.string());
}

void write_map(const RationalMap& map, const std::filesystem::path& path) {
  map.validate();
  const json value = to_json(map);
  std::string text = "{\n";
  std::vector<std::string_view> keys{"format",        "version", "kind",  "slice",   "log_scale",
                                     "surface_level", "tufts",   "phase", "portals", "paint"};
  const std::vector<std::string_view> of_kinds = keys_of_kinds(map);
  keys.insert(keys.end(), of_kinds.begin(), of_kinds.end());
  keys.insert(keys.end(), {"shape_to_map", "detail", "inradius", "box", "up"});
  for (const std::string_view key : keys) {
    const auto member = value.find(key);
    if (member != value.end()) text += fmt::format("  \"{}\": {},\n", key, member->dump());
  }
  if (value.contains("factors")) text += factor_lines(value["factors"]);
  // File names in it may hold any bytes.
  text += fmt::format("  \"provenance\": {}\n}}\n",
                      value["provenance"].dump(-1, ' ', false, json::error_handler_t::replace));
  base::write_file(path, text);
}

}  // namespace qjulia

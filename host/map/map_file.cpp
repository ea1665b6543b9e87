#include "qjulia/map_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "map/kinds.hpp"
#include "qjulia/error.hpp"

namespace qjulia {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "qjulia-map";
constexpr int kVersion = 2;                                         // the newest
constexpr std::uintmax_t kLargestFile = std::uintmax_t{64} << 20U;  // bytes
constexpr int kDeepest = 64;                                        // levels of nesting

[[noreturn]] void fail(const std::string& source, const std::string& what) {
  throw InputError(fmt::format("map '{}': {}", source, what));
}

/// A JSON object and what messages call it. Every member asked for must be of its type.
class Object {
 public:
  Object(const json& value, std::string source, std::string name)
      : value_(value), source_(std::move(source)), name_(std::move(name)) {
    if (!value_.is_object()) {
      fail(source_,
           fmt::format("{} must be an object, but is {}",
                       name_.empty() ? "the file" : '"' + name_ + '"', value_.type_name()));
    }
  }

  bool has(const char* key) const { return value_.contains(key); }

  const json& at(const char* key) const {
    const auto found = value_.find(key);
    if (found == value_.end()) {
      fail(source_, fmt::format("the key \"{}\" is missing; a map file needs it", path(key)));
    }
    return *found;
  }

  double number(const char* key) const { return number(at(key), path(key)); }

  std::string text(const char* key) const {
    const json& value = at(key);
    if (!value.is_string()) wrong(path(key), "a string", value);
    return value.get<std::string>();
  }

  const json& array(const char* key) const {
    const json& value = at(key);
    if (!value.is_array()) wrong(path(key), "an array", value);
    return value;
  }

  Quaternion quaternion(const char* key) const {
    const auto v = numbers<4>(at(key), path(key));
    return {v[0], v[1], v[2], v[3]};
  }

  Eigen::Vector3d vector(const char* key) const {
    return Eigen::Vector3d(numbers<3>(at(key), path(key)).data());
  }

  Box box(const char* key) const {
    const json& value = array(key);
    if (value.size() != 2) wrong(path(key), "two corners", value);
    return {Eigen::Vector3d(numbers<3>(value[0], path(key) + "[0]").data()),
            Eigen::Vector3d(numbers<3>(value[1], path(key) + "[1]").data())};
  }

  Object object(const char* key) const { return {at(key), source_, path(key)}; }

  /// Refuses members with other names: a misspelt one would be ignored in silence.
  void expect_only(std::span<const std::string_view> keys) const {
    for (const auto& [key, unused] : value_.items()) {
      if (std::ranges::find(keys, std::string_view(key)) == keys.end()) {
        fail(source_,
             fmt::format("unknown key \"{}\"; remove it or correct its name", path(key.c_str())));
      }
    }
  }

 private:
  std::string path(const char* key) const { return name_.empty() ? key : name_ + '.' + key; }

  [[noreturn]] void wrong(const std::string& path, const char* wanted, const json& value) const {
    fail(source_, fmt::format("\"{}\" must be {}, but is {}", path, wanted,
                              value.is_array() ? fmt::format("an array of {}", value.size())
                                               : std::string(value.type_name())));
  }

  double number(const json& value, const std::string& path) const {
    if (!value.is_number()) wrong(path, "a finite number", value);
    return value.get<double>();
  }

  template <std::size_t N>
  std::array<double, N> numbers(const json& value, const std::string& path) const {
    if (!value.is_array() || value.size() != N) {
      wrong(path, N == 3 ? "an array of 3 numbers" : "an array of 4 numbers", value);
    }
    std::array<double, N> result{};
    for (std::size_t i = 0; i < N; ++i)
      result[i] = number(value[i], fmt::format("{}[{}]", path, i));
    return result;
  }

  const json& value_;
  std::string source_;
  std::string name_;
};

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
  if (!version.is_number_integer() || version < 1 || version > kVersion) {
    fail(source, fmt::format("\"version\" is {}, and this program reads versions 1 to {}: use a "
                             "newer program, or convert the file",
                             version.dump(), kVersion));
  }
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
  if (kind == map.kind()) return;
  fail(source, fmt::format("unknown \"kind\" {}: it must be \"rational\" or \"quadratic\"",
                           json(kind).dump()));
}

/// The keys of what the map's kinds keep, each once, modulus first.
std::vector<std::string_view> keys_of_kinds(const RationalMap& map) {
  std::vector<std::string_view> keys;
  map::visit_map_members(map, [&](const char* name, const auto&) {
    if (std::ranges::find(keys, std::string_view(name)) == keys.end()) keys.emplace_back(name);
  });
  return keys;
}

/// The oldest version of the format that can hold the map: other programs may read no newer one.
int version_of(const RationalMap& map) { return map.tufts == 1 ? 1 : 2; }

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

/// One line a factor: maps are read by people too, and compared by line.
std::string factor_lines(const json& factors) {
  std::string text = "  \"factors\": [\n";
  for (std::size_t k = 0; k < factors.size(); ++k) {
    text += fmt::format("    {}{}\n", factors[k].dump(), k + 1 < factors.size() ? "," : "");
  }
  return text + "  ],\n";
}

}  // namespace

json to_json(const RationalMap& map) {
  json factors = json::array();
  for (const Factor& factor : map.factors) factors.push_back(to_json(factor));
  json result = {
      {"format", kFormat},
      {"version", version_of(map)},
      {"kind", map.kind()},
      {"slice", map.slice},
      {"log_scale", map.log_scale},
      {"surface_level", map.surface_level},
      {"phase", to_json(map.phase)},
      {"shape_to_map",
       {{"scale", map.shape_to_map.scale}, {"translation", to_json(map.shape_to_map.translation)}}},
      {"provenance", map.provenance.json()}};
  map::visit_map_members(
      map, [&](const char* name, const Quaternion& value) { result[name] = to_json(value); });
  if (map::takes_factors(map)) result["factors"] = factors;
  if (map.tufts != 1) result["tufts"] = map.tufts;
  if (map.detail) result["detail"] = *map.detail;
  if (map.inradius) result["inradius"] = *map.inradius;
  if (map.box) result["box"] = json::array({to_json(map.box->low), to_json(map.box->high)});
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
  if (top.at("version") > 1) keys.emplace_back("tufts");
  top.expect_only(keys);
  map.slice = top.number("slice");
  map.log_scale = top.number("log_scale");
  if (top.has("surface_level")) map.surface_level = top.number("surface_level");
  if (top.has("tufts")) map.tufts = top.number("tufts");
  if (top.has("phase")) map.phase = top.quaternion("phase");
  map::visit_map_members(
      map, [&](const char* name, Quaternion& member) { member = top.quaternion(name); });
  if (map::takes_factors(map)) map.factors = read_factors(top, source);
  const Object shape_to_map = top.object("shape_to_map");
  shape_to_map.expect_only(std::array<std::string_view, 2>{"scale", "translation"});
  map.shape_to_map = {shape_to_map.number("scale"), shape_to_map.vector("translation")};
  if (top.has("detail")) map.detail = top.number("detail");
  if (top.has("inradius")) map.inradius = top.number("inradius");
  if (top.has("box")) map.box = top.box("box");
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

RationalMap read_map(const std::filesystem::path& path) {
  const std::string text = base::read_text_file(path, "map", kLargestFile);
  json value;
  try {
    value = json::parse(text, [&](int depth, json::parse_event_t, json&) {
      if (depth > kDeepest) fail(path.string(), "is nested too deep: no map file is");
      return true;
    });
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
  std::vector<std::string_view> keys{"format",    "version",       "kind",  "slice",
                                     "log_scale", "surface_level", "tufts", "phase"};
  const std::vector<std::string_view> of_kinds = keys_of_kinds(map);
  keys.insert(keys.end(), of_kinds.begin(), of_kinds.end());
  keys.insert(keys.end(), {"shape_to_map", "detail", "inradius", "box"});
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

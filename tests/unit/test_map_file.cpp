// Map files: what is written is read back bit for bit, and whatever is wrong is named.

#include <fmt/format.h>
#include <unistd.h>

#include <catch2/catch_all.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/deflate.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/picture/picture.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"

using namespace qjulia;

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// A folder that goes away with the test.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("qjulia_map_file_" + std::to_string(::getpid()))) {
    fs::create_directory(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  fs::path operator/(const std::string& name) const { return path_ / name; }
  fs::path with_text(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name, std::ios::binary) << text;
    return path_ / name;
  }
  std::ptrdiff_t files() const {
    return std::distance(fs::directory_iterator(path_), fs::directory_iterator());
  }

 private:
  fs::path path_;
};

Map full_map() {
  Map map = test::random_map(40, 0.001, 0.6, 5);
  map.dynamics.slice = 0.1;
  map.dynamics.surface_level = -1.0 / 3;
  map.dynamics.phase = {0.5, -0.5, 0.5, 0.5};
  map.dynamics.factors[3].exponent = std::numeric_limits<double>::denorm_min();
  map.dynamics.factors[4].exponent = -0.0;
  map.frame.shape_to_map = {2.0 / 7, {0.1, 1e-17, -3}};
  map.frame.detail = 0.02;
  map.frame.inradius = 0.3;
  map.frame.box = Box{{-1, -2, -3}, {1, 2, 3.3}};
  map.provenance = json{{"mesh", "b\xc3\xa4r.obj"}, {"seed", 7}};
  return map;
}

/// The message `read_map` refuses the text with.
std::string refusal(const Folder& folder, const std::string& text) {
  const auto path = folder.with_text("bad.qjulia.json", text);
  try {
    read_map(path);
  } catch (const InputError& error) {
    CHECK_THAT(error.what(), Catch::Matchers::ContainsSubstring(path.string()));
    return error.what();
  }
  return "accepted";
}

bool same_bits(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

}  // namespace

TEST_CASE("a map file gives back every bit") {
  const Folder folder;
  const Map map = full_map();
  write_map(map, folder / "a.qjulia.json");
  const Map back = read_map(folder / "a.qjulia.json");
  CHECK(same_bits(back.dynamics.log_scale, map.dynamics.log_scale));
  CHECK(same_bits(back.dynamics.surface_level, map.dynamics.surface_level));
  CHECK(same_bits(back.dynamics.slice, map.dynamics.slice));
  CHECK(back.dynamics.phase == map.dynamics.phase);
  REQUIRE(back.dynamics.factors.size() == map.dynamics.factors.size());
  for (std::size_t k = 0; k < map.dynamics.factors.size(); ++k) {
    CHECK(back.dynamics.factors[k].center == map.dynamics.factors[k].center);
    CHECK(same_bits(back.dynamics.factors[k].exponent, map.dynamics.factors[k].exponent));
  }
  CHECK(same_bits(back.frame.shape_to_map.scale, map.frame.shape_to_map.scale));
  CHECK(back.frame.shape_to_map.translation == map.frame.shape_to_map.translation);
  CHECK(back.frame.detail == map.frame.detail);
  CHECK(back.frame.inradius == map.frame.inradius);
  CHECK(back.frame.box->low == map.frame.box->low);
  CHECK(back.frame.box->high == map.frame.box->high);
  CHECK(back.provenance.json() == map.provenance.json());
  // Written again, the same bytes; and nothing temporary is left.
  write_map(back, folder / "b.qjulia.json");
  std::stringstream a;
  std::stringstream b;
  a << std::ifstream(folder / "a.qjulia.json").rdbuf();
  b << std::ifstream(folder / "b.qjulia.json").rdbuf();
  CHECK(a.str() == b.str());
  CHECK(folder.files() == 2);
}

TEST_CASE("level, phase, detail, inradius, box and provenance may be left out") {
  json text = to_json(full_map());
  for (const char* key : {"surface_level", "phase", "detail", "inradius", "box", "provenance"}) {
    text.erase(key);
  }
  const Map map = map_from_json(text, "text");
  CHECK(map.dynamics.surface_level == 0);
  CHECK(map.dynamics.phase == Quaternion{1, 0, 0, 0});
  CHECK_FALSE(map.frame.detail);
  CHECK_FALSE(map.frame.inradius);
  CHECK_FALSE(map.frame.box);
  CHECK(map.provenance.json() == json::object());
}

TEST_CASE("a steepness needs version 2, and no map without one does") {
  const Folder folder;
  Map map = full_map();
  CHECK(to_json(map)["version"] == 1);
  CHECK_FALSE(to_json(map).contains("steepness"));
  map.layers.steepness = 2;
  CHECK(to_json(map)["version"] == 2);
  write_map(map, folder / "a.json");
  CHECK(read_map(folder / "a.json").layers.steepness == 2);
  json text = to_json(map);
  text["version"] = 1;
  CHECK_THAT(refusal(folder, text.dump()),
             Catch::Matchers::ContainsSubstring("unknown key \"steepness\""));
  text["version"] = 2;
  text["tufts"] = text["steepness"];
  CHECK_THAT(refusal(folder, text.dump()),
             Catch::Matchers::ContainsSubstring("unknown key \"tufts\""));
  text.erase("steepness");  // as files called it at first
  CHECK(map_from_json(text, "text").layers.steepness == 2);
  for (const double wrong : {0.5, -2.0, 101.0}) {
    text = to_json(map);
    text["steepness"] = wrong;
    CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring("steepness"));
  }
  text["steepness"] = "2";
  CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring("steepness"));
}

TEST_CASE("a map keeps how its shape stands, in version 2") {
  const Folder folder;
  Map map = full_map();
  map.provenance = json::object();
  CHECK(!to_json(map).contains("up"));
  CHECK(to_json(map)["version"] == 1);
  for (const UpAxis up :
       {UpAxis::x, UpAxis::y, UpAxis::z, UpAxis::minus_x, UpAxis::minus_y, UpAxis::minus_z}) {
    map.frame.up = up;
    CHECK(to_json(map)["version"] == 2);
    write_map(map, folder / "standing.qjulia.json");
    CHECK(read_map(folder / "standing.qjulia.json").frame.up == up);
  }
  json text = to_json(map);
  for (const json& wrong : {json("w"), json("auto"), json(""), json(1), json()}) {
    text["up"] = wrong;
    CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring("\"up\""));
  }
  text = to_json(map);
  text["version"] = 1;
  CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring("\"up\""));
}

TEST_CASE("a map keeps the diagonal that its shape had before it was turned, in version 2") {
  const Folder folder;
  Map map = full_map();
  CHECK_FALSE(to_json(map).contains("diagonal"));
  CHECK(map.frame.own_diagonal() == map.frame.box->diagonal());
  map.frame.diagonal = 2.0 / 3;
  CHECK(to_json(map)["version"] == 2);
  write_map(map, folder / "turned.qjulia.json");
  const Map back = read_map(folder / "turned.qjulia.json");
  CHECK(same_bits(*back.frame.diagonal, *map.frame.diagonal));
  CHECK(back.frame.own_diagonal() == map.frame.diagonal);
  json text = to_json(map);
  text["version"] = 1;
  CHECK_THAT(refusal(folder, text.dump()),
             Catch::Matchers::ContainsSubstring("unknown key \"diagonal\""));
  for (const json& wrong : {json(0), json(-1), json("1"), json(), json(1e200)}) {
    text = to_json(map);
    text["diagonal"] = wrong;
    CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring("diagonal"));
  }
}

TEST_CASE("portals make the way to a file and back, in version 2") {
  const Folder folder;
  Map map = full_map();
  map.layers.portals = {
      {{1, 0.5, -0.25}, 0.3, 4.5, {{0, 1, 2}, 33}, {0.1, 0.2, -0.3}, PortalMask::outside},
      {{-1, 1.0 / 3, 0}, 0.2, 2, {}, {0, 0, 0}, PortalMask::none},
      {{0, -2, 0}, 0.5, 1e-3, {}, {0, 0, 0}, PortalMask::inside}};
  CHECK(to_json(map)["version"] == 2);
  CHECK_FALSE(to_json(full_map()).contains("portals"));
  write_map(map, folder / "a.json");
  CHECK(read_map(folder / "a.json").layers.portals == map.layers.portals);
  json text = to_json(map);
  CHECK_FALSE(text["portals"][1].contains("rotation"));
  text["version"] = 1;
  CHECK_THAT(refusal(folder, text.dump()),
             Catch::Matchers::ContainsSubstring("unknown key \"portals\""));
}

TEST_CASE("portals that no map can have are refused, and the key is named") {
  const Folder folder;
  Map map = full_map();
  map.layers.portals.resize(2);
  for (Portal& portal : map.layers.portals) {
    portal.radius = 0.5;
    portal.scale = 4;
  }
  map.layers.portals[0].center.x() = 1;
  map.layers.portals[1].center.x() = -1;
  const auto refused = [&](const char* pointer, const json& value, const char* part) {
    json text = to_json(map);
    text[json::json_pointer(pointer)] = value;
    CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring(part));
  };
  refused("/portals/1/center", {1.4, 0, 0}, "portals[0] and portals[1] overlap");
  refused("/portals/0/center", {0.4, 0.1, 0}, "portals[0] holds the origin");
  refused("/portals/1/radius", 1, "portals[1] holds the origin");
  refused("/portals/1/center", {0, 29.6, 0}, "portals[1] reaches 30.1 from the origin");
  refused("/portals/1/center", {0, 1e6, 0}, "portals[1] reaches 1e+06 from the origin");
  for (const json& wrong : {json(0), json(-2), json(1e-4), json(1e7), json("4"), json()}) {
    refused("/portals/1/scale", wrong, "portals[1].scale");
  }
  for (const json& wrong : {json(0), json(-0.1), json(1e10), json::array({1})}) {
    refused("/portals/0/radius", wrong, "portals[0].radius");
  }
  for (const json& wrong : {json{0, 0, 0, 20}, json{1, 0, 0}, json{1, 0, 0, 1e12}, json(90)}) {
    refused("/portals/0/rotation", wrong, "portals[0].rotation");
  }
  refused("/portals/0/destination", {0, 0}, "portals[0].destination");
  refused("/portals/0/destination", {0, 0, 1e12}, "portals[0].destination");
  refused("/portals/0/center", {2e9, 0, 0}, "portals[0].center");
  refused("/portals/0/mask", "outer", "mask");
  refused("/portals/0/mask", 1, "portals[0].mask");
  refused("/portals/0/colour", 1, "unknown key \"portals[0].colour\"");
  refused("/portals", json::object(), "\"portals\" must be an array");
  refused("/portals/0", 3, "portals[0]");
  json text = to_json(map);
  for (const char* key : {"center", "radius", "scale"}) {
    text = to_json(map);
    text["portals"][1].erase(key);
    CHECK_THAT(refusal(folder, text.dump()),
               Catch::Matchers::ContainsSubstring(fmt::format("portals[1].{}", key)));
  }
  text = to_json(map);
  for (int i = 0; i < 70; ++i) text["portals"].push_back(text["portals"][0]);
  CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring("may have 64"));
}

TEST_CASE("a portal with a number that is not finite is refused") {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  for (int axis = 0; axis < 3; ++axis) {
    const auto refused = [&](auto vector_of, const char* key) {
      Map map = full_map();
      map.layers.portals = {
          {{1, 0.1, -0.2}, 0.5, 4, {{1, 2, 3}, 30}, {0.1, 0, 0.2}, PortalMask::none}};
      vector_of(map.layers.portals[0])[axis] = kNone;
      CHECK_THROWS_WITH(map.validate(), Catch::Matchers::ContainsSubstring(key));
    };
    refused(
        [](Portal & p) -> auto& { return p.center; }, "portals[0].center");
    refused(
        [](Portal & p) -> auto& { return p.destination; }, "portals[0].destination");
    refused(
        [](Portal & p) -> auto& { return p.rotation.axis; }, "portals[0].rotation");
  }
}

TEST_CASE("a paint makes the way to a file and back, and what is wrong with it is named") {
  const Folder folder;
  Map map = full_map();
  map.layers.paint = Paint{{5, 4, 6}, {-1.25, 1.0 / 3, 0.1}, 0.3, {}};
  for (std::size_t i = 0; i < 120; ++i) {
    map.layers.paint->shares.push_back(static_cast<std::uint8_t>(i * 41 % 256));
  }
  CHECK(to_json(map)["version"] == 2);
  CHECK_FALSE(to_json(full_map()).contains("paint"));
  write_map(map, folder / "a.json");
  CHECK(read_map(folder / "a.json").layers.paint == map.layers.paint);
  const auto refused = [&](const char* key, const json& value, const char* part) {
    json text = to_json(map);
    text["paint"][key] = value;
    CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring(part));
  };
  for (const json& wrong : {json{3, 4, 6}, json{5, 129, 6}, json{5, -4, 6}, json{100, 100, 100}}) {
    refused("cells", wrong, "\"cells\"");
  }
  refused("cells", {5, 4, 7}, "140 bytes");
  refused("cells", {5, 4, 5}, "100 bytes");
  refused("cells", {5, 4.5, 6}, "paint.cells");
  refused("cells", {5, 4}, "paint.cells");
  for (const json& wrong : {json(0), json(-1), json(1e10)}) refused("step", wrong, "paint.step");
  refused("step", "1", "paint.step");
  refused("origin", {0, 0, 1e10}, "paint.origin");
  refused("data", "AAA!", "base64");
  refused("data", "AAAA", "zlib");
  refused("colour", 1, "unknown key \"paint.colour\"");
  json text = to_json(map);
  text["version"] = 1;
  CHECK_THAT(refusal(folder, text.dump()),
             Catch::Matchers::ContainsSubstring("unknown key \"paint\""));
  for (const char* key : {"cells", "origin", "step", "data"}) {
    text = to_json(map);
    text["paint"].erase(key);
    CHECK_THAT(refusal(folder, text.dump()),
               Catch::Matchers::ContainsSubstring(fmt::format("paint.{}", key)));
  }
}

TEST_CASE("a noise makes the way to a file and back, and what is wrong with it is named") {
  const Folder folder;
  Map map = full_map();
  map.dynamics.versor =
      NoiseVersor{5, 7.25, 4294967295, NoiseValues::quaternions, {0.1, 0.2, -0.3}};
  CHECK(map.dynamics.kind() == "factors/noise");
  CHECK(to_json(map)["version"] == 2);
  write_map(map, folder / "a.json");
  CHECK(read_map(folder / "a.json").dynamics.versor == map.dynamics.versor);
  const auto refused = [&](const char* key, const json& value, const char* part) {
    json text = to_json(map);
    text["noise"][key] = value;
    CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring(part));
  };
  for (const json& wrong : {json(0), json(9), json(-1), json(1.5), json("2")}) {
    refused("octaves", wrong, "noise.octaves");
  }
  for (const json& wrong : {json(0), json(-3), json(1e5), json()}) {
    refused("scale", wrong, "noise.scale");
  }
  for (const json& wrong : {json(-1), json(0.5), json(4294967296), json(1e300)}) {
    refused("seed", wrong, "\"seed\"");
  }
  refused("values", "vector", "\"values\"");
  refused("origin", {1, 2}, "noise.origin");
  refused("origin", {1e12, 0, 0}, "noise.origin");
  refused("colour", 1, "unknown key \"noise.colour\"");
  json text = to_json(map);
  text["version"] = 1;
  CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring("needs version 2"));
  for (const char* key : {"octaves", "scale", "seed", "values", "origin"}) {
    text = to_json(map);
    text["noise"].erase(key);
    CHECK_THAT(refusal(folder, text.dump()),
               Catch::Matchers::ContainsSubstring(fmt::format("noise.{}", key)));
  }
}

TEST_CASE("a modulus of one kind and a versor of another make the way to a file and back") {
  const Folder folder;
  Map map = full_map();
  map.dynamics.modulus = QuadraticModulus{{0.1, 0.2, 0.3, 0.4}};
  CHECK(map.dynamics.kind() == "quadratic/factors");
  write_map(map, folder / "a.json");
  const Map back = read_map(folder / "a.json");
  CHECK(back.dynamics.modulus == map.dynamics.modulus);
  CHECK(back.dynamics.versor == map.dynamics.versor);
  CHECK(back.dynamics.factors.size() == map.dynamics.factors.size());
}

TEST_CASE(
    "a modulus and a versor that need factors and have none, or have them in vain, are refused") {
  Map map = full_map();
  map.dynamics.modulus = QuadraticModulus{};
  CHECK_NOTHROW(map.validate());
  map.dynamics.versor = QuadraticVersor{};
  CHECK_THROWS_WITH(map.validate(), Catch::Matchers::ContainsSubstring("factors"));
  map.dynamics.factors.clear();
  CHECK_NOTHROW(map.validate());
  map.dynamics.versor = QuadraticVersor{{1, 0, 0, 0}};
  CHECK_THROWS_WITH(map.validate(), Catch::Matchers::ContainsSubstring("c differs"));
  map.dynamics.versor = FactorsVersor{};
  CHECK_THROWS_WITH(map.validate(), Catch::Matchers::ContainsSubstring("no factors"));
}

TEST_CASE("a kind has one name") {
  for (const char* name :
       {"factors", "factors/factors", "quadratic/quadratic", "/", "quadratic/"}) {
    const Folder folder;
    json text = to_json(full_map());
    text["kind"] = name;
    CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring("kind"));
  }
}

TEST_CASE("every key that is missing is named") {
  const Folder folder;
  for (const char* key :
       {"format", "version", "kind", "slice", "log_scale", "factors", "shape_to_map"}) {
    json text = to_json(full_map());
    text.erase(key);
    CHECK_THAT(refusal(folder, text.dump()),
               Catch::Matchers::ContainsSubstring(fmt::format("\"{}\"", key)));
  }
  for (const char* pointer : {"/factors/7/center", "/factors/7/exponent", "/shape_to_map/scale",
                              "/shape_to_map/translation"}) {
    json text = to_json(full_map());
    const json::json_pointer at(pointer);
    text.at(at.parent_pointer()).erase(at.back());
    CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring(at.back()));
  }
}

TEST_CASE("every value that is wrong is named") {
  struct Wrong {
    const char* pointer;
    json value;
    const char* named;
  };
  const auto wrong = GENERATE(values<Wrong>({
      {"/format", "stl", "format"},
      {"/format", 3, "format"},
      {"/version", 3, "version"},
      {"/version", 0, "version"},
      {"/version", "1", "version"},
      {"/version", 1.5, "version"},
      {"/kind", "quadratic", "factors"},
      {"/kind", "cubic", "cubic"},
      {"/slice", nullptr, "slice"},
      {"/slice", 2e9, "slice"},
      {"/log_scale", "0", "log_scale"},
      {"/log_scale", true, "log_scale"},
      {"/log_scale", 1e200, "log_scale"},
      {"/phase", json::array({1, 0, 0}), "phase"},
      {"/phase", json::array({1, 1, 0, 0}), "phase"},
      {"/phase/2", "0", "phase[2]"},
      {"/factors", json::array(), "factors"},
      {"/factors", json::object(), "factors"},
      {"/factors/3", 1, "factors[3]"},
      {"/factors/3/center", json::array({1, 2, 3}), "factors[3].center"},
      {"/factors/3/center/1", nullptr, "factors[3].center[1]"},
      {"/factors/3/center/1", -2e9, "factors[3].center"},
      {"/factors/3/exponent", json::array({1}), "factors[3].exponent"},
      {"/shape_to_map", json::array(), "shape_to_map"},
      {"/shape_to_map/scale", 0, "shape_to_map.scale"},
      {"/shape_to_map/scale", -1, "shape_to_map.scale"},
      {"/shape_to_map/scale", 1e-300, "shape_to_map.scale"},
      {"/shape_to_map/translation", json::array({1, 2}), "shape_to_map.translation"},
      {"/detail", -0.1, "detail"},
      {"/inradius", 0, "inradius"},
      {"/box", json::array({1, 2, 3}), "box"},
      {"/box/1", json::array({-1, -2, -3}), "box"},
      {"/provenance", json::array(), "provenance"},
      {"/sliec", 0, "sliec"},
      {"/factors/3/power", 0, "factors[3].power"},
  }));
  const Folder folder;
  json text = to_json(full_map());
  text[json::json_pointer(wrong.pointer)] = wrong.value;
  INFO(wrong.pointer << " = " << wrong.value);
  CHECK_THAT(refusal(folder, text.dump()), Catch::Matchers::ContainsSubstring(wrong.named));
}

TEST_CASE("text that is no JSON, or not finite, is refused") {
  const Folder folder;
  const std::string good = to_json(full_map()).dump();
  for (const std::size_t length :
       {std::size_t{0}, std::size_t{1}, good.size() / 2, good.size() - 1}) {
    CHECK_THAT(refusal(folder, good.substr(0, length)), Catch::Matchers::ContainsSubstring("JSON"));
  }
  for (const char* number : {"NaN", "Infinity", "1e999", "-1e999"}) {
    std::string text = good;
    const std::string key = "\"slice\":";
    const auto at = text.find(key) + key.size();
    text.replace(at, text.find(',', at) - at, number);
    CHECK_THAT(refusal(folder, text), Catch::Matchers::ContainsSubstring("JSON"));
  }
  CHECK_THAT(refusal(folder, good + "{}"), Catch::Matchers::ContainsSubstring("JSON"));
  CHECK_THAT(refusal(folder, "[]"), Catch::Matchers::ContainsSubstring("object"));
  CHECK_THAT(refusal(folder, std::string("\0\xff\xfe random", 10)),
             Catch::Matchers::ContainsSubstring("JSON"));
  CHECK_THAT(refusal(folder, std::string(1'000'000, '[')),
             Catch::Matchers::ContainsSubstring("nested"));
}

TEST_CASE("a key that stands twice is refused, wherever it is") {
  const Folder folder;
  const std::string good = to_json(full_map()).dump();
  CHECK_THAT(refusal(folder, R"({"slice": 5, )" + good.substr(1)),
             Catch::Matchers::ContainsSubstring("\"slice\" twice"));
  std::string factor = good;
  factor.replace(factor.find("\"exponent\":"), 0, R"("exponent": 3, )");
  CHECK_THAT(refusal(folder, factor), Catch::Matchers::ContainsSubstring("\"exponent\" twice"));
}

TEST_CASE("files that cannot be maps are refused before they fill the memory") {
  const Folder folder;
  CHECK_THROWS_WITH(read_map(folder / "none.json"),
                    Catch::Matchers::ContainsSubstring("none.json"));
  CHECK_THROWS_AS(read_map(fs::temp_directory_path()), InputError);
  const auto huge = folder.with_text("huge.json", "{");
  fs::resize_file(huge, std::uintmax_t{1} << 40U);  // sparse
  CHECK_THROWS_WITH(read_map(huge), Catch::Matchers::ContainsSubstring("64 MiB at most"));
  CHECK_THROWS_WITH(read_map("/dev/zero"), Catch::Matchers::ContainsSubstring("a device"));
}

TEST_CASE("a map that is not valid, or a folder that is not there, leaves no file") {
  const Folder folder;
  Map map = full_map();
  map.dynamics.factors[0].exponent = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_AS(write_map(map, folder / "a.json"), InputError);
  CHECK_THROWS_AS(write_map(full_map(), folder / "none/a.json"), OutputError);
  CHECK(folder.files() == 0);
}

TEST_CASE("any bytes may stand in a file name of the provenance") {
  const Folder folder;
  Map map = full_map();
  map.provenance.set("mesh", "\xff\xfe.obj");
  write_map(map, folder / "a.json");
  CHECK_NOTHROW(read_map(folder / "a.json"));
}

TEST_CASE("what is wrong with a file is said by line, not by its bytes") {
  const Folder folder;
  const auto path = folder.with_text("a.qjulia.json", "{\n\"format\": \"\x01\xff\x02");
  REQUIRE_THROWS_WITH(read_map(path), Catch::Matchers::ContainsSubstring("valid JSON (line 2)") &&
                                          !Catch::Matchers::ContainsSubstring("\x01") &&
                                          !Catch::Matchers::ContainsSubstring("\xff"));
}

namespace {

/// 4 bytes, the highest or the lowest first.
std::string four_bytes(std::size_t value, bool is_highest_first) {
  std::string bytes;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    bytes.push_back(static_cast<char>((value >> shift) & 0xFFU));
  }
  if (!is_highest_first) std::reverse(bytes.begin(), bytes.end());
  return bytes;
}

Image grey_image() { return {2, 2, std::vector<std::uint8_t>(12, 128)}; }

std::string picture_with(const std::string& packed) {
  return png_bytes(grey_image(), {}, Packing::small, packed);
}

/// A header, a description that says nothing, and one more chunk.
std::string scene_with(const std::string& type, const std::string& data) {
  const auto chunk = [](const std::string& of, const std::string& bytes) {
    return four_bytes(bytes.size(), false) + of + bytes;
  };
  const std::string chunks = chunk("JSON", "{} ") + chunk(type, data);
  return "glTF" + four_bytes(2, false) + four_bytes(12 + chunks.size(), false) + chunks;
}

void check_carrier_refused(const Folder& folder, const std::string& name, const std::string& bytes,
                           const std::string& why) {
  CAPTURE(name);
  const auto path = folder.with_text(name, bytes);
  CHECK_THROWS_WITH(read_map(path), Catch::Matchers::ContainsSubstring(path.string()) &&
                                        Catch::Matchers::ContainsSubstring(why));
}

}  // namespace

TEST_CASE("a picture and a scene give back the map that they hold") {
  const Folder folder;
  const Map map = full_map();
  const std::string packed = packed_map(map);
  write_png(grey_image(), folder / "a.png", {{"Software", "qjulia"}}, packed);
  MeshFileOptions options;
  options.map = packed;
  write_mesh(shapes::sphere(2), folder / "a.glb", options);
  for (const char* name : {"a.png", "a.glb"}) {
    CHECK(holds_map(folder / name));
    CHECK(to_json(read_map(folder / name)) == to_json(map));
  }
  CHECK(read_mesh(folder / "a.glb").triangles.size() == shapes::sphere(2).triangles.size());
  // Other programs may move the chunk behind the pixels.
  std::string png = picture_with(packed);
  const std::size_t at = png.find("qjMp") - 4, size = packed.size() + 12;
  const std::string chunk = png.substr(at, size);
  png.erase(at, size);
  CHECK_FALSE(holds_map(folder.with_text("none.png", png)));
  png.insert(png.find("IEND") - 4, chunk);
  CHECK(to_json(read_map(folder.with_text("moved.png", png))) == to_json(map));
  CHECK_FALSE(holds_map(folder / "a.qjulia.json"));
}

TEST_CASE("a long map takes several chunks of a picture") {
  const Folder folder;
  Map map = full_map();
  std::string noise;
  for (std::size_t i = 0; noise.size() < (std::size_t{3} << 20U); ++i) {
    noise += fmt::format("{:x}", i * 0x9E3779B97F4A7C15U);
  }
  map.provenance = json{{"noise", noise}};
  const std::string png = picture_with(packed_map(map));
  CHECK(png.find("qjMp", png.find("qjMp") + 4) != std::string::npos);
  CHECK(to_json(read_map(folder.with_text("long.png", png))) == to_json(map));
}

TEST_CASE("pictures and scenes without a whole map are refused with the file and the reason") {
  const Folder folder;
  const std::string packed = packed_map(full_map());
  const std::string png = picture_with(packed), glb = scene_with("QJMP", packed);
  check_carrier_refused(folder, "none.png", picture_with({}), "holds no map");
  check_carrier_refused(folder, "none.glb", scene_with("BIN", "four"), "holds no map");
  check_carrier_refused(folder, "text.png", "a text", "not a PNG");
  check_carrier_refused(folder, "text.glb", "a text", "not a .glb");
  check_carrier_refused(folder, "empty.png", "", "not a PNG");
  check_carrier_refused(folder, "cut.png", png.substr(0, png.find("qjMp") + 20), "is cut off");
  check_carrier_refused(folder, "ends.png", picture_with({}).substr(0, 50), "is cut off");
  check_carrier_refused(folder, "cut.glb", glb.substr(0, glb.size() - 20), "is cut off");
  check_carrier_refused(folder, "short.png", picture_with("abc"), "damaged");
  check_carrier_refused(folder, "half.png", picture_with(packed.substr(0, packed.size() / 2)),
                        "damaged");
  std::string changed = packed;
  changed[changed.size() / 2] ^= 1;
  check_carrier_refused(folder, "changed.glb", scene_with("QJMP", changed), "damaged");
  std::string large = png;
  large.replace(large.find("qjMp") - 4, 4, "\xff\xff\xff\xff");
  check_carrier_refused(folder, "large.png", large, "more than 64 MiB");
  // What says how large it is, and what lies about it.
  const std::string zeros = base::deflated(std::string(std::size_t{80} << 20U, ' '));
  const auto bomb = [&](std::size_t size) {
    return four_bytes(size, true) + four_bytes(zeros.size(), true) + zeros;
  };
  check_carrier_refused(folder, "bomb.png", picture_with(bomb(std::size_t{80} << 20U)),
                        "64 MiB at most");
  check_carrier_refused(folder, "lie.png", picture_with(bomb(1000)), "damaged");
  const std::string text = base::deflated("[1]");
  check_carrier_refused(folder, "list.png",
                        picture_with(four_bytes(3, true) + four_bytes(text.size(), true) + text),
                        "list.png");
}

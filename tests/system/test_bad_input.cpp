/// Input that cannot be used: exit code 2, a message naming the file or option, no output left.

#include <catch2/catch_all.hpp>
#include <functional>
#include <nlohmann/json.hpp>
#include <random>

#include "obj_text.hpp"
#include "original_bytes.hpp"
#include "process.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using qjulia::test::ProcessResult;
using qjulia::test::TemporaryFolder;
using Arguments = std::vector<std::string>;

namespace {

std::string random_bytes(std::size_t count) {
  std::mt19937 random(7);
  std::string bytes(count, '\0');
  for (char& b : bytes) b = static_cast<char>(random() & 0xFFU);
  return bytes;
}

nlohmann::json good_map() {
  return {{"format", "qjulia-map"},
          {"version", 1},
          {"kind", "rational"},
          {"slice", 0.0},
          {"log_scale", 0.0},
          {"surface_level", 0.0},
          {"phase", {1, 0, 0, 0}},
          {"factors", {{{"center", {0, 0, 0, 0}}, {"exponent", 3.0}}}},
          {"shape_to_map", {{"scale", 1.0}, {"translation", {0, 0, 0}}}},
          {"detail", 0.02},
          {"inradius", 1.0},
          {"box", {{-1, -1, -1}, {1, 1, 1}}},
          {"provenance", nlohmann::json::object()}};
}

std::string map_with(const std::function<void(nlohmann::json&)>& change) {
  nlohmann::json map = good_map();
  change(map);
  return map.dump();
}

struct BadFile {
  std::string name;
  std::string bytes;
};

std::vector<BadFile> bad_meshes() {
  return {
      {"empty.obj", ""},
      {"empty.ply", ""},
      {"empty.stl", ""},
      {"empty.off", ""},
      {"no_faces.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n"},
      {"out_of_range.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 7\n"},
      {"out_of_range.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 9\n"},
      {"nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\n"},
      {"one_place.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n"},
      {"random.ply", random_bytes(5000)},
      {"random.stl", random_bytes(5000)},
      {"short.ply",
       "ply\nformat binary_little_endian 1.0\nelement vertex 100000000\nproperty float x\nproperty "
       "float y\nproperty float z\nelement face 1\nproperty list uchar int "
       "vertex_indices\nend_header\n1234"},
  };
}

std::vector<BadFile> bad_maps() {
  const std::string good = good_map().dump();
  return {
      {"empty.qjulia.json", ""},
      {"random.qjulia.json", random_bytes(3000)},
      {"truncated.qjulia.json", good.substr(0, good.size() / 2)},
      {"version.qjulia.json", map_with([](auto& m) { m["version"] = 99; })},
      {"format.qjulia.json", map_with([](auto& m) { m["format"] = "other"; })},
      {"type.qjulia.json", map_with([](auto& m) { m["log_scale"] = "zero"; })},
      {"factors.qjulia.json", map_with([](auto& m) { m["factors"] = nlohmann::json::array(); })},
      {"missing_key.qjulia.json", map_with([](auto& m) { m.erase("factors"); })},
      {"array.qjulia.json", "[1, 2, 3]"},
  };
}

/// Runs and checks all that holds for every refusal. `word` must be in the message.
void check_refused(const TemporaryFolder& folder, const Arguments& arguments,
                   const std::string& word, int exit_code = 2) {
  const auto before = folder.names().size();
  const ProcessResult result =
      qjulia::test::run_command(arguments, {.timeout = std::chrono::seconds(30)});
  CAPTURE(arguments, result.err);
  CHECK(result.exit_code == exit_code);
  CHECK_THAT(result.err, ContainsSubstring(word));
  CHECK(result.out.empty());
  CHECK(folder.names().size() == before);
}

}  // namespace

TEST_CASE("bad meshes are refused") {
  const TemporaryFolder folder;
  for (const auto& [name, bytes] : bad_meshes()) {
    const std::string file = folder.file(name, bytes);
    check_refused(folder, {"fit", file, "-o", folder / "out.qjulia.json"}, name);
    check_refused(folder, {"info", file}, name);
  }
  check_refused(folder, {"render", folder / "empty.obj", "-o", folder / "out.png"}, "empty.obj");
  check_refused(folder, {"fit", folder / "absent.obj", "-o", folder / "out.qjulia.json"},
                "absent.obj");
  check_refused(folder, {"info", folder / "absent.obj"}, "absent.obj");
  check_refused(folder, {"fit", folder.file("mesh.txt", "hello"), "-o", folder / "out.json"},
                "mesh.txt");
}

TEST_CASE("bad maps are refused") {
  const TemporaryFolder folder;
  for (const auto& [name, bytes] : bad_maps()) {
    const std::string file = folder.file(name, bytes);
    check_refused(folder, {"surface", file, "-o", folder / "out.ply"}, name);
    check_refused(folder, {"render", file, "-o", folder / "out.png"}, name);
    check_refused(folder, {"info", file}, name);
  }
  const std::string absent = folder / "absent.qjulia.json";
  check_refused(folder, {"surface", absent, "-o", folder / "out.ply"}, "absent.qjulia.json");
  check_refused(folder, {"render", absent, "-o", folder / "out.png"}, "absent.qjulia.json");
  check_refused(folder, {"info", absent}, "absent.qjulia.json");
}

TEST_CASE("a message about a file without a map says what the file is and what reads it") {
  const TemporaryFolder folder;
  for (const auto& [name, what] :
       {std::pair{"a.usda", "a mesh for other programs, which no command reads"},
        {"a.vdb", "a volume for other programs"},
        {"a.npy", "a field for other programs"},
        {"a.frag", "a formula for other programs"},
        {"a.toml", "'qjulia batch run' reads manifests"},
        {"a.f3d", "a distance field of the papers' programs: 'qjulia convert'"},
        {"a.o3d", "a map of the papers' programs: 'qjulia convert'"}}) {
    const std::string file = folder.file(name, "#usda 1.0\n");
    check_refused(folder, {"info", file}, what);
    check_refused(folder, {"render", file, "-o", folder / "out.png"}, what);
  }
}

TEST_CASE("bad original maps are refused") {
  const TemporaryFolder folder;
  const std::string good = qjulia::test::original_bytes(qjulia::test::small_original());
  const std::vector<BadFile> files = {{"empty.o3d", ""},
                                      {"zeros.o3d", std::string(4096, '\0')},
                                      {"ones.o3d", std::string(4096, '\xff')},
                                      {"random.o3d", random_bytes(4096)},
                                      {"truncated.o3d", good.substr(0, good.size() - 1)},
                                      {"half.o3d", good.substr(0, good.size() / 2)}};
  for (const auto& [name, bytes] : files) {
    check_refused(folder, {"convert", folder.file(name, bytes), folder / "out.qjulia.json"}, name);
  }
  check_refused(folder, {"convert", folder / "absent.o3d", folder / "out.qjulia.json"},
                "absent.o3d");
  check_refused(folder, {"convert", folder / "", folder / "out.qjulia.json"}, "folder");
  check_refused(folder, {"convert", folder.file("good.o3d", good), folder / "out.ply"}, "out.ply");
}

TEST_CASE("bad option values are refused") {
  const TemporaryFolder folder;
  const std::string mesh =
      folder.file("sphere.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const std::string map = folder.file("map.qjulia.json", good_map().dump());
  check_refused(folder, {"morph", map, map, "-o", folder / "steps", "--flicker-cells", "3"},
                "--flicker-cells: 3 is out of range; give 8 to 256");
  const auto convert = [&](const std::vector<std::string>& options, const std::string& what) {
    std::vector<std::string> words{"convert", map, folder / "out.qjulia.json"};
    words.insert(words.end(), options.begin(), options.end());
    check_refused(folder, words, what);
  };
  convert({"--target-resolution", "64"}, "--target-resolution: there is no target");
  convert({"--versor-from", map, "--factors-at-most", "9"}, "--factors-at-most: it does not go");
  convert({"--versor-from", map, "--phase", "0", "1", "0", "0"}, "--phase: it turns the versor");
  convert({"--versor-from", map, "--order-seed", "2"}, "--order-seed: it turns the versor");
  const auto fit = [&](const std::string& option, const std::string& value) {
    check_refused(folder, {"fit", mesh, "-o", folder / "out.qjulia.json", option, value},
                  option.substr(2));
  };
  for (const char* value : {"0", "-3", "1e99", "7.5", "many", ""}) fit("--factors", value);
  for (const char* value : {"nan", "-1", "0", "inf", "2", "x"}) fit("--detail", value);
  for (const char* value : {"-5", "nan", "soon"}) fit("--time-limit", value);
  for (const char* value : {"-1", "1e99"}) fit("--max-evaluations", value);
  fit("--seed", "-1");
  fit("--unknowns", "some");
  fit("--precision", "half");
  fit("--schedule", "no such schedule");

  for (const char* value : {"drift", "drift=", "drift=0:1", "drift=0:1:1", "drift=0:1:1e9",
                            "drift=0:nan:3", "colour=0:1:3", "detail=0.02,0", "detail=0.02,0.2",
                            "iterations=1,2.5", "order-seed=-1,2"}) {
    check_refused(folder, {"render", map, "-o", folder / "out.png", "--sweep", value}, "");
  }
  check_refused(folder, {"render", mesh, "-o", folder / "out.png", "--sweep", "drift=0,1"},
                "drift");
  check_refused(folder, {"render", map, "-o", folder / "out.png", "--turntable", "1"}, "turntable");

  const auto surface = [&](const std::string& option, const Arguments& values) {
    Arguments arguments = {"surface", map, "-o", folder / "out.ply", option};
    arguments.insert(arguments.end(), values.begin(), values.end());
    check_refused(folder, arguments, option.substr(2));
  };
  for (const char* value : {"nan", "-1", "0", "inf", "1", "0.11", "0.00009"}) {
    surface("--detail", {value});
  }
  for (const char* value : {"0", "-4", "1e99"}) surface("--resolution", {value});
  for (const char* value : {"0", "17", "-1"}) surface("--iterations", {value});
  surface("--order-seed", {"-1"});
  surface("--metres", {"0"});
  surface("--metres", {"1", "--millimetres", "1"});
  surface("--up", {"w"});
  surface("--material", {"gold"});
  surface("--palette", {"ember"});  // what a mesh without colours has none of
  surface("--palette", {"ember", "--material", "clay"});
  surface("--palette", {"nosuch", "--material", "trap"});
  surface("--range", {"0,1"});
  surface("--range", {"1,0", "--material", "trap"});
  for (const char* type : {"stl", "off"}) {
    const std::string out = folder / (std::string("out.") + type);
    check_refused(folder, {"surface", map, "-o", out, "--material", "trap"},
                  std::string(".") + type + " files hold no colours");
  }
  surface("--phase", {"1", "0", "0"});
  surface("--phase", {"0", "0", "0", "0"});
  surface("--phase", {"1", "0", "nan", "0"});
  surface("--slice", {"inf"});
  surface("--drift", {"nan"});
  surface("--drift", {"50"});
  surface("--translate", {"0", "0"});
  surface("--translate", {"0", "inf", "0"});
  for (const char* value : {"0", "-1", "nan"}) surface("--scale", {value});
  surface("--box", {"0", "0", "0", "1", "1"});
  surface("--box", {"0", "0", "0", "1", "1", "nan"});
  surface("--box", {"0", "0", "0", "1", "1", "-1"});

  const auto sample = [&](const std::string& option, const std::string& value) {
    check_refused(folder, {"sample", map, "-o", folder / "out.npy", option, value},
                  option.substr(2));
  };
  for (const char* value : {"0", "-4", "1e99", "9000"}) sample("--resolution", value);
  for (const char* value : {"0", "-4", "nan", "inf", "1e10"}) sample("--escape", value);
  surface("--escape", {"1e10"});
  sample("--precision", "half");
  sample("--iterations", "17");

  const auto render = [&](const std::string& option, const std::string& value) {
    check_refused(folder, {"render", map, "-o", folder / "out.png", option, value},
                  option.substr(2));
  };
  for (const char* value : {"0x10", "12", "12x", "-3x4", "1e9x3", "99999999999x2"}) {
    render("--size", value);
  }
  for (const char* value : {"nan", "-1"}) render("--detail", value);
  for (const char* value : {"nan", "0", "-1"}) render("--zoom", value);
  for (const char* value : {"red", "ff80", "", "#gggggg"}) render("--background", value);
  for (const char* value : {"mud", "ff8000,", "ff8000,00ff00"}) render("--palette", value);
  check_refused(folder,
                {"render", map, "-o", folder / "out.png", "--material", "trap", "--palette", "f80"},
                "--palette");
  for (const Arguments& given :
       {Arguments{"--range", "0,1"}, Arguments{"--material", "trap", "--range", "1,0"}}) {
    Arguments all = {"render", map, "-o", folder / "out.png"};
    all.insert(all.end(), given.begin(), given.end());
    check_refused(folder, all, "range");
  }
  render("--up", "w");
  render("--up", "+z");
  render("--samples", "0");
  for (const char* value : {"", "drift", "drift=", "drift=0:1:1", "up=1,2"})
    render("--sweep", value);
  check_refused(folder, {"render", mesh, "-o", folder / "out.png", "--detail", "0.01"}, "--detail");
  check_refused(folder, {"render", mesh, "-o", folder / "out.png", "--iterations", "6"},
                "--iterations");
}

TEST_CASE("options that would do nothing are refused") {
  const TemporaryFolder folder;
  const std::string mesh =
      folder.file("sphere.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  check_refused(folder, {"info", mesh, "--nozzle", "0.6"}, "--printable");
  check_refused(folder, {"profile", "measure", "--tolerance", "0.1"}, "--baseline");
  for (const char* option : {"--sample-points", "--factors", "--repeats"}) {
    check_refused(folder, {"profile", "scaling", option, "100"}, option);
  }
  const std::string map = folder.file("map.qjulia.json", good_map().dump());
  for (const char* option : {"--azimuth", "--zoom"}) {
    check_refused(folder, {"compare", map, mesh, option, "2"}, "--picture");
  }
  check_refused(folder, {"compare", map, mesh, "--size", "64x48"}, "--picture");
  check_refused(
      folder,
      {"fit", mesh, "-o", folder / "out.qjulia.json", "--factors", "50", "--max-factors", "100"},
      "--max-factors: it bounds the number that 'auto' chooses, and 50 factors are asked for");
  for (const std::string name : {"detail", "azimuth"}) {
    check_refused(folder,
                  {"render", map, "-o", folder / "out.png", "--sweep", name + "=0.01,0.02",
                   "--" + name, "0.03"},
                  "leave out --" + name);
  }
}

TEST_CASE("names of outputs are checked before the work") {
  const TemporaryFolder folder;
  const std::string mesh =
      folder.file("sphere.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const std::string map = folder.file("map.qjulia.json", good_map().dump());
  check_refused(folder, {"surface", map, "-o", folder / "out.txt"}, "out.txt");
  check_refused(folder, {"render", map, "-o", folder / "out.bmp"}, "out.bmp");
  check_refused(folder, {"sample", map, "-o", folder / "out.raw"}, "out.raw");
  check_refused(folder, {"fit", mesh, "-o", mesh}, "sphere.obj");
  check_refused(folder, {"fit", mesh, "-o", folder / "out.png"}, "has the name of a picture");

  const std::string nowhere = folder / "no/such/folder/out";
  check_refused(folder, {"fit", mesh, "-o", nowhere + ".qjulia.json"}, "no/such/folder", 1);
  check_refused(folder, {"surface", map, "-o", nowhere + ".ply"}, "no/such/folder", 1);
  check_refused(folder, {"render", map, "-o", nowhere + ".png"}, "no/such/folder", 1);
  std::filesystem::create_directory(folder / "taken.png");
  check_refused(folder, {"render", map, "-o", folder / "taken.png"}, "taken.png", 1);
}

TEST_CASE("an unknown device is exit code 3 everywhere") {
  const TemporaryFolder folder;
  const std::string mesh =
      folder.file("sphere.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const std::string map = folder.file("map.qjulia.json", good_map().dump());
  const auto check = [&](Arguments arguments) {
    arguments.insert(arguments.end(), {"--device", "no such device"});
    check_refused(folder, arguments, "no such device", 3);
  };
  check({"fit", mesh, "-o", folder / "out.qjulia.json"});
  check({"surface", map, "-o", folder / "out.ply"});
  check({"render", map, "-o", folder / "out.png"});
  check({"sample", map, "-o", folder / "out.npy"});
  check({"compare", map, mesh});
  check({"info", map});
}

TEST_CASE("numbers are read to the last character, and none is replaced") {
  const TemporaryFolder folder;
  const std::string mesh =
      folder.file("sphere.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const auto fit = [&](const std::string& option, const std::string& value,
                       const std::string& message) {
    check_refused(folder, {"fit", mesh, "-o", folder / "out.qjulia.json", option, value},
                  option + ": " + message);
  };
  fit("--seed", "18446744073709551616", "18446744073709551616 is out of range");
  fit("--max-evaluations", "", "'' is not a whole number");
  fit("--time-limit", "", "'' is not a number");
  fit("--factors", "56x", "'56x' is not a whole number");
  fit("--detail", "0,02", "'0,02' is not a number");
}

TEST_CASE("a negative number may begin with a point") {
  const TemporaryFolder folder;
  const std::string map = folder.file("map.qjulia.json", good_map().dump());
  const auto result = qjulia::test::run_command({"render", map, "-o", folder / "out.png", "--size",
                                                 "8x6", "--phase", ".9", "-.1", "0", "0", "--box",
                                                 "-.9", "-.8", "-.7", ".9", ".8", ".7", "--json"});
  CAPTURE(result.err);
  REQUIRE(result.exit_code == 0);
  const auto how = nlohmann::json::parse(result.out)["made_with"]["job"]["options"];
  CHECK(how["phase"] == nlohmann::json({0.9, -0.1, 0, 0}));
  CHECK(how["box"] == nlohmann::json({-0.9, -0.8, -0.7, 0.9, 0.8, 0.7}));
}

TEST_CASE("info tells what it cannot measure of a mesh, and the rest") {
  const TemporaryFolder folder;
  const std::string needle = folder.file(
      "needle.obj",
      "v 0 0 0\nv 1e-4 0 0\nv 0 1e-4 0\nv 0 0 10\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n");
  const ProcessResult told = qjulia::test::run_command(
      {"info", needle, "--measure-roughness", "--json", "--device", "cpu"});
  CAPTURE(told.err);
  REQUIRE(told.exit_code == 0);
  const auto json = nlohmann::json::parse(told.out);
  CHECK(json["porosity"].is_null());
  CHECK(json["triangles"] == 4);
  CHECK_THAT(
      qjulia::test::run_command({"info", needle, "--measure-roughness", "--device", "cpu"}).out,
      ContainsSubstring("porosity      not measured: the mesh fills less than a cell"));
}

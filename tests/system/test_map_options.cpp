/// The options that turn a map, on whole commands.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "original_bytes.hpp"
#include "process.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;
using Arguments = std::vector<std::string>;

namespace {

/// Two roots and a pole: small, and not symmetric.
qjulia::Map small_map() {
  qjulia::Map map;
  map.dynamics.factors = {
      {{0.3, 0.1, 0, 0.1}, 2.5}, {{-0.4, 0, 0.2, 0.1}, 2}, {{0.9, 0.8, -0.3, 0.2}, -0.7}};
  map.frame.detail = 0.02;
  map.frame.inradius = 0.5;
  map.frame.box = qjulia::Box{{-1, -1, -1}, {1, 1, 1}};
  return map;
}

struct MapFile {
  TemporaryFolder folder;
  std::string file = folder / "small.qjulia.json";
  MapFile() { qjulia::write_map(small_map(), file); }

  /// The mesh, as text, made with these options: the file without the comment that tells them.
  std::string surface(const Arguments& more) const {
    const std::string text = surface_file(more, "out.obj");
    return text.substr(text.find('\n'));
  }

  std::string surface_file(const Arguments& more, const std::string& name) const {
    const std::string mesh = folder / name;
    Arguments arguments = {"surface", file,           "-o", mesh,       "--resolution",
                           "24",      "--iterations", "1",  "--device", "cpu"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto result = run_command(arguments);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return read_text(mesh);
  }
};

/// How a .ply says that it was made.
json ply_note(const std::string& text) {
  std::istringstream ply(text);
  std::string line, note;
  for (int number = 0; std::getline(ply, line) && line.rfind("element", 0) != 0; ++number) {
    if (number > 2) note += line.substr(std::strlen("comment "));
  }
  return json::parse(note);
}

}  // namespace

TEST_CASE("a map whose exponents bound no set is named as such, once") {
  const TemporaryFolder folder;
  const std::string file = folder / "open.qjulia.json";
  qjulia::Map map = small_map();
  map.dynamics.factors[0].exponent = -2.5;
  qjulia::write_map(map, file);
  const std::string warning = "exponents sum to -1.2, and the iterated set is bounded only if";
  const auto info = run_command({"info", file, "--device", "cpu", "--json"});
  REQUIRE(info.exit_code == 0);
  CHECK_THAT(json::parse(info.out)["warnings"].at(0).get<std::string>(),
             ContainsSubstring(warning));
  const auto count_in = [&](const std::string& text) {
    int count = 0;
    for (auto at = text.find(warning); at != std::string::npos; at = text.find(warning, at + 1)) {
      ++count;
    }
    return count;
  };
  const auto picture = run_command({"render", file, "-o", folder / "open.png", "--size", "32x24",
                                    "--device", "cpu", "--sweep", "slice=0:0.1:2"});
  INFO(picture.err);
  CHECK(picture.exit_code == 0);
  CHECK(count_in(picture.err) == 1);
  const auto first_iterate = run_command({"render", file, "-o", folder / "first.png", "--size",
                                          "32x24", "--device", "cpu", "--iterations", "1"});
  CHECK(count_in(first_iterate.err) == 0);
}

TEST_CASE("a mesh file tells how it was made, where its format has room") {
  const MapFile map;
  const auto check = [](const json& how) {
    const json& options_given = how["job"]["options"];
    CHECK(options_given["map"] == "small.qjulia.json");
    CHECK(options_given["drift"] == 0.25);
    CHECK(options_given["precision"] == "double");
    CHECK(options_given["resolution"] == 24);
  };
  const Arguments options = {"--drift", "0.25", "--precision", "double"};
  const std::string obj = map.surface_file(options, "a.obj");
  check(json::parse(obj.substr(2, obj.find('\n') - 2)));

  Arguments largest = options;
  largest.push_back("--largest-component");
  for (const auto& more : {options, largest}) {
    check(ply_note(map.surface_file(more, "a.ply")));
    CHECK(qjulia::read_mesh(map.folder / "a.ply").triangles.size() > 100);
  }

  const std::string glb = map.surface_file(options, "a.glb");
  const std::size_t begin = 20;
  check(json::parse(
      json::parse(glb.substr(begin, glb.find("BIN") - 4 - begin))["asset"]["extras"]["made_with"]
          .get<std::string>()));
  const auto info = run_command({"info", map.folder / "a.glb", "--json"});
  REQUIRE(info.exit_code == 0);
  check(json::parse(info.out)["made_with"]);
  CHECK(json::parse(info.out)["triangles"].get<int>() > 100);
}

TEST_CASE("a mesh has the colours of a material, and its file says which") {
  const MapFile map;
  const Arguments options = {"--material", "trap", "--palette", "ember"};
  const std::string ply = map.surface_file(options, "colored.ply");
  const std::size_t end = ply.find("end_header\n") + 11;
  const std::string header = ply.substr(0, end);
  CHECK_THAT(header, ContainsSubstring("uchar red") && ContainsSubstring("float nx"));
  const std::size_t vertices = std::stoul(header.substr(header.find("element vertex ") + 15));
  std::set<std::string> colors;
  for (std::size_t v = 0; v < vertices; ++v) colors.insert(ply.substr(end + 27 * v + 24, 3));
  CHECK(colors.size() > 100);

  CHECK(ply_note(ply).at("job").at("options").at("material") == "trap");
  CHECK(ply_note(ply).at("job").at("options").at("palette") == "ember");
  CHECK_FALSE(
      ply_note(map.surface_file({}, "plain.ply")).at("job").at("options").contains("material"));
  map.surface_file(options, "colored.glb");
  const auto info = run_command({"info", map.folder / "colored.glb", "--json"});
  CHECK(json::parse(info.out).at("made_with").at("job").at("options").at("palette") == "ember");

  Arguments few = options;
  few.insert(few.end(), {"--max-triangles", "100"});
  const std::string obj = map.surface_file(few, "few.obj");
  std::istringstream line(obj.substr(obj.find("\nv ") + 3));
  double number = 0;
  for (int i = 0; i < 6; ++i) CHECK(line >> number);
  CHECK(number >= 0);
  CHECK(number <= 1);
}

TEST_CASE("at n = 1, phase and order keep the surface and the other options change it") {
  const MapFile map;
  const std::string plain = map.surface({});
  CHECK(map.surface({"--phase", "0", "-1", "0.5", "0"}) == plain);
  CHECK(map.surface({"--order-seed", "7"}) == plain);
  CHECK(map.surface({"--detail", "0.02"}) == plain);
  CHECK(map.surface({"--drift", "0"}) == plain);
  CHECK(map.surface({"--translate", "0", "0", "0"}) == plain);
  CHECK(map.surface({"--scale", "1"}) == plain);
  CHECK(map.surface({"--slice", "0.3"}) != plain);
  CHECK(map.surface({"--scale", "1.2"}) != plain);
}

TEST_CASE("words for the detail suit the map's own shape, and tufts make a map of version 2") {
  const MapFile map;
  const auto converted = [&](const Arguments& options) {
    Arguments arguments = {"convert", map.file, map.folder / "out.qjulia.json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const auto result = run_command(arguments);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return json::parse(read_text(map.folder / "out.qjulia.json"));
  };
  const auto detail = [&](const std::string& word) {
    return converted({"--detail", word})["detail"].get<double>();
  };
  const double automatic = detail("auto");
  CHECK(automatic > 0.001);
  // At most 3 % of the shape's diagonal, which is 4 % longer than that of the box the map says.
  CHECK(automatic <= 0.0315);
  CHECK(detail("smooth") == Catch::Approx(automatic / 8));
  CHECK(detail("clear") == Catch::Approx(automatic / 2));
  CHECK(detail("wild") == Catch::Approx(2 * automatic));
  CHECK(detail("0.013") == 0.013);
  // The box in a map may be larger than its shape; the shell is as thick as before.
  qjulia::Map roomy = small_map();
  *roomy.frame.detail /= 2;
  roomy.frame.box = qjulia::Box{{-2, -2, -2}, {2, 2, 2}};
  qjulia::write_map(roomy, map.file);
  CHECK(detail("auto") == Catch::Approx(automatic / 2).epsilon(0.03));
  qjulia::write_map(small_map(), map.file);
  CHECK(converted({})["version"] == 1);
  const json steep = converted({"--steepness", "2.5"});
  CHECK(steep["version"] == 2);
  CHECK(steep["steepness"] == 2.5);
  CHECK(steep["provenance"]["jobs"].back()["options"]["steepness"] == 2.5);
  const auto refused =
      run_command({"surface", map.file, "-o", map.folder / "out.ply", "--detail", "rough"});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("auto, smooth, clear or wild"));
}

TEST_CASE("portals are put on a map, told by info, and moved by convert; wrong ones are refused") {
  const MapFile map;
  const std::string with = map.folder / "with.qjulia.json";
  const auto made = run_command({"portals", map.file, "-o", with, "--count", "2", "--size", "0.2",
                                 "--device", "cpu", "--json"});
  INFO(made.err);
  REQUIRE(made.exit_code == 0);
  const json summary = json::parse(made.out);
  CHECK(summary["depth"] == 2);
  CHECK(summary["iterations"] == 8);
  json text = json::parse(read_text(with));
  CHECK(text["version"] == 2);
  REQUIRE(text["portals"].size() == summary["portals"]);
  CHECK(text["portals"][0]["scale"] == Catch::Approx(5));
  CHECK(text["portals"][0]["mask"] == "outside");
  CHECK(text["provenance"]["jobs"].back()["options"]["size"] == 0.2);
  const auto told = run_command({"info", with, "--device", "cpu"});
  CHECK_THAT(told.out, ContainsSubstring("portal ") && ContainsSubstring("mask outside"));
  const std::string moved = map.folder / "moved.qjulia.json";
  REQUIRE(run_command({"convert", with, moved, "--translate", "0.01", "0", "0", "--device", "cpu"})
              .exit_code == 0);
  CHECK(json::parse(read_text(moved))["portals"][0]["center"][0].get<double>() ==
        Catch::Approx(text["portals"][0]["center"][0].get<double>() + 0.01));

  text["portals"][0]["scale"] = 0;
  std::ofstream(with) << text.dump();
  const auto refused = run_command({"render", with, "-o", map.folder / "out.png"});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("portals[0].scale"));
  const auto too_large =
      run_command({"portals", map.file, "-o", moved, "--size", "0.9", "--device", "cpu"});
  CHECK(too_large.exit_code == 2);
  CHECK_THAT(too_large.err, ContainsSubstring("--size"));
}

TEST_CASE("a paint is put on a map, told by info, and refused where it cannot be drawn") {
  const MapFile map;
  const std::string with = map.folder / "painted.qjulia.json";
  const auto paint = [&](Arguments more) {
    Arguments words{"paint", map.file, "-o", with, "--device", "cpu", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  const auto made = paint({"--ball", "0", "0", "0", "0.1", "0.25", "--ball", "0", "-0.5", "0",
                           "0.2", "0", "--ramp", "x=0.5:1", "--thickness", "0.2"});
  INFO(made.err);
  REQUIRE(made.exit_code == 0);
  const json text = json::parse(read_text(with));
  CHECK(text["version"] == 2);
  CHECK(text["paint"]["cells"] == json::parse(made.out)["cells"]);
  const json& options = text["provenance"]["jobs"].back()["options"];
  REQUIRE(options["ball"].size() == 2);
  CHECK(options["ball"][1][1] == -0.5);
  CHECK(options["thickness"] == 0.2);
  const auto told = run_command({"info", with, "--device", "cpu"});
  CHECK_THAT(told.out, ContainsSubstring("paint ") && ContainsSubstring("shares of the detail"));
  const std::string mesh = map.folder / "painted.ply";
  const auto meshed = run_command(
      {"surface", with, "-o", mesh, "--resolution", "32", "--device", "cpu", "--quiet"});
  CHECK(meshed.exit_code == 0);
  const std::string page = map.folder / "page.html";
  REQUIRE(run_command({"share", with, "-o", page}).exit_code == 0);
  CHECK_THAT(read_text(page), ContainsSubstring("id=\"painted.glsl\"") &&
                                  !ContainsSubstring("id=\"unpainted.glsl\""));

  const std::string bare = map.folder / "bare.qjulia.json";
  REQUIRE(run_command({"paint", with, "-o", bare, "--clear"}).exit_code == 0);
  CHECK_FALSE(json::parse(read_text(bare)).contains("paint"));
  for (const auto& [words, part] : std::vector<std::pair<Arguments, const char*>>{
           {{"--ball", "0", "0", "0", "1"}, "--ball"},
           {{"--ball", "0", "0", "0", "1", "2"}, "--ball: 2 is out of range"},
           {{"--ball", "0", "0", "0", "0", "0"}, "--ball: a radius is 0"},
           {{"--block", "0", "0", "0", "1", "-1", "1", "0.5"}, "--block: a block is empty"},
           {{"--ramp", ""}, "--ramp: ''"},
           {{"--ramp", "w=0:1"}, "--ramp"},
           {{"--ramp", "x=0:2"}, "--ramp"},
           {{"--ramp", "x=0"}, "--ramp"},
           {{"--elsewhere", "-1"}, "--elsewhere"},
           {{"--thickness", "0"}, "--thickness"},
           {{"--property", "wild"}, "--property"},
           {{"--property", ""}, "--property: the name is empty"},
           {{"--mesh", "none.ply"}, "none.ply"}}) {
    const auto refused = paint(words);
    INFO(refused.err);
    CHECK(refused.exit_code == 2);
    CHECK_THAT(refused.err, ContainsSubstring(part));
  }
}

TEST_CASE("a sampled field is shifted by --scale") {
  const MapFile map;
  const auto values = [&](const Arguments& more) {
    const std::string field = map.folder / "out.npy";
    Arguments arguments = {"sample", map.file,       "-o",       field,         "--resolution",
                           "9",      "--iterations", "1",        "--precision", "double",
                           "--box",  "-1",           "-1",       "-1",          "1",
                           "1",      "0.5",          "--device", "cpu",         "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto result = run_command(arguments);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    CHECK(json::parse(result.out)["cells"] == json({9, 9, 7}));
    const std::string bytes = read_text(field);
    REQUIRE(bytes.size() > 9 * 9 * 7 * sizeof(double));
    std::vector<double> reals(9 * 9 * 7);
    const std::size_t size = reals.size() * sizeof(double);
    std::memcpy(reals.data(), bytes.data() + bytes.size() - size, size);
    return reals;
  };
  const auto plain = values({});
  const auto scaled = values({"--scale", "1.25"});
  for (std::size_t i = 0; i < plain.size(); ++i) {
    CHECK(scaled[i] == Catch::Approx(plain[i] - std::log(1.25)).margin(1e-12));
  }
}

TEST_CASE("convert reads the original's maps and turns maps") {
  const MapFile map;
  const std::string original =
      map.folder.file("small.o3d", qjulia::test::original_bytes(qjulia::test::small_original()));
  const std::string converted = map.folder / "converted.qjulia.json";
  const auto result = run_command({"convert", original, converted, "--json"});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  CHECK(json::parse(result.out)["factors"] == 5);
  const auto read = qjulia::read_map(converted);
  CHECK(read.dynamics.factors.size() == 5);
  CHECK(read.provenance.json()["jobs"].back()["options"]["in"] == "small.o3d");

  // Turned once in the file, or each time on the way: the same.
  const Arguments knobs = {"--drift", "0.3", "--scale", "1.1", "--phase", "1", "1", "0", "0"};
  const std::string expected = map.surface(knobs);
  MapFile other;
  Arguments arguments = {"convert", map.file, other.file, "--device", "cpu"};
  arguments.insert(arguments.end(), knobs.begin(), knobs.end());
  REQUIRE(run_command(arguments).exit_code == 0);
  CHECK(qjulia::read_map(other.file).provenance.json()["jobs"].back()["options"]["drift"] == 0.3);
  CHECK(other.surface({}) == expected);
}

TEST_CASE("pictures say how they were made") {
  const MapFile map;
  const std::string picture = map.folder / "out.png";
  const auto result = run_command({"render",
                                   map.file,
                                   "-o",
                                   picture,
                                   "--size",
                                   "32x24",
                                   "--samples",
                                   "1",
                                   "--device",
                                   "cpu",
                                   "--json",
                                   "--drift",
                                   "0.2",
                                   "--translate",
                                   "-0.1",
                                   "0",
                                   "0",
                                   "--phase",
                                   "3",
                                   "0",
                                   "4",
                                   "0",
                                   "--order-seed",
                                   "5",
                                   "--iterations",
                                   "4"});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  const json made = json::parse(result.out)["made_with"];
  const json options = made["job"]["options"];
  CHECK(options["map"] == "small.qjulia.json");
  CHECK(options["drift"] == 0.2);
  CHECK(options["translate"] == json({-0.1, 0, 0}));
  CHECK(options["phase"] == json({3, 0, 4, 0}));
  CHECK(options["order_seed"] == 5);
  CHECK(options["iterations"] == 4);
  CHECK_FALSE(options.contains("detail"));
  CHECK_THAT(read_text(picture),
             ContainsSubstring("tEXtqjulia") && ContainsSubstring(made["job"].dump()));
  const auto info = run_command({"info", picture, "--json"});
  REQUIRE(info.exit_code == 0);
  CHECK(json::parse(info.out)["made_with"] == made);

  const auto foreign =
      run_command({"info", map.folder.file("b.png", read_text(picture).substr(0, 40))});
  CHECK(foreign.exit_code == 2);
  CHECK_THAT(foreign.err,
             ContainsSubstring("b.png") && ContainsSubstring("does not say how it was made"));
}

/// Meshes for printers and viewers, and surfaces that are stopped half-way.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cstring>
#include <nlohmann/json.hpp>

#include "armed_ball.hpp"
#include "process.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/map_file.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using qjulia::test::run_command;
using qjulia::test::TemporaryFolder;
using Arguments = std::vector<std::string>;

namespace {

/// A ball with arms and crumbs about it.
std::string crumbly_map(const TemporaryFolder& folder) {
  qjulia::Map map = qjulia::test::armed_ball_map(60);
  constexpr double kShell = 0.12;
  for (auto& factor : map.dynamics.factors) factor.exponent /= kShell;
  map.dynamics.log_scale /= kShell;
  map.frame.box = qjulia::Box{{-1.2, -1.2, -1.2}, {1.2, 1.2, 1.2}};
  const std::string file = folder / "crumbs.qjulia.json";
  qjulia::write_map(map, file);
  return file;
}

json made(Arguments arguments) {
  arguments.insert(arguments.end(), {"--device", "cpu", "--json"});
  const auto result = run_command(arguments);
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  return json::parse(result.out);
}

/// The last number on the line of `text` that begins with `label`.
int number_after(const std::string& text, const std::string& label) {
  const auto at = text.find(label);
  REQUIRE(at != std::string::npos);
  const auto digit = text.find_first_of("0123456789", at + label.size());
  return std::stoi(text.substr(digit));
}

}  // namespace

TEST_CASE("admesh has nothing to repair") {
  const TemporaryFolder folder;
  const std::string stl = folder / "print.stl";
  const json surface = made({"surface", crumbly_map(folder), "-o", stl, "--resolution", "96",
                             "--millimetres", "20", "--largest-component"});
  CHECK(surface["closed"] == true);
  CHECK(surface["components"] == 1);
  const auto admesh = qjulia::test::run({QJULIA_ADMESH, stl});
  INFO(admesh.out);
  REQUIRE(admesh.exit_code == 0);
  CHECK(number_after(admesh.out, "Number of parts") == 1);
  for (const char* fault : {"Degenerate facets", "Edges fixed", "Facets removed", "Facets added",
                            "Facets reversed", "Backwards edges"}) {
    CAPTURE(fault);
    CHECK(number_after(admesh.out, fault) == 0);
  }
  const json info = made({"info", stl, "--printable"});
  CHECK(info["printable"]["closed_body"] == true);
  const double wall = info["printable"]["median_wall"];
  CHECK(wall > 0.5);
  CHECK(wall < 20);
  // The thinnest walls decide: as thick as two lines of the nozzle, or as was asked for.
  const double thinnest = info["printable"]["thinnest_wall"];
  const auto judged = [&](const char* option, double width) {
    return made({"info", stl, "--printable", option, std::to_string(width)})["printable"];
  };
  CHECK(judged("--nozzle", 0.49 * thinnest)["ready"] == true);
  CHECK(judged("--nozzle", 0.51 * thinnest)["ready"] == false);
  CHECK(judged("--min-wall", 0.99 * thinnest)["ready"] == true);
  CHECK(judged("--min-wall", 1.01 * thinnest)["ready"] == false);
  CHECK_THAT(judged("--min-wall", 1.01 * thinnest)["advice"].get<std::string>(),
             ContainsSubstring("--min-wall"));
  CHECK_THAT(judged("--min-wall", 1.1 * wall)["advice"].get<std::string>(),
             ContainsSubstring("--longest"));
  // The shape's box, 2.4 a side, is 20 mm long.
  const double length = info["box"][1][0].get<double>() - info["box"][0][0].get<double>();
  CHECK(length > 10);
  CHECK(length < 22.5);
  CHECK(info["figures"]["volume"].get<double>() ==
        Catch::Approx(surface["figures"]["volume"].get<double>()).epsilon(1e-4));
}

TEST_CASE("a print has the size and the walls that were asked for") {
  const TemporaryFolder folder;
  const std::string map = crumbly_map(folder);
  const std::string stl = folder / "print.stl";
  const json surface = made({"surface", map, "-o", stl, "--resolution", "64", "--up", "y",
                             "--height", "20", "--min-wall", "0.8", "--max-triangles", "30000",
                             "--flat-foot", "0.5", "--largest-component"});
  CHECK(surface["closed"] == true);
  CHECK(surface["components"] == 1);
  CHECK(surface["triangles"].get<int>() <= 30'000);
  CHECK(surface["print"]["thinnest_wall"].get<double>() >= 0.8);
  CHECK(surface["print"]["volume"].get<double>() > 0);
  CHECK(surface["print"]["decimation"]["ended_by"] == "max_triangles");
  CHECK(surface["made_with"]["job"]["options"]["min_wall"] == 0.8);
  const json info = made({"info", stl, "--printable", "--min-wall", "0.8"});
  CHECK(info["printable"]["ready"] == true);
  const json& box = info["box"];
  CHECK(box[1][2].get<double>() - box[0][2].get<double>() == Catch::Approx(20).epsilon(1e-6));

  const std::string ply = folder / "longest.ply";
  const json longest = made({"surface", map, "-o", ply, "--resolution", "32", "--longest", "50",
                             "--material", "trap", "--max-error", "0.5"});
  CHECK(longest["closed"] == true);
  const json& decimation = longest["print"]["decimation"];
  CHECK(decimation["ended_by"] == "max_error");
  CHECK(decimation["triangles"] < decimation["triangles_before"]);
  CHECK(decimation["triangles"] == longest["triangles"]);
  CHECK(decimation["farthest"] <= 0.5);
  const json sides = made({"info", ply})["box"];
  double side = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    side = std::max(side, sides[1][axis].get<double>() - sides[0][axis].get<double>());
  }
  CHECK(side == Catch::Approx(50).epsilon(1e-6));
}

TEST_CASE("sizes and walls that contradict each other are refused") {
  const TemporaryFolder folder;
  const std::string map = crumbly_map(folder);
  const auto refused = [&](Arguments options, const char* text) {
    Arguments all{"surface", map, "-o", folder / "no.stl", "--resolution", "32"};
    all.insert(all.end(), options.begin(), options.end());
    const auto result = run_command(all);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.err, ContainsSubstring(text));
  };
  refused({"--height", "20", "--longest", "20"}, "--longest");
  refused({"--height", "20", "--millimetres", "20"}, "--millimetres");
  refused({"--drain", "2"}, "--shell");
  refused({"--min-wall", "2", "--shell", "1"}, "--shell");
  CHECK(folder.names() == std::vector<std::string>{"crumbs.qjulia.json"});
}

TEST_CASE("parts are left out by size, and every format holds the same mesh") {
  const TemporaryFolder folder;
  const std::string map = crumbly_map(folder);
  const json all =
      made({"surface", map, "-o", folder / "all.ply", "--resolution", "64", "--keep-loose"});
  CHECK(all["components"].get<int>() > 1);
  for (const std::string name : {"all.obj", "all.off", "all.glb"}) {
    CAPTURE(name);
    const json other =
        made({"surface", map, "-o", folder / name, "--resolution", "64", "--keep-loose"});
    for (const char* key : {"vertices", "triangles", "components", "open_edges", "closed"}) {
      CHECK(other[key] == all[key]);
    }
    CHECK(other["figures"]["area"].get<double>() ==
          Catch::Approx(all["figures"]["area"].get<double>()).epsilon(1e-5));
    CHECK(made({"info", folder / name})["triangles"] == all["triangles"]);
  }
  const json info = made({"info", folder / "all.ply"});
  CHECK(info["closed"] == true);
  CHECK(info["components"] == all["components"]);
  const json few = made(
      {"surface", map, "-o", folder / "few.ply", "--resolution", "64", "--min-component", "0.01"});
  const json one =
      made({"surface", map, "-o", folder / "one.ply", "--resolution", "64", "--largest-component"});
  CHECK(few["components"].get<int>() < all["components"].get<int>());
  const json body = made({"surface", map, "-o", folder / "body.ply", "--resolution", "64"});
  CHECK(body["loose_pieces"].get<int>() > 0);
  CHECK(body["loose_volume"].get<double>() > 0);
  CHECK(body["components"].get<int>() + body["loose_pieces"].get<int>() ==
        all["components"].get<int>());
  CHECK(all["loose_pieces"] == 0);
  CHECK(one["components"] == 1);

  // The binary glTF: its length, its JSON, and as many indices as it says.
  const std::string glb = qjulia::test::read_text(folder / "all.glb");
  const auto word = [&glb](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, glb.data() + at, sizeof value);
    return value;
  };
  CHECK(glb.substr(0, 4) == "glTF");
  CHECK(word(8) == glb.size());
  const json scene = json::parse(glb.substr(20, word(12)));
  CHECK(scene["accessors"][0]["count"] == 3 * all["triangles"].get<int>());
  CHECK(scene["accessors"][1]["count"] == all["vertices"]);
  CHECK(scene["buffers"][0]["byteLength"] == word(20 + word(12)));
  const std::size_t without_map = 28 + word(12) + word(20 + word(12));
  CHECK(glb.substr(without_map + 4, 4) == "QJMP");
  CHECK(glb.size() == without_map + 8 + word(without_map));
}

TEST_CASE("a surface that is stopped leaves nothing") {
  const TemporaryFolder folder;
  const std::string map = crumbly_map(folder);
  const std::string name = GENERATE("stopped.ply", "stopped.stl");
  const auto result =
      run_command({"surface", map, "-o", folder / name, "--resolution", "1500", "--device", "cpu"},
                  {.interrupt_at = "extracting"});
  INFO(result.err);
  REQUIRE(result.interrupted);
  CHECK(result.exit_code == 130);
  CHECK(folder.names() == std::vector<std::string>{"crumbs.qjulia.json"});
}

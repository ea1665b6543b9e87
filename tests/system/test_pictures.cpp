/// What `render` and `compare` draw, and what `surface` leaves when it is stopped.

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "obj_text.hpp"
#include "png_file.hpp"
#include "process.hpp"
#include "qjulia/map/map_file.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;
using Names = std::vector<std::string>;

namespace {

struct Ball {
  TemporaryFolder folder;
  std::string map = folder / "ball.qjulia.json";
  std::string mesh = folder.file("ball.obj", qjulia::test::obj_text(qjulia::shapes::sphere(3)));

  Ball() {
    qjulia::Map ball;
    ball.dynamics.factors = {{{}, 3}};
    ball.frame.box = qjulia::Box{{-1, -1, -1}, {1, 1, 1}};
    qjulia::write_map(ball, map);
  }
};

}  // namespace

TEST_CASE("render writes layers, and a preview that goes when the picture is done") {
  const Ball ball;
  const TemporaryFolder folder;
  const auto result = run_command({"render", ball.map, "-o", folder / "ball.png", "--size", "64x48",
                                   "--aov", folder / "ball", "--preview", "--device", "cpu"});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.err,
             ContainsSubstring("ball.preview.png") && ContainsSubstring("ball.depth.npy"));
  Names names = folder.names();
  std::ranges::sort(names);
  CHECK(names == Names{"ball.depth.npy", "ball.depth.png", "ball.normal.npy", "ball.normal.png",
                       "ball.png", "ball.position.npy"});
  const auto refused = run_command({"render", ball.map, "-o", folder / "turn.png", "--turntable",
                                    "3", "--aov", folder / "turn"});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("--aov"));
  const auto clay = run_command(
      {"render", ball.mesh, "-o", folder / "mesh.png", "--material", "trap", "--size", "64x48"});
  CHECK(clay.exit_code == 2);
  CHECK_THAT(clay.err, ContainsSubstring("--material"));
}

TEST_CASE("a picture of nothing is drawn with a warning, and a part of nothing is refused") {
  const Ball ball;
  const TemporaryFolder folder;
  const auto drawn = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {"render",    ball.map, "-o",       folder / "a.png",
                                          "--size",    "40x30",  "--device", "cpu",
                                          "--samples", "1",      "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_command(arguments);
  };
  for (const std::vector<std::string>& nothing :
       {std::vector<std::string>{"--slice", "50"},
        std::vector<std::string>{"--look-at", "0", "9", "0"}}) {
    const auto result = drawn(nothing);
    INFO(result.err);
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.err, ContainsSubstring("shows nothing of"));
    CHECK(json::parse(result.out)["covered_pixels"] == 0);
  }
  std::filesystem::remove(folder / "a.png");
  for (const std::vector<std::string>& nothing :
       {std::vector<std::string>{"--box", "3", "3", "3", "4", "4", "4"},
        std::vector<std::string>{"--cut", "x=-200%"}}) {
    const auto result = drawn(nothing);
    INFO(result.err);
    CHECK(result.exit_code == 1);
    CHECK_THAT(result.err, ContainsSubstring("is empty in this box") && ContainsSubstring("--cut"));
    CHECK(folder.names().empty());
  }
  for (const char* cut : {"z", "w=1", "z=", "z=50%%", "x=1,", "x=nan"}) {
    const auto result = drawn({"--cut", cut});
    INFO(cut << ": " << result.err);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.err, ContainsSubstring("--cut"));
  }
  const auto inverted = drawn({"--frame", "1", "0", "0", "0", "1", "1"});
  CHECK(inverted.exit_code == 2);
  CHECK_THAT(inverted.err, ContainsSubstring("--frame"));
  const auto result = drawn({});
  CHECK(result.exit_code == 0);
  CHECK_THAT(result.err, !ContainsSubstring("shows nothing"));
  // The ball is 83 % as high as the picture: a disc of 25 pixels across.
  const int covered = json::parse(result.out)["covered_pixels"];
  CHECK(covered > 470);
  CHECK(covered < 570);
}

TEST_CASE("a sweep of a scale goes by equal ratios, and its pictures share camera and palette") {
  const Ball ball;
  const TemporaryFolder folder;
  const auto swept = [&](const char* sweep, const char* more = "clay") {
    const auto result =
        run_command({"render", ball.map, "-o", folder / "sweep.png", "--size", "24x18", "--samples",
                     "1", "--sweep", sweep, "--material", more, "--device", "cpu", "--json"});
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return json::parse(result.out)["made_with"];
  };
  const auto values = swept("zoom=1:16:5")["sweep"]["values"].get<std::vector<double>>();
  REQUIRE(values.size() == 5);
  for (std::size_t i = 0; i < 5; ++i) CHECK(values[i] == Catch::Approx(std::pow(2, i)));
  CHECK(swept("elevation=0:80:3")["sweep"]["values"] == json::array({0, 40, 80}));
  // Drift moves the set from picture to picture; the camera stays.
  const auto note = [&](int number) {
    const auto text =
        run_command({"info", folder / fmt::format("sweep_{:03}.png", number), "--json"});
    INFO(text.err);
    return json::parse(text.out)["made_with"]["picture"];
  };
  swept("scale=0.7:1.4:3", "trap");
  const json first = note(1), last = note(3);
  CHECK(first["look_at"] == last["look_at"]);
  CHECK(first["distance"] == last["distance"]);
  CHECK(first["range"] == last["range"]);
  CHECK(first["range"].size() > 2);
  // A series has one exposure, unless that is what is swept.
  swept("exposure=-1:1:3");
  CHECK(note(1)["exposure"] == -1);
  CHECK(note(3)["exposure"] == 1);
  swept("exposure=-1:1:3");
  CHECK(qjulia::test::read_png(folder / "sweep_001.png").pixels !=
        qjulia::test::read_png(folder / "sweep_003.png").pixels);
}

TEST_CASE("looks, lamps and an exposure are drawn again by their jobs") {
  const Ball ball;
  const TemporaryFolder folder;
  const auto run = [&](std::vector<std::string> words) {
    const auto result = run_command(std::move(words));
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
  };
  const std::string mine = folder.file("mine.toml", "metal = 1\nlight = \"rim\"\n");
  int number = 0;
  for (const std::vector<std::string>& given :
       {std::vector<std::string>{"--look", "gold", "--exposure", "auto"},
        {"--look", mine},
        {"--lamp", "10,20,1,3200K", "--lamp", "100,30,2", "--light", "dusk"},
        {"--aperture", "0.1"}}) {
    const std::string picture = folder / fmt::format("a{}.png", ++number);
    const std::string again = folder / fmt::format("b{}.png", number);
    // Options stand before the map: a lamp takes one word.
    std::vector<std::string> words{"render"};
    words.insert(words.end(), given.begin(), given.end());
    words.insert(words.end(), {ball.map, "-o", picture, "--size", "24x18", "--samples", "1"});
    run(words);
    run({"run", picture, "-o", again});
    CHECK(qjulia::test::read_png(again).pixels == qjulia::test::read_png(picture).pixels);
  }
  const auto refused =
      run_command({"render", ball.map, "-o", folder / "c.png", "--look", "golden"});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("--look: there is no look 'golden'"));
}

TEST_CASE("a surface whose colours are finer than its mesh is written with a warning") {
  const Ball ball;
  const TemporaryFolder folder;
  const auto colored = [&](const char* material) {
    return run_command({"surface", ball.map, "-o", folder / "a.glb", "--resolution", "12",
                        "--material", material, "--palette", "000,fff,000,fff,000,fff,000,fff",
                        "--device", "cpu"});
  };
  const auto fine = colored("trap");
  INFO(fine.err);
  CHECK(fine.exit_code == 0);
  CHECK_THAT(fine.err, ContainsSubstring("finer than the mesh") &&
                           ContainsSubstring("--resolution higher than 12"));
  // Wide facets average a fine pattern: neighbours agree, and the pattern is lost all the same.
  const auto coarse = run_command({"surface", QJULIA_TEST_DATA "/../../docs/maps/bunny.qjulia.json",
                                   "-o", folder / "c.glb", "--resolution", "48", "--material",
                                   "iterations", "--device", "cpu"});
  CHECK(coarse.exit_code == 0);
  CHECK_THAT(coarse.err, ContainsSubstring("finer than the mesh"));
  const auto plain = run_command({"surface", ball.map, "-o", folder / "b.glb", "--resolution", "24",
                                  "--material", "height", "--device", "cpu"});
  CHECK(plain.exit_code == 0);
  CHECK_THAT(plain.err, !ContainsSubstring("finer than the mesh"));
}

TEST_CASE("render takes a background, a palette and no ground, in turntables too") {
  const Ball ball;
  const TemporaryFolder folder;
  const auto result =
      run_command({"render", ball.map, "-o", folder / "turn.png", "--size", "40x30", "--samples",
                   "1", "--turntable", "2", "--device", "cpu", "--json", "--background",
                   "transparent", "--no-ground", "--palette", "f80"});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  const json made = json::parse(result.out)["made_with"]["picture"];
  CHECK(made["background"] == "transparent");
  CHECK(made["ground"] == false);
  CHECK(made["palette"] == json::array({"#ff8800"}));
  constexpr std::size_t kColorType = 25;  // of the header; 6: red, green, blue and alpha
  CHECK(read_text(folder / "turn_002.png")[kColorType] == 6);
  CHECK(read_text(folder / "turn.png")[kColorType] == 2);
  const auto help = run_command({"render", "--help"}).out;
  CHECK_THAT(help, ContainsSubstring("Look of the picture (--help-all") &&
                       ContainsSubstring("--background"));
  CHECK_THAT(help, !ContainsSubstring("studio|transparent"));
}

TEST_CASE("loose pieces are left out of pictures and of surfaces, unless they are kept") {
  const TemporaryFolder folder;
  // A body, and a ball beside it with 0.4 % of its volume.
  const std::string map = folder / "flake.qjulia.json";
  qjulia::Map two;
  two.dynamics.factors = {{{}, 3}, {{2, 0, 0, 0}, 1}};
  two.frame.box = qjulia::Box{{-1, -1, -1}, {2.2, 1, 1}};
  qjulia::write_map(two, map);
  const auto made = [&](std::vector<std::string> words) {
    const std::vector<std::string> more{"--iterations", "1", "--device", "cpu", "--json"};
    words.insert(words.end(), more.begin(), more.end());
    const auto result = run_command(words);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return std::pair{json::parse(result.out), result.err};
  };
  // By default a picture frames the body alone.
  const std::vector<std::string> render{
      "render", map, "-o", folder / "a.png", "--size", "80x60", "--frame", "-1", "-1", "-1",
      "2.2",    "1", "1"};
  const auto [picture, told] = made(render);
  const auto [mesh, meshed] = made({"surface", map, "-o", folder / "a.ply", "--resolution", "96"});
  CHECK(picture["loose_pieces"] == 1);
  CHECK(mesh["loose_pieces"] == 1);
  const double volume = picture["loose_volume"];
  CHECK(volume == Catch::Approx(mesh["loose_volume"].get<double>()).epsilon(0.1));
  CHECK_THAT(told, ContainsSubstring("1 loose piece left out") &&
                       ContainsSubstring("--keep-loose keeps it"));
  CHECK(picture["made_with"]["picture"]["keep_loose"] == false);
  CHECK(picture["made_with"]["picture"]["exact"] == false);
  auto keep = render;
  keep.emplace_back("--keep-loose");
  const auto [all, silent] = made(keep);
  CHECK(all["loose_pieces"] == 0);
  CHECK(all["made_with"]["picture"]["keep_loose"] == true);
  CHECK_THAT(silent, !ContainsSubstring("left out"));
  CHECK(all["covered_pixels"].get<int>() > picture["covered_pixels"].get<int>());
  auto turn = render;
  turn.insert(turn.end(), {"--turntable", "2"});
  CHECK_THAT(made(turn).second, ContainsSubstring("1 loose piece left out"));
}

TEST_CASE("compare counts limbs where it is asked to") {
  const Ball ball;
  const auto counted = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"compare", ball.map,   ball.mesh, "--resolution",
                                   "24",      "--device", "cpu",     "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  CHECK_FALSE(json::parse(counted({}).out)["metrics"][0].contains("limbs"));
  const json limbs = json::parse(counted({"--limbs"}).out)["metrics"][1];
  CHECK(limbs["limbs"] == 0);
  CHECK(limbs["limbs_kept"] == 0);
  const auto refused = counted({"--limbs", "--box", "-1", "-1", "-1", "1", "1", "1"});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("--limbs"));
}

TEST_CASE("compare draws mesh, potential, set and distance") {
  const Ball ball;
  const TemporaryFolder folder;
  const auto result =
      run_command({"compare", ball.map, ball.mesh, "--resolution", "24", "--picture",
                   folder / "ball.png", "--size", "80x60", "--device", "cpu", "--json"});
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  CHECK(json::parse(result.out)["picture"] == folder / "ball.png");
  CHECK(folder.names() == Names{"ball.png"});
  CHECK_THAT(read_text(folder / "ball.png"), ContainsSubstring("azimuth"));
  const auto refused =
      run_command({"compare", ball.map, ball.mesh, "--picture", folder / "ball.jpg"});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring(".png"));
}

TEST_CASE("a surface that is stopped in the middle leaves nothing") {
  const Ball ball;
  const int signal = GENERATE(SIGINT, SIGTERM);
  const std::string name = GENERATE("ball.ply", "ball.stl");
  const TemporaryFolder folder;
  const auto result = run_command({"surface", ball.map, "-o", folder / name, "--resolution", "2048",
                                   "--iterations", "6", "--dense", "--device", "cpu"},
                                  {.interrupt_at = "extracting", .interrupt_by = signal});
  INFO(result.err);
  REQUIRE(result.interrupted);
  CHECK(result.exit_code == 130);
  CHECK(folder.names().empty());
}

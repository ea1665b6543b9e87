/// From a mesh to its map, surface, picture and figures.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "obj_text.hpp"
#include "png_file.hpp"
#include "process.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;
using Arguments = std::vector<std::string>;

namespace {

/// A torus and the map that a short fit gives it, made once.
struct Fitted {
  TemporaryFolder folder;
  std::string mesh =
      folder.file("torus.obj", qjulia::test::obj_text(qjulia::shapes::torus(1, 0.45, 32, 16)));
  std::string map = folder / "torus.qjulia.json";
  json report;

  Fitted() {
    const auto result = run_command(fit_to(map, {"--json"}));
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    report = json::parse(result.out);
  }

  Arguments fit_to(const std::string& output, const Arguments& more = {}) const {
    Arguments arguments = {
        "fit", mesh,     "-o", output,     "--factors", "24", "--max-evaluations",
        "40",  "--seed", "2",  "--device", "cpu"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
};

const Fitted& fitted() {
  static const Fitted instance;
  return instance;
}

/// What must be the same bit for bit in two fits of the same inputs: all but where time went.
json without_provenance(const std::string& file) {
  json map = json::parse(read_text(file));
  map.erase("provenance");
  return map;
}

}  // namespace

TEST_CASE("a fit leaves a map that says where it came from") {
  const json map = json::parse(read_text(fitted().map));
  CHECK(map["format"] == "qjulia-map");
  CHECK(map["factors"].size() == fitted().report["factors"]);
  const json& from = map["provenance"];
  CHECK(from["mesh"]["name"] == "torus.obj");
  CHECK(from["mesh"]["fnv1a64"].get<std::string>().size() == 16);
  CHECK(from["options"]["seed"] == 2);
  CHECK(from["options"]["factors"] == 24);
  CHECK(from["options"]["time_limit"].is_null());
  CHECK(from["stages"].size() > 0);
  CHECK(from["evaluations"].get<int>() <= 40);
  CHECK(fitted().report["map"] == fitted().map);
  CHECK(fitted().report["metrics"]["iou"].get<double>() > 0.6);
}

TEST_CASE("the number of factors that is chosen is bounded, and what is not asked for is null") {
  const TemporaryFolder folder;
  const std::string mesh =
      folder.file("ball.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const auto fit = [&](std::vector<std::string> options) {
    const std::vector<std::string> rest = {
        "-o", folder / "map.qjulia.json", "--json", "--schedule", "fast", "--device", "cpu"};
    options.insert(options.begin(), {"fit", mesh});
    options.insert(options.end(), rest.begin(), rest.end());
    const auto result = run_command(options);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return json::parse(result.out);
  };
  const json few = fit({"--max-factors", "12", "--max-evaluations", "1"});
  CHECK(few["factors"] == 12);
  CHECK(few["options"]["max_factors"] == 12);
  CHECK(few["options"]["max_evaluations"] == 1);
  CHECK(few["options"]["target_iou"].is_null());
  const json rough = fit({"--factors", "auto", "--max-factors", "8", "--target-iou", "0.1"});
  CHECK(rough["factors"] == 8);
  CHECK(rough["options"]["factors"] == "auto");
  CHECK(rough["options"]["target_iou"] == 0.1);
  CHECK(rough["options"]["max_evaluations"].is_null());
  CHECK(rough["stopped"] == "target_iou");
}

TEST_CASE("fits repeat bit for bit") {
  const TemporaryFolder folder;
  const std::string again = folder / "again.qjulia.json";
  const std::string alone = folder / "alone.qjulia.json";
  REQUIRE(run_command(fitted().fit_to(again)).exit_code == 0);
  REQUIRE(run_command(fitted().fit_to(alone), {.environment = {{"POCL_MAX_PTHREAD_COUNT", "1"}}})
              .exit_code == 0);
  const json expected = without_provenance(fitted().map);
  CHECK(without_provenance(again) == expected);
  CHECK(without_provenance(alone) == expected);
  const std::string other = folder / "other.qjulia.json";
  REQUIRE(run_command(fitted().fit_to(other, {"--detail", "0.03"})).exit_code == 0);
  CHECK(without_provenance(other) != expected);
}

TEST_CASE("a detail means the same shell before a shape is turned and afterwards") {
  const TemporaryFolder folder;
  const auto info_of = [](const std::string& file) {
    return json::parse(run_command({"info", file, "--json", "--device", "cpu"}).out);
  };
  const auto converted = [&](const std::string& from, const std::string& name,
                             const std::vector<std::string>& options) {
    const std::string to = folder / (name + ".qjulia.json");
    std::vector<std::string> arguments = {"convert", from, to, "--device", "cpu"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    REQUIRE(run_command(arguments).exit_code == 0);
    return to;
  };
  const std::string turned = converted(fitted().map, "turned", {"--rotate", "1", "1", "0", "40"});
  const json plain = info_of(fitted().map);
  CHECK_FALSE(plain.contains("diagonal"));
  CHECK(info_of(turned)["detail"] == plain["detail"]);
  CHECK(info_of(turned)["shell_thickness"] == plain["shell_thickness"]);
  for (const std::string detail : {"0.01", "auto"}) {
    CAPTURE(detail);
    const json last = info_of(converted(turned, "last", {"--detail", detail}));
    const json first = info_of(
        converted(fitted().map, "first", {"--detail", detail, "--rotate", "1", "1", "0", "40"}));
    // 'auto' measures the map's own surface, which is cut into other triangles after the turn.
    const double error = detail == "auto" ? 0.01 : 1e-9;
    CHECK(last["degree"].get<double>() ==
          Catch::Approx(first["degree"].get<double>()).epsilon(error));
    CHECK(last["diagonal"].get<double>() == Catch::Approx(first["diagonal"].get<double>()));
  }
  const std::string scene = folder / "turned.glb";
  REQUIRE(run_command({"surface", turned, "-o", scene, "--resolution", "16", "--iterations", "1",
                       "--device", "cpu"})
              .exit_code == 0);
  CHECK(info_of(converted(scene, "back", {}))["diagonal"] == info_of(turned)["diagonal"]);
}

TEST_CASE("an interrupted fit saves what it reached") {
  const TemporaryFolder folder;
  const std::string map = folder / "map.qjulia.json";
  // Far more work than the test waits for.
  const auto result = run_command({"fit", fitted().mesh, "-o", map, "--factors", "48", "--device",
                                   "cpu", "--max-evaluations", "100000", "--json"},
                                  {.interrupt_at = "IoU"});
  INFO(result.err);
  REQUIRE(result.interrupted);
  CHECK(result.exit_code == 130);
  CHECK(json::parse(result.out)["stopped"] == "interrupted");
  CHECK(run_command({"info", map}).exit_code == 0);
  // The checkpoint stays, to be resumed from.
  CHECK(folder.names() ==
        std::vector<std::string>{"map.qjulia.json", "map.qjulia.json.checkpoint"});
}

TEST_CASE("a time limit ends a fit with a map") {
  const TemporaryFolder folder;
  const std::string map = folder / "map.qjulia.json";
  // Far more evaluations than any device makes in that time.
  const auto result =
      run_command({"fit", fitted().mesh, "-o", map, "--factors", "48", "--device", "cpu",
                   "--time-limit", "2", "--max-evaluations", "1000000", "--json"});
  INFO(result.err);
  CHECK(result.exit_code == 0);
  CHECK(json::parse(result.out)["stopped"] == "time_limit");
  CHECK_THAT(result.err,
             ContainsSubstring("before it could settle") || ContainsSubstring("before its first"));
  CHECK(run_command({"info", map}).exit_code == 0);
}

TEST_CASE("a map becomes a closed surface in the shape's own place") {
  const TemporaryFolder folder;
  const std::string surface = folder / "torus.ply";
  const auto made = run_command({"surface", fitted().map, "-o", surface, "--resolution", "48",
                                 "--iterations", "1", "--device", "cpu", "--json"});
  INFO(made.err);
  REQUIRE(made.exit_code == 0);
  CHECK(json::parse(made.out)["closed"] == true);
  const auto info = run_command({"info", surface, "--json"});
  REQUIRE(info.exit_code == 0);
  const json mesh = json::parse(info.out);
  CHECK(mesh["closed"] == true);
  CHECK(mesh["triangles"] == json::parse(made.out)["triangles"]);
  // The torus spans 2.9 x 2.9 x 0.9 about the origin.
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double half = axis == 2 ? 0.45 : 1.45;
    CHECK(mesh["box"][0][axis].get<double>() == Catch::Approx(-half).margin(0.15));
    CHECK(mesh["box"][1][axis].get<double>() == Catch::Approx(half).margin(0.15));
  }
}

TEST_CASE("a map keeps how its shape stands, and what is made of it stands so") {
  const TemporaryFolder folder;
  // A torus lies flat with its axis, z, up.
  CHECK(fitted().report["up"] == "z");
  CHECK(json::parse(read_text(fitted().map))["up"] == "z");
  CHECK(json::parse(read_text(fitted().map))["provenance"]["options"]["up"] == "auto");
  const std::string hanging = folder / "hanging.qjulia.json";
  const auto fit = run_command(fitted().fit_to(hanging, {"--up", "-x"}));
  INFO(fit.err);
  REQUIRE(fit.exit_code == 0);
  CHECK_THAT(fit.out + fit.err, ContainsSubstring("up: -x\n"));
  CHECK(json::parse(read_text(hanging))["up"] == "-x");
  CHECK_THAT(run_command({"info", hanging, "--device", "cpu"}).out,
             ContainsSubstring("\nup            -x"));
  CHECK(json::parse(run_command({"info", fitted().mesh, "--json", "--device", "cpu"}).out)["up"] ==
        "z");

  const auto turned = folder / "standing.qjulia.json";
  REQUIRE(run_command({"convert", fitted().map, turned, "--up=-x"}).exit_code == 0);
  CHECK(json::parse(read_text(turned))["up"] == "-x");

  const auto height = [&](const std::string& map, const Arguments& more) {
    const std::string stl = folder / "print.stl";
    Arguments arguments = {"surface",      map, "-o",       stl,  "--resolution", "32",
                           "--iterations", "1", "--device", "cpu"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto surface = run_command(arguments);
    INFO(surface.err);
    REQUIRE(surface.exit_code == 0);
    const json box =
        json::parse(run_command({"info", stl, "--json", "--device", "cpu"}).out)["box"];
    return box[1][2].get<double>() - box[0][2].get<double>();
  };
  CHECK(height(fitted().map, {}) < 1.5);  // 0.9 thick
  CHECK(height(hanging, {}) > 2);         // 2.9 wide
  CHECK(height(hanging, {"--up", "-z"}) < 1.5);

  const auto picture = [&](const std::string& map, const Arguments& more) {
    const std::string png = folder / "picture.png";
    Arguments arguments = {"render", map,         "-o", png,        "--size",
                           "48x36",  "--samples", "1",  "--device", "cpu"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto render = run_command(arguments);
    INFO(render.err);
    REQUIRE(render.exit_code == 0);
    return read_png(png).pixels;
  };
  const auto as_it_stands = picture(fitted().map, {});
  CHECK(as_it_stands == picture(fitted().map, {"--up", "z"}));
  CHECK(as_it_stands == picture(hanging, {"--up", "z"}));
  CHECK(as_it_stands != picture(hanging, {}));
}

TEST_CASE("a map and a mesh become pictures") {
  const TemporaryFolder folder;
  for (const std::string& input : {fitted().map, fitted().mesh}) {
    const std::string picture = folder / "picture.png";
    const auto result = run_command({"render", input, "-o", picture, "--size", "96x64", "--samples",
                                     "1", "--device", "cpu", "--json"});
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    CHECK(json::parse(result.out)["width"] == 96);
    const qjulia::Image image = qjulia::test::read_png(picture);
    CHECK(image.width == 96);
    CHECK(image.height == 64);
    // The torus seen from 15 degrees above covers a fourth to a half of its frame.
    const double covered = json::parse(result.out)["covered_pixels"].get<double>() / (96 * 64);
    CHECK(covered > 0.15);
    CHECK(covered < 0.5);
    std::filesystem::remove(picture);
  }
}

TEST_CASE("a sweep gives a sheet and a numbered picture for each value") {
  const TemporaryFolder folder;
  const std::string sheet = folder / "sheet.png";
  const Arguments small = {"--size", "40x30", "--samples", "1", "--device", "cpu", "--json"};
  Arguments arguments = {"render", fitted().map, "-o", sheet, "--sweep", "detail=0.01:0.02:3"};
  arguments.insert(arguments.end(), small.begin(), small.end());
  const auto result = run_command(arguments);
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  const json values = json::parse(result.out)["made_with"]["sweep"]["values"];
  REQUIRE(values.size() == 3);
  CHECK(values[1].get<double>() == Catch::Approx(std::sqrt(0.01 * 0.02)));
  const qjulia::Image first = qjulia::test::read_png(folder / "sheet_001.png");
  CHECK(first.width == 40);
  CHECK(first.height == 30);
  CHECK(qjulia::test::mean_difference(first, qjulia::test::read_png(folder / "sheet_003.png")) >
        0.2);
  // Three in a row, captions below.
  CHECK(qjulia::test::read_png(sheet).width == 3 * 40);
  CHECK(qjulia::test::read_png(sheet).height > 30);
  CHECK(!std::filesystem::exists(folder / "sheet_004.png"));

  // Once around a mesh.
  arguments = {"render", fitted().mesh, "-o", sheet, "--turntable", "2"};
  arguments.insert(arguments.end(), small.begin(), small.end());
  const auto around = run_command(arguments);
  REQUIRE(around.exit_code == 0);
  const json listed = json::parse(around.out);
  CHECK(listed["made_with"]["sweep"]["name"] == "azimuth");
  CHECK(listed["pictures"].size() == 2);
}

TEST_CASE("compare gives figures at n = 1 and at n") {
  const Arguments arguments = {"compare",      fitted().map, fitted().mesh, "--resolution", "48",
                               "--iterations", "4",          "--device",    "cpu"};
  Arguments with_json = arguments;
  with_json.emplace_back("--json");
  const auto result = run_command(with_json);
  INFO(result.err);
  REQUIRE(result.exit_code == 0);
  const json metrics = json::parse(result.out)["metrics"];
  REQUIRE(metrics.size() == 2);
  CHECK(metrics[0]["iterations"] == 1);
  CHECK(metrics[1]["iterations"] == 4);
  CHECK(metrics[0]["iou"].get<double>() > 0.6);
  CHECK_THAT(run_command(arguments).out, ContainsSubstring("IoU"));
}

TEST_CASE("info tells a map's shell and a mesh's faults") {
  const auto map = run_command({"info", fitted().map, "--json"});
  REQUIRE(map.exit_code == 0);
  const json json_map = json::parse(map.out);
  CHECK(json_map["type"] == "map");
  const auto detail = json_map["detail"].get<double>();  // what `auto` gives this torus
  CHECK(detail == Catch::Approx(0.0087).epsilon(0.05));
  CHECK(json_map["shell_thickness"].get<double>() ==
        Catch::Approx(detail * std::sqrt(2 * 2.9 * 2.9 + 0.9 * 0.9)).epsilon(0.01));
  CHECK(json_map["outer_radius"].get<double>() > 1.5);
  CHECK(json_map["outer_radius"].get<double>() < 4);
  CHECK(json_map["field_at_origin"].get<double>() < json_map["surface_level"].get<double>());
  const auto precision =
      run_command({"info", fitted().map, "--check-precision", "--device", "cpu", "--json"});
  INFO(precision.err);
  REQUIRE(precision.exit_code == 0);
  const json check = json::parse(precision.out)["precision"];
  CHECK(check["points"].get<int>() > 5000);
  CHECK(check["different"].get<double>() < 0.005 * check["points"].get<double>());
  const auto torus = run_command({"info", fitted().mesh, "--json"});
  REQUIRE(torus.exit_code == 0);
  CHECK(json::parse(torus.out)["inradius"].get<double>() == Catch::Approx(0.45).epsilon(0.05));
  const TemporaryFolder folder;
  const auto open = run_command(
      {"info", folder.file("open.obj", qjulia::test::obj_text(qjulia::shapes::open_box())),
       "--json"});
  REQUIRE(open.exit_code == 0);
  CHECK(json::parse(open.out)["open_edges"] == 4);
  CHECK(json::parse(open.out)["closed"] == false);
}

TEST_CASE("--quiet is silent, and a result still goes to standard output") {
  const auto quiet = run_command(
      {"compare", fitted().map, fitted().mesh, "--resolution", "16", "--device", "cpu", "--quiet"});
  CHECK(quiet.exit_code == 0);
  CHECK(quiet.err.empty());
  CHECK_THAT(quiet.out, ContainsSubstring("IoU"));
}

TEST_CASE("a fit that was killed is resumed to the same map, and a finished one is left alone") {
  const TemporaryFolder folder;
  const auto fit_to = [&](const std::string& map, const Arguments& more = {}) {
    Arguments arguments = {
        "fit", fitted().mesh, "-o", map,        "--factors", "24", "--max-evaluations",
        "150", "--seed",      "3",  "--device", "cpu"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  const std::string whole = folder / "whole.qjulia.json", broken = folder / "broken.qjulia.json";
  REQUIRE(run_command(fit_to(whole)).exit_code == 0);
  CHECK_FALSE(std::filesystem::exists(whole + ".checkpoint"));

  RunOptions killed;
  killed.kill_at = "fitting";
  CHECK(run_command(fit_to(broken), killed).exit_code == 128 + 9);
  CHECK_FALSE(std::filesystem::exists(broken));
  REQUIRE(std::filesystem::exists(broken + ".checkpoint"));
  auto other = fit_to(broken, {"--resume"});
  other[5] = "25";
  const auto refused = run_command(other);
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("broken.qjulia.json.checkpoint"));

  REQUIRE(run_command(fit_to(broken, {"--resume"})).exit_code == 0);
  CHECK(without_provenance(broken) == without_provenance(whole));
  CHECK_FALSE(std::filesystem::exists(broken + ".checkpoint"));

  const auto time = std::filesystem::last_write_time(broken);
  const auto again = run_command(fit_to(broken, {"--resume"}));
  CHECK(again.exit_code == 0);
  CHECK_THAT(again.err, ContainsSubstring("is finished"));
  CHECK(std::filesystem::last_write_time(broken) == time);
}

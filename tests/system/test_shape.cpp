/// qjulia shape, and what it never does: overwrite an input, leave half a map, lose the shape
/// without a word.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "obj_text.hpp"
#include "process.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;
using Arguments = std::vector<std::string>;

namespace {

/// A folder with a mesh.
struct ShapeFiles {
  TemporaryFolder folder;
  std::string mesh = file("ball.obj", qjulia::shapes::sphere(3));

  std::string file(const char* name, const qjulia::TriangleMesh& of) const {
    return folder.file(name, obj_text(of)).string();
  }

  Arguments shape(const std::string& of, const std::string& output,
                  const Arguments& more = {}) const {
    Arguments all = {"shape", of, "-o", output, "--resolution", "32"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }

  std::map<std::string, std::string> contents() const {
    std::map<std::string, std::string> all;
    for (const auto& name : folder.names()) all[name] = read_text(folder / name);
    return all;
  }

  /// Names the word, leaves every file as it was, and no other.
  void check_refused(const Arguments& arguments, const std::string& word, int exit_code = 2) const {
    const auto before = contents();
    const ProcessResult result = run_command(arguments);
    CAPTURE(arguments, result.err);
    CHECK(result.exit_code == exit_code);
    CHECK_THAT(result.err, ContainsSubstring(word));
    CHECK(contents() == before);
  }
};

/// A box whose sides are 1, 1 and `thickness`.
qjulia::TriangleMesh plate(double thickness) {
  return qjulia::shapes::box({0, 0, 0}, {1, 1, thickness});
}

}  // namespace

TEST_CASE("a shape's map is whole, and its surface is the mesh's") {
  const ShapeFiles bench;
  const std::string map = bench.folder / "map.json", surface = bench.folder / "a.ply";
  const ProcessResult made = run_command(bench.shape(bench.mesh, map, {"--json"}));
  CAPTURE(made.err);
  REQUIRE(made.exit_code == 0);
  CHECK(json::parse(made.out)["map"] == map);
  CHECK(json::parse(read_text(map))["kind"] == "distance/factors");
  const ProcessResult compared =
      run_command({"compare", map, bench.mesh, "--resolution", "48", "--json"});
  REQUIRE(compared.exit_code == 0);
  CHECK(json::parse(compared.out)["metrics"][0]["iou"] > 0.95);
  const std::string first = read_text(map);
  REQUIRE(run_command(bench.shape(bench.mesh, map)).exit_code == 0);
  CHECK(read_text(map) == first);
}

TEST_CASE("a shape's output is no input, and no output of another kind") {
  const ShapeFiles bench;
  const auto in = [&](const char* name) { return bench.folder / name; };
  const std::string versor = in("versor.json");
  REQUIRE(run_command(bench.shape(bench.mesh, versor)).exit_code == 0);
  std::filesystem::create_hard_link(bench.mesh, in("hard.json"));
  std::filesystem::create_symlink("ball.obj", in("soft.json"));
  std::filesystem::create_symlink("loop.json", in("loop.json"));
  const std::string word = "would overwrite";
  bench.check_refused(bench.shape(bench.mesh, in("hard.json")), word);
  bench.check_refused(bench.shape(bench.mesh, in("soft.json")), word);
  bench.check_refused(bench.shape(bench.mesh, versor, {"--versor", versor}), word);
  bench.check_refused(bench.shape(bench.mesh, in("a.json"), {"--trace", bench.mesh}), word);
  bench.check_refused(bench.shape(bench.mesh, in("a.json"), {"--trace", in("a.json")}), word);
  bench.check_refused(
      bench.shape(bench.mesh, in("a.json"), {"--versor", versor, "--trace", versor}), word);
  bench.check_refused(bench.shape(bench.mesh, bench.mesh), "ball.obj");
  bench.check_refused(bench.shape(bench.mesh, in("a.png")), "a.png");
  bench.check_refused(bench.shape(bench.mesh, in("loop.json")), "symbolic links", 1);
  bench.check_refused(bench.shape(bench.mesh, in("")), "it is a folder", 1);
  bench.check_refused(bench.shape(bench.mesh, in("no/a.json")), "no folder", 1);
}

TEST_CASE("a shape's map goes into what is no regular file") {
  const ShapeFiles bench;
  CHECK(run_command(bench.shape(bench.mesh, "/dev/null")).exit_code == 0);
  CHECK(std::filesystem::is_character_file("/dev/null"));
  const ProcessResult full = run_command(bench.shape(bench.mesh, "/dev/full"));
  CHECK(full.exit_code == 1);
  CHECK_THAT(full.err, ContainsSubstring("cannot write '/dev/full'"));
  const ProcessResult piped = run_command(bench.shape(bench.mesh, "/dev/stdout"));
  CHECK(json::parse(piped.out)["format"] == "qjulia-map");
}

TEST_CASE("a shape that is stopped leaves the map that was there") {
  const ShapeFiles bench;
  const std::string mesh = bench.file("fine.obj", qjulia::shapes::sphere(6));
  const std::string map = bench.folder.file("map.json", "of an earlier run\n");
  const ProcessResult result = run_command({"shape", mesh, "-o", map, "--resolution", "384"},
                                           {.interrupt_at = "preparing the mesh"});
  CAPTURE(result.err);
  REQUIRE(result.interrupted);
  CHECK(result.exit_code == 130);
  CHECK_THAT(result.err, ContainsSubstring("nothing was written"));
  CHECK(read_text(map) == "of an earlier run\n");
  CHECK(bench.folder.names().size() == 3);
}

TEST_CASE("meshes that make no shape are refused, and thin ones are told") {
  const ShapeFiles bench;
  const std::string map = bench.folder / "map.json";
  const std::string empty = bench.folder.file("empty.obj", "");
  bench.check_refused(bench.shape(empty, map), "empty.obj");
  bench.check_refused(bench.shape(bench.folder / "missing.obj", map), "missing.obj");
  const std::string flat = bench.folder.file("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  bench.check_refused(bench.shape(flat, map), "no volume");
  bench.check_refused(bench.shape(bench.file("thin.obj", plate(0.02)), map),
                      "--resolution: 32 cells are too few");
  bench.check_refused(bench.shape(bench.file("thinner.obj", plate(0.001)), map),
                      "too thin for a grid");
  const ProcessResult told = run_command(bench.shape(bench.file("plate.obj", plate(0.05)), map));
  CAPTURE(told.err);
  CHECK(told.exit_code == 0);
  CHECK_THAT(told.err, ContainsSubstring("warning: ") && ContainsSubstring("--resolution"));
}

TEST_CASE("a set too thin for its grid asks for more cells, and an empty one for less detail") {
  const ShapeFiles bench;
  const std::string map = bench.folder / "map.json", mesh = bench.file("plate.obj", plate(0.05));
  REQUIRE(run_command(bench.shape(mesh, map)).exit_code == 0);
  const std::string surface = bench.folder / "set.ply";
  bench.check_refused({"surface", map, "-o", surface, "--resolution", "7", "--iterations", "1"},
                      "too thin for cells of this size; give a --resolution higher than 7", 1);
  bench.check_refused(
      {"surface", map, "-o", surface, "--resolution", "7", "--box", "2", "2", "2", "3", "3", "3"},
      "empty in this box; try a smaller --detail", 1);

  const Arguments compare = {"compare", map, mesh, "--resolution", "8"};
  const ProcessResult told = run_command(compare);
  CAPTURE(told.out, told.err);
  CHECK(told.exit_code == 0);
  CHECK_THAT(told.out, !ContainsSubstring("nan") &&
                           ContainsSubstring("undefined at n = 6: no cell's centre") &&
                           ContainsSubstring("higher resolution"));
  Arguments as_json = compare;
  as_json.emplace_back("--json");
  const ProcessResult result = run_command(as_json);
  REQUIRE(result.exit_code == 0);
  const auto metrics = nlohmann::json::parse(result.out)["metrics"];
  for (const auto& m : metrics) {
    CHECK(m["iou"].is_null());
    CHECK(m["energy"].is_null());
    CHECK_THAT(m["undefined"].get<std::string>(), ContainsSubstring("higher resolution"));
  }
}

TEST_CASE("a shape's versor is checked before the work") {
  const ShapeFiles bench;
  const std::string map = bench.folder / "map.json";
  const std::string quadratic = QJULIA_TEST_DATA "/../../docs/maps/quadratic.qjulia.json";
  for (const char* versor :
       {"random:", "random:0:1", "random:1e9", "noise:9", "noise:2:nan", "noise:2:9:-1",
        "noise:2:9:1:1", "missing.json", "", quadratic.c_str()}) {
    CAPTURE(versor);
    bench.check_refused(bench.shape(bench.mesh, map, {"--versor", versor}), "qjulia: ");
  }
}

TEST_CASE("a body that is inside out beside another is turned, with a warning, and not lost") {
  const ShapeFiles files;
  const auto other = qjulia::shapes::moved(qjulia::shapes::sphere(3), 0.6, {2.5, 0, 0});
  const auto ball = qjulia::shapes::sphere(3);
  const std::string right = files.file("right.obj", qjulia::shapes::joined(ball, other));
  const std::string wrong =
      files.file("wrong.obj", qjulia::shapes::joined(ball, qjulia::shapes::inside_out(other)));
  const char* const warning = "parts of the mesh are inside out (1 of 2)";
  const auto figures = [](const std::string& mesh) {
    return json::parse(run_command({"info", mesh, "--json"}).out);
  };
  const json info = figures(wrong);
  CHECK(info["figures"]["volume"].get<double>() ==
        Catch::Approx(figures(right)["figures"]["volume"].get<double>()));
  CHECK(info["turned_parts"] == 1);
  CHECK_THAT(info["warnings"].dump(), ContainsSubstring(warning));

  const std::string map = files.folder / "wrong.json", expected = files.folder / "right.json";
  const ProcessResult made = run_command(files.shape(wrong, map));
  REQUIRE(made.exit_code == 0);
  CHECK_THAT(made.err, ContainsSubstring(warning));
  REQUIRE(run_command(files.shape(right, expected)).exit_code == 0);
  CHECK(json::parse(read_text(map))["distance"] == json::parse(read_text(expected))["distance"]);

  const ProcessResult compared = run_command({"compare", expected, wrong, "--resolution", "32"});
  CHECK(compared.exit_code == 0);
  CHECK_THAT(compared.err, ContainsSubstring(warning));
  const ProcessResult fitted = run_command(
      {"fit", wrong, "-o", files.folder / "fit.json", "--factors", "8", "--max-evaluations", "2"});
  CHECK(fitted.exit_code == 0);
  CHECK_THAT(fitted.err, ContainsSubstring(warning) && !ContainsSubstring("overlap"));
}

TEST_CASE("a morph of fewer steps warns of the maps that a longer one left") {
  const ShapeFiles files;
  const std::string map = files.folder / "ball.json", steps = files.folder / "steps";
  REQUIRE(run_command(files.shape(files.mesh, map)).exit_code == 0);
  const auto warnings = [&](const char* count) {
    return run_command({"morph", map, map, "-o", steps, "--steps", count, "--flicker-cells", "0"})
        .err;
  };
  CHECK_THAT(warnings("3"), !ContainsSubstring("of a morph of more steps"));
  CHECK_THAT(warnings("2"), ContainsSubstring("step_0003.qjulia.json' and those after it are"));
}

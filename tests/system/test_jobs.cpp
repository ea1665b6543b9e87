/// `qjulia run`: what commands made is made again from what their files say.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "process.hpp"
#include "qjulia/map/map_file.hpp"
#include "shaped_map.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

using Words = std::vector<std::string>;

/// A folder with a map, a mesh of it, and another folder.
struct Workshop {
  TemporaryFolder folder;
  std::string map = folder / "small.qjulia.json";

  Workshop() { qjulia::write_map(shaped_map(), map); }
  std::string operator/(const std::string& name) const { return folder / name; }
  ProcessResult run(Words words) const {
    words.insert(words.end(), {"--device", "cpu"});
    auto result = run_command(words);
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return result;
  }
  /// Makes the file again, and compares the bytes. An .obj holds the name of its materials' file.
  void check_made_again(const std::string& name) const {
    CAPTURE(name);
    std::filesystem::create_directories(folder / "again");
    const std::string again = folder / ("again/" + name);
    run({"run", folder / name, "-o", again});
    CHECK(read_text(folder / name) == read_text(again));
  }
};

}  // namespace

TEST_CASE("pictures, meshes, maps, fields and pages are made again, byte for byte") {
  const Workshop shop;
  const std::string &map = shop.map, mesh = shop / "mesh.ply";
  shop.run({"surface", map, "-o", mesh, "--resolution", "24", "--phase", ".8", "-.6", "0", "0"});
  shop.check_made_again("mesh.ply");
  for (const char* name : {"mesh.glb", "mesh.obj", "mesh.usda", "mesh.3mf"}) {
    shop.run({"surface", map, "-o", shop / name, "--resolution", "16", "--material", "trap",
              "--palette", "000000,ff8000", "--up", "-z", "--metres", "+2"});
    shop.check_made_again(name);
  }
  shop.run({"render", map, "-o", shop / "picture.png", "--size", "32x24", "--samples", "1", "--cut",
            "z=50%", "--material", "groove", "--drift", "0.2"});
  shop.check_made_again("picture.png");
  shop.run(
      {"shape", mesh, "-o", shop / "shape.qjulia.json", "--versor", map, "--resolution", "32"});
  shop.check_made_again("shape.qjulia.json");
  shop.run({"paint", map, "-o", shop / "painted.qjulia.json", "--ball", "0", "0", "0", "0.1", "0.2",
            "--ball", "-0.5", "0", "0", "0.2", "0"});
  shop.check_made_again("painted.qjulia.json");
  shop.run({"convert", map, shop / "turned.qjulia.json", "--rotate", "0", "0", "1", "-30"});
  shop.check_made_again("turned.qjulia.json");
  shop.run({"sample", map, "-o", shop / "field.vti", "--resolution", "12", "--box", "-1", "-1",
            "-1", "1", "1", "1"});
  shop.check_made_again("field.vti");
  REQUIRE(run_command({"share", map, "-o", shop / "page.html"}).exit_code == 0);
  REQUIRE(run_command({"run", shop / "page.html", "-o", shop / "again.html"}).exit_code == 0);
  CHECK(read_text(shop / "page.html") == read_text(shop / "again.html"));
  // What was made of what was made says all that led to it.
  shop.run({"convert", shop / "painted.qjulia.json", shop / "last.qjulia.json", "--drift", "0.1"});
  const json jobs = json::parse(read_text(shop / "last.qjulia.json"))["provenance"]["jobs"];
  REQUIRE(jobs.size() == 2);
  CHECK(jobs[0]["command"] == "paint");
  CHECK(jobs[1]["options"] == json({{"in", "painted.qjulia.json"}, {"drift", 0.1}}));
}

TEST_CASE("a job is read whatever stands after it, and whatever its files are called") {
  const Workshop shop;
  const std::string odd = shop / "a--b \"c\\d\" é.qjulia.json";
  std::filesystem::copy_file(shop.map, odd);
  for (const char* name : {"f.vti", "m.usda", "m.ply", "m.3mf"}) {
    const bool is_field = std::string(name) == "f.vti";
    shop.run({is_field ? "sample" : "surface", odd, "-o", shop / name, "--resolution", "12"});
    shop.check_made_again(name);
  }
  // Bytes of vertices may look like brackets.
  shop.folder.file("brackets.ply", read_text(shop / "m.ply") + std::string(1000, '{'));
  CHECK(json::parse(shop.run({"run", shop / "brackets.ply", "--print"}).out)["command"] ==
        "surface");
}

TEST_CASE("a fit is made again, but for its times; each picture of a sweep is its own job") {
  const Workshop shop;
  const std::string mesh = shop / "mesh.ply";
  shop.run({"surface", shop.map, "-o", mesh, "--resolution", "24"});
  shop.run({"fit", mesh, "-o", shop / "fit.qjulia.json", "--factors", "8", "--max-evaluations", "5",
            "--seed", "3", "--schedule", "fast"});
  shop.run({"run", shop / "fit.qjulia.json", "-o", shop / "again.qjulia.json"});
  const auto timeless = [&](const char* name) {
    json map = json::parse(read_text(shop / name));
    map["provenance"].erase("seconds");
    for (json& stage : map["provenance"]["stages"]) stage.erase("seconds");
    return map;
  };
  CHECK(timeless("fit.qjulia.json") == timeless("again.qjulia.json"));

  const Words small{"--size", "24x18", "--samples", "1", "--material", "trap"};
  const auto sweep = [&](const char* of) {
    Words words{"render", shop.map, "-o", shop / "sweep.png", "--sweep", of};
    words.insert(words.end(), small.begin(), small.end());
    shop.run(words);
    shop.check_made_again("sweep_002.png");
    shop.check_made_again("sweep.png");
  };
  sweep("drift=0:0.2:2");
  sweep("phase-j=0:40:2");
  sweep("zoom=1:3:2");
  sweep("iterations=3,5");
}

TEST_CASE("a job may be changed, printed and written by hand") {
  const Workshop shop;
  shop.run({"render", shop.map, "-o", shop / "a.png", "--size", "24x18", "--samples", "1",
            "--no-ground", "--zoom", "2"});
  shop.run({"run", shop / "a.png", "size=32x24", "no_ground=false", "zoom=", "phase=1 0 0.5 0",
            "-o", shop / "b.png"});
  shop.run({"render", shop.map, "-o", shop / "c.png", "--size", "32x24", "--samples", "1",
            "--phase", "1", "0", "0.5", "0"});
  const auto pixels = [&](const char* name) {
    const std::string bytes = read_text(shop / name);
    return bytes.substr(bytes.find("IDAT"));
  };
  CHECK(pixels("b.png") == pixels("c.png"));

  // A file that a user names may lie anywhere.
  std::filesystem::create_directory(shop / "other");
  std::filesystem::copy_file(shop.map, shop / "other/own.qjulia.json");
  shop.run(
      {"run", shop / "a.png", "map=" + (shop / "other/own.qjulia.json"), "-o", shop / "f.png"});
  CHECK(pixels("a.png") == pixels("f.png"));

  const json job = json::parse(shop.run({"run", shop / "a.png", "--print"}).out);
  CHECK(job["command"] == "render");
  CHECK(job["options"]["no_ground"] == true);
  CHECK(job["options"]["zoom"] == 2);
  shop.folder.file("job.json", job.dump());
  shop.run({"run", shop / "job.json", "-o", shop / "d.png"});
  CHECK(read_text(shop / "a.png") == read_text(shop / "d.png"));

  std::filesystem::create_directory(shop / "maps");
  std::filesystem::rename(shop.map, shop / "maps/small.qjulia.json");
  shop.folder.file("job.toml",
                   "command = \"render\"\noptions = { map = \"maps/small.qjulia.json\", size = "
                   "\"24x18\", samples = 1, no_ground = true, zoom = 2 }\n");
  shop.run({"run", shop / "job.toml", "-o", shop / "e.png"});
  CHECK(pixels("a.png") == pixels("e.png"));
}

TEST_CASE("a job that cannot run says which of its members is wrong") {
  const Workshop shop;
  const auto refused = [&](const json& job, const std::string& why, const Words& more = {}) {
    Words words{"run", shop.folder.file("job.json", job.dump()), "-o", shop / "x.png"};
    words.insert(words.end(), more.begin(), more.end());
    const ProcessResult result = run_command(words);
    INFO(result.err);
    CHECK(result.exit_code == 2);
    CHECK_THAT(result.err, ContainsSubstring(why));
    CHECK(!std::filesystem::exists(shop / "x.png"));
  };
  const json options{{"map", "small.qjulia.json"}, {"zoom", 2}};
  const auto with = [&](const char* name, const json& value) {
    json changed = options;
    changed[name] = value;
    return json{{"command", "render"}, {"options", changed}};
  };
  refused({{"command", "render"}}, "no 'options'");
  refused({{"command", "draw"}, {"options", options}}, "there is no command 'draw'");
  refused({{"command", "doctor check"}, {"options", json::object()}}, "makes no file");
  refused({{"command", "render"}, {"options", options}, {"colour", 1}}, "'colour'");
  refused(with("zooom", 2), "no option 'zooom'");
  refused(with("device", "cpu"), "no option 'device'");
  refused(with("zoom", "wide"), "'wide' is not a number");
  refused(with("zoom", true), "zoom: it takes a value");
  refused(with("no_ground", 3), "no_ground: give true or false");
  refused(with("zoom", json::object()), "'zoom' must be");
  refused(with("map", "gone.qjulia.json"), "gone.qjulia.json");
  refused(with("zoom", 2), "NAME=VALUE", {"zoom"});
  refused(with("zoom", 2), "no option 'zooom'", {"zooom=3"});

  // A file that has changed, or is elsewhere; a job of another version.
  shop.run({"render", shop.map, "-o", shop / "a.png", "--size", "8x6", "--no-map"});
  const std::string before = read_text(shop.map);
  shop.folder.file("small.qjulia.json", before + " ");
  const Words again{"run", shop / "a.png", "-o", shop / "b.png"};
  const ProcessResult changed = run_command(again);
  CHECK(changed.exit_code == 2);
  CHECK_THAT(changed.err, ContainsSubstring("has changed") && ContainsSubstring("--changed"));
  Words taken = again;
  taken.emplace_back("--changed");
  CHECK_THAT(shop.run(taken).err, ContainsSubstring("has changed"));
  CHECK(read_text(shop / "a.png") != read_text(shop / "b.png"));  // it names the other bytes
  std::filesystem::create_directory(shop / "other");
  shop.folder.file("other/small.qjulia.json", before);
  Words elsewhere = again;
  elsewhere.insert(elsewhere.end(), {"--inputs", shop / "other"});
  shop.run(elsewhere);
  CHECK(read_text(shop / "a.png") == read_text(shop / "b.png"));

  json job = json::parse(shop.run({"run", shop / "a.png", "--print"}).out);
  job["version"] = "0.0.7";
  shop.folder.file("old.json", job.dump());
  CHECK_THAT(
      shop.run({"run", shop / "old.json", "-o", shop / "b.png", "--inputs", shop / "other"}).err,
      ContainsSubstring("version 0.0.7"));
  // A picture is not trusted with paths.
  job["options"]["map"] = "../small.qjulia.json";
  shop.folder.file("report.json", json{{"made_with", {{"job", job}}}}.dump());
  const ProcessResult outside = run_command({"run", shop / "report.json", "-o", shop / "b.png"});
  CHECK(outside.exit_code == 2);
  CHECK_THAT(outside.err, ContainsSubstring("names alone"));
  const json sly{{"command", "shape"}, {"options", {{"mesh", "m.obj"}, {"versor", "/etc/passwd"}}}};
  shop.folder.file("m.obj", "");
  shop.folder.file("sly.json", json{{"made_with", {{"job", sly}}}}.dump());
  const ProcessResult named = run_command({"run", shop / "sly.json", "-o", shop / "b.json"});
  CHECK(named.exit_code == 2);
  CHECK_THAT(named.err, ContainsSubstring("names alone"));
  // Nothing is replaced that nobody named.
  const ProcessResult unnamed = run_command({"run", shop / "mesh.stl"});
  CHECK(unnamed.exit_code == 2);
  CHECK_THAT(unnamed.err, ContainsSubstring("no room"));
}

/// Pictures and scenes that hold the map which they show.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "png_file.hpp"
#include "process.hpp"
#include "qjulia/map/map_file.hpp"
#include "shaped_map.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

struct Armed {
  TemporaryFolder folder;
  std::string file = folder / "armed ball.qjulia.json";

  Armed() { qjulia::write_map(shaped_map(), file); }
  ProcessResult run(std::vector<std::string> words) const {
    auto result = run_command(std::move(words));
    INFO(result.err);
    REQUIRE(result.exit_code == 0);
    return result;
  }
  /// What `info` says in JSON.
  json info(const std::string& of) const { return json::parse(run({"info", of, "--json"}).out); }
};

/// Draws the picture again: from its map, and from the map in it where that has gone.
void check_drawn_again(const Armed& armed, const std::string& picture) {
  const std::string again = armed.folder / "again.png", hidden = armed.file + ".hidden";
  armed.run({"run", picture, "-o", again});
  CHECK(read_text(picture) == read_text(again));
  std::filesystem::rename(armed.file, hidden);
  armed.run({"run", picture, "-o", again});
  CHECK(read_text(picture) == read_text(again));
  std::filesystem::rename(hidden, armed.file);
  std::filesystem::remove(again);
}

}  // namespace

TEST_CASE("a picture holds its map, and its job draws it again bit for bit") {
  const Armed armed;
  const std::string picture = armed.folder / "my picture.png";
  std::vector<std::string> words{"render", armed.file, "-o", picture, "--size", "96x72"};
  SECTION("with every setting") {
    for (const char* word : {"--drift",
                             "0.21",
                             "--phase",
                             "0.6",
                             "0.8",
                             "0",
                             "0",
                             "--lamp",
                             "-20.5,33.3,1.7,3200K,4",
                             "--lamp",
                             "100,20,0.5",
                             "--material",
                             "trap",
                             "--palette",
                             "ember",
                             "--azimuth",
                             "71.7",
                             "--elevation",
                             "-11",
                             "--zoom",
                             "1.37",
                             "--samples",
                             "1",
                             "--iterations",
                             "5",
                             "--no-ground",
                             "--background",
                             "102030",
                             "--cut",
                             "z=63%",
                             "--look-at",
                             "0.1",
                             "-0.2",
                             "0.05",
                             "--up",
                             "z",
                             "--keep-loose",
                             "--exact",
                             "--field-of-view",
                             "41"}) {
      words.emplace_back(word);
    }
    armed.run(words);
    const json info = armed.info(picture);
    CHECK(info.at("holds_map") == true);
    CHECK_THAT(info.at("command").get<std::string>(),
               ContainsSubstring("--lamp -20.5,33.3,1.7,3200K,4 --lamp 100,20,0.5") &&
                   ContainsSubstring("--drift 0.21"));
    check_drawn_again(armed, picture);
  }
  SECTION("with a palette that was spread") {
    words.insert(words.end(), {"--material", "trap", "--cut", "z=60%"});
    armed.run(words);
    CHECK(armed.info(picture).at("made_with").at("picture").at("range").size() > 2);
    check_drawn_again(armed, picture);
  }
  SECTION("with none") {
    armed.run(words);
    check_drawn_again(armed, picture);
    // What is drawn again holds the same map.
    CHECK(to_json(qjulia::read_map(picture)) == to_json(qjulia::read_map(armed.file)));
  }
  SECTION("without the map, by the file that it was made from") {
    words.insert(words.end(), {"--no-map", "--drift", "0.2", "--palette", "ff8000"});
    armed.run(words);
    const json info = armed.info(picture);
    CHECK(info.at("holds_map") == false);
    CHECK_THAT(info.at("command").get<std::string>(),
               ContainsSubstring("'armed ball.qjulia.json'") && ContainsSubstring("--drift 0.2"));
    const auto refused = run_command({"sample", picture, "-o", armed.folder / "f.npy"});
    CHECK(refused.exit_code == 2);
    CHECK_THAT(refused.err,
               ContainsSubstring("my picture.png") && ContainsSubstring("holds no map"));
  }
}

TEST_CASE("commands read the map of pictures and scenes, with its knobs turned") {
  const Armed armed;
  const auto in = [&](const char* name) { return armed.folder / name; };
  armed.run({"convert", armed.file, in("turned.qjulia.json"), "--drift", "0.2"});
  armed.run({"render", armed.file, "-o", in("a.png"), "--size", "32x24", "--drift", "0.2"});
  armed.run({"surface", armed.file, "-o", in("a.glb"), "--resolution", "24", "--drift", "0.2"});
  armed.run({"surface", armed.file, "-o", in("bare.glb"), "--resolution", "24", "--no-map"});
  const auto content = [](const std::string& file) {
    json map = to_json(qjulia::read_map(file));
    map.erase("provenance");
    map.erase("up");
    map.erase("version");
    return map;
  };
  CHECK(content(in("a.png")) == content(in("turned.qjulia.json")));
  CHECK(content(in("a.glb")) == content(in("turned.qjulia.json")));
  armed.run({"convert", in("a.glb"), in("back.qjulia.json")});
  armed.run({"render", in("a.glb"), "-o", in("b.png"), "--size", "32x24"});
  CHECK(read_png(in("a.png")).pixels == read_png(in("b.png")).pixels);
  // It stays a mesh for those that take meshes.
  CHECK(armed.info(in("a.glb")).at("type") == "mesh");
  CHECK(armed.info(in("a.glb")).at("holds_map") == true);
  CHECK(armed.info(in("bare.glb")).at("holds_map") == false);
  const auto refused = run_command({"sample", in("bare.glb"), "-o", in("f.npy")});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("bare.glb") && ContainsSubstring("is a mesh"));
  // Of a turntable, each picture has its map, and the sheet has none.
  armed.run({"render", armed.file, "-o", in("t.png"), "--size", "32x24", "--turntable", "2"});
  CHECK(qjulia::holds_map(in("t_002.png")));
  CHECK_FALSE(qjulia::holds_map(in("t.png")));
  const std::string bytes = read_text(in("a.png"));
  armed.folder.file("cut.png", bytes.substr(0, bytes.find("qjMp") + 60));
  const auto cut = run_command({"render", in("cut.png"), "-o", in("c.png")});
  CHECK(cut.exit_code == 2);
  CHECK_THAT(cut.err, ContainsSubstring("cut.png") && ContainsSubstring("is cut off"));
}

TEST_CASE("explore opens the view of a picture, with its lamp and palette") {
  const Armed armed;
  const std::string picture = armed.folder / "view.png";
  armed.run({"render",       armed.file,   "-o",        picture, "--size", "32x24",
             "--lamp",       "-20,30,1.5", "--azimuth", "40",    "--zoom", "2",
             "--look-at",    "0.1",        "-0.2",      "0.3",   "--cut",  "y=70%",
             "--material",   "trap",       "--palette", "ice",   "--up",   "z",
             "--iterations", "4"});
  RunOptions options;
  options.interrupt_at = "Ctrl-C";
  const auto opened = run_command({"explore", picture}, options);
  INFO(opened.err);
  CHECK(opened.interrupted);
  const std::string state = opened.out.substr(opened.out.find('#') + 1);
  for (const char* part :
       {"iterations=4", "azimuth=40.0", "zoom=2.0", "look=0.1,-0.2,0.3", "up=z", "material=trap",
        "palette=ice", "lightaz=-20.0", "lightup=30.0", "light=1.5", "cuty=70"}) {
    CHECK_THAT(state, ContainsSubstring(part));
  }
}

TEST_CASE(
    "a formula with fewer factors needs a map of factors, and leaves small ones as they are") {
  const Armed armed;
  const std::string text = armed.folder / "a.fract", same = armed.folder / "b.fract";
  armed.run({"convert", armed.file, text, "--device", "cpu"});
  armed.run({"convert", armed.file, same, "--factors-at-most", "12", "--device", "cpu"});
  CHECK(read_text(text) == read_text(same));
  CHECK_THAT(read_text(text), ContainsSubstring("# Mandelbulber settings file\n# version") &&
                                  ContainsSubstring("formula_1 10000;") &&
                                  ContainsSubstring("\nformula_code AAA"));
  const std::string quadratic = armed.folder / "q.qjulia.json";
  qjulia::write_map(qjulia::quadratic_map({-0.2, 0.8, 0, 0}), quadratic);
  const auto refused = run_command({"convert", quadratic, same, "--factors-at-most", "8"});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err,
             ContainsSubstring("--factors-at-most") && ContainsSubstring("q.qjulia.json"));
}

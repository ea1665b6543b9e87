/// Films: scripts in, pictures and films out.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <fstream>
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

namespace {

constexpr const char* kScript = R"([film]
map = "ball.qjulia.json"
seconds = 2
rate = 3
step = "linear"
[options]
size = "32x24"
samples = 1
material = "trap"
[[key]]
at = 0
azimuth = 0
detail = 0.01
[[key]]
at = 2
azimuth = 180
detail = 0.05
)";

struct Studio {
  TemporaryFolder folder;
  std::string script = folder.file("turn.toml", kScript);

  Studio() {
    qjulia::Map ball;
    ball.dynamics.factors = {{{}, 12}, {{0.5, 0.3, 0, 0.2}, -1}};
    ball.frame.box = qjulia::Box{{-1, -1, -1}, {1, 1, 1}};
    ball.frame.detail = 0.01;
    ball.frame.diagonal = 3.4;
    ball.frame.inradius = 1;
    qjulia::write_map(ball, folder / "ball.qjulia.json");
  }

  std::string refused(const std::string& text) const {
    const auto result = run_command(
        {"film", "make", folder.file("bad.toml", text), "-o", folder / "bad", "--device", "cpu"});
    CHECK(result.exit_code == 2);
    CHECK_FALSE(std::filesystem::exists(folder / "bad"));
    return result.err;
  }
};

ProcessResult film(const Studio& studio, const std::string& output,
                   std::vector<std::string> more = {}, const RunOptions& options = {}) {
  std::vector<std::string> words{"film",   studio.script, "-o", studio.folder / output,
                                 "--json", "--device",    "cpu"};
  words.insert(words.end(), more.begin(), more.end());
  return run_command(words, options);
}

std::string frame(const Studio& studio, const std::string& folder, int number) {
  return read_text(studio.folder / (folder + "/frame_000" + std::to_string(number) + ".png"));
}

}  // namespace

TEST_CASE("a film's pictures are the same however they are drawn, and each can be made again") {
  const Studio studio;
  const auto whole = film(studio, "whole");
  INFO(whole.err);
  REQUIRE(whole.exit_code == 0);
  const json said = json::parse(whole.out);
  CHECK(said["pictures"] == 6);
  CHECK(said["drawn"] == 6);
  CHECK((frame(studio, "whole", 1) != frame(studio, "whole", 6)));
  // In two parts, by two machines, the second one first.
  CHECK(film(studio, "parts", {"--frames", "4:6"}).exit_code == 0);
  CHECK_FALSE(std::filesystem::exists(studio.folder / "parts/frame_0003.png"));
  CHECK(film(studio, "parts", {"--frames", "1:3"}).exit_code == 0);
  // Killed and gone on with.
  const auto killed =
      film(studio, "killed", {}, {.kill_once = studio.folder / "killed/frame_0002.png"});
  CHECK(killed.exit_code == 128 + SIGKILL);
  const auto rest = film(studio, "killed");
  REQUIRE(rest.exit_code == 0);
  CHECK(json::parse(rest.out)["drawn"] < 6);
  for (int i = 1; i <= 6; ++i) {
    CHECK((frame(studio, "parts", i) == frame(studio, "whole", i)));  // bytes are not for eyes
    CHECK((frame(studio, "killed", i) == frame(studio, "whole", i)));
  }
  // Another script's pictures are drawn anew.
  std::string other = kScript;
  other.replace(other.find("180"), 3, "170");
  studio.folder.file("turn.toml", other);
  CHECK(json::parse(film(studio, "whole").out)["drawn"] == 6);
  const auto alone =
      run_command({"run", studio.folder / "parts/frame_0005.png", "--inputs",
                   studio.folder.path().string(), "-o", studio.folder / "again.png"});
  INFO(alone.err);
  REQUIRE(alone.exit_code == 0);
  CHECK(read_png(studio.folder / "again.png").pixels ==
        read_png(studio.folder / "parts/frame_0005.png").pixels);
}

TEST_CASE("FFmpeg gets the pictures, and where it fails they are kept with the command") {
  const Studio studio;
  std::filesystem::create_directory(studio.folder / "bin");
  const std::string program =
      studio.folder.file("bin/ffmpeg",
                         "#!/bin/sh\n"
                         "echo \"$@\" > \"$0.words\"\n"
                         "for last; do :; done\n"
                         "last=${last#file:}\n"
                         "[ -e \"$0.fail\" ] && { echo 'no encoder' >&2; exit 3; }\n"
                         "echo film > \"$last\"\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const RunOptions with_it{.environment = {{"PATH", studio.folder / "bin:/usr/bin:/bin"}}};
  const auto made = film(studio, "turn.mp4", {}, with_it);
  INFO(made.err);
  REQUIRE(made.exit_code == 0);
  CHECK(read_text(studio.folder / "turn.mp4") == "film\n");
  CHECK_FALSE(std::filesystem::exists(studio.folder / "turn.frames"));
  // What else is in the folder stays.
  std::filesystem::create_directory(studio.folder / "mine.frames");
  studio.folder.file("mine.frames/thesis.txt", "precious");
  CHECK(film(studio, "mine.mp4", {}, with_it).exit_code == 0);
  CHECK(read_text(studio.folder / "mine.frames/thesis.txt") == "precious");
  CHECK_FALSE(std::filesystem::exists(studio.folder / "mine.frames/frame_0001.png"));
  const std::string words = read_text(program + ".words");
  CHECK_THAT(words, ContainsSubstring("-framerate 3 ") && ContainsSubstring("libx264") &&
                        ContainsSubstring("yuv420p") &&
                        ContainsSubstring("\"command\":\"film make\""));
  CHECK(film(studio, "kept.gif", {"--keep-frames"}, with_it).exit_code == 0);
  CHECK(std::filesystem::exists(studio.folder / "kept.frames/frame_0006.png"));
  std::ofstream(program + ".fail") << "";
  const auto failed = film(studio, "not.webm", {}, with_it);
  CHECK(failed.exit_code == 1);
  CHECK_THAT(failed.err, ContainsSubstring("no encoder") && ContainsSubstring("not.frames") &&
                             ContainsSubstring("the command was: ffmpeg -hide_banner") &&
                             ContainsSubstring("libsvtav1"));
  CHECK(std::filesystem::exists(studio.folder / "not.frames/frame_0006.png"));
  CHECK_FALSE(std::filesystem::exists(studio.folder / "not.webm"));
  const auto without =
      film(studio, "none.mp4", {}, {.environment = {{"PATH", studio.folder / "none"}}});
  CHECK(without.exit_code == 1);
  CHECK_THAT(without.err, ContainsSubstring("install FFmpeg"));
}

TEST_CASE("a sheet shows the film, and its templates can be filmed") {
  const Studio studio;
  const auto sheet = run_command({"film", "sheet", studio.script, "-o", studio.folder / "s.png",
                                  "--pictures", "4", "--json", "--device", "cpu"});
  REQUIRE(sheet.exit_code == 0);
  CHECK(json::parse(sheet.out)["pictures"] == 4);
  for (const char* name : {"turntable", "dissolve", "dive", "breathe"}) {
    INFO(name);
    const auto script = run_command({"film", "template", name});
    REQUIRE(script.exit_code == 0);
    std::string text = script.out;
    text.replace(text.find("bunny.qjulia.json"), 17, "ball.qjulia.json");
    text.replace(text.find("960x720"), 7, "16x12");
    const std::string file = studio.folder.file(std::string(name) + ".toml", text);
    const auto shown = run_command({"film", "sheet", file, "-o", studio.folder / "t.png",
                                    "--pictures", "2", "--device", "cpu"});
    INFO(shown.err);
    CHECK(shown.exit_code == 0);
  }
  CHECK(run_command({"film", "template", "none"}).exit_code == 2);
}

TEST_CASE("keys may stand in a table, and what is wrong with a script is named by its line") {
  const Studio studio;
  studio.folder.file("keys.csv", "at,zoom,look-at\n0,1,0 0 0\n1,,0.1 0 0\n2,4,0.2 0.1 0\n");
  studio.folder.file("zoom.toml",
                     "[film]\nmap = \"ball.qjulia.json\"\nseconds = 2\nrate = 1\nkeys = "
                     "\"keys.csv\"\n[options]\nsize = \"16x12\"\nsamples = 1\n");
  const std::string film = "[film]\nmap = \"ball.qjulia.json\"\nseconds = 1\n";
  const auto zoomed =
      run_command({"film", studio.folder / "zoom.toml", "-o", studio.folder / "zoom", "--json",
                   "--device", "cpu", "--seconds", "4"});
  INFO(zoomed.err);
  REQUIRE(zoomed.exit_code == 0);
  CHECK(json::parse(zoomed.out)["pictures"] == 4);
  // Files of options lie beside the script, and pictures call them by their names.
  studio.folder.file("mine.toml", "roughness = 0.2\n");
  studio.folder.file("look.toml", film + "[options]\nlook = \"mine.toml\"\nsize = \"16x12\"\n");
  const auto looked = run_command({"film", studio.folder / "look.toml", "-o",
                                   studio.folder / "look", "--seconds", "0.04", "--device", "cpu"});
  INFO(looked.err);
  REQUIRE(looked.exit_code == 0);
  const auto told = run_command({"info", studio.folder / "look/frame_0001.png", "--json"});
  CHECK(json::parse(told.out)["made_with"]["job"]["options"]["look"] == "mine.toml");
  CHECK_THAT(studio.refused("[film]\nmap = \"ball.qjulia.json\"\n"),
             ContainsSubstring("bad.toml:1: [film] has no seconds"));
  CHECK_THAT(studio.refused(film + "speed = 3\n"),
             ContainsSubstring("bad.toml:4: 'speed' is not known"));
  CHECK_THAT(studio.refused(film + "[[key]]\nazimuth = 3\n"), ContainsSubstring("has no 'at'"));
  CHECK_THAT(studio.refused(film + "[[key]]\nat = 0\nazimut = 3\n"),
             ContainsSubstring("bad.toml:6: azimut: there is no such setting"));
  CHECK_THAT(studio.refused(film + "[[key]]\nat = 0\nlook_at = 3\n"),
             ContainsSubstring("look_at: give 3 numbers"));
  CHECK_THAT(studio.refused(film + "[[key]]\nat = 0\nzoom = -1\n"), ContainsSubstring("above 0"));
  CHECK_THAT(studio.refused(film + "[[key]]\nat = 0\nstep = \"fast\"\nzoom = 1\n"),
             ContainsSubstring("hold, linear, ease, spline"));
  CHECK_THAT(studio.refused(film + "[[key]]\nat = 0\nelevation = 91\n"),
             ContainsSubstring("elevation at 0 seconds"));
  CHECK_THAT(studio.refused(film + "[options]\nsize = \"big\"\n"),
             ContainsSubstring("bad.toml:4: [options]: "));
  CHECK_THAT(studio.refused(film + "keys = \"none.csv\"\n"), ContainsSubstring("none.csv"));
  CHECK_THAT(studio.refused(film + "[options]\nlook_at = [true, 0, 0]\n"),
             ContainsSubstring("'look_at' must be a number"));
  CHECK_THAT(studio.refused(film + "[[key]]\nat = 0\nphase_i = 1\nphase_j = 2\n"),
             ContainsSubstring("'phase-i' moves the same"));
  studio.folder.file("ball.obj", obj_text(qjulia::shapes::sphere(1)));
  CHECK_THAT(
      studio.refused("[film]\nmap = \"ball.obj\"\nseconds = 1\n[[key]]\nat = 0\ndrift = 1\n"),
      ContainsSubstring("needs a map"));
  CHECK_THAT(studio.refused(film + "[keys]\n"), ContainsSubstring("'keys' is not known here"));
  CHECK(run_command({"film", studio.script, "-o", studio.folder / "x", "--frames", "5:9"})
            .exit_code == 2);
  CHECK(run_command({"film", studio.script, "-o", studio.folder / "x.avi"}).exit_code == 2);
}

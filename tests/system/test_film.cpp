/// Films: scripts in, pictures and films out.

#include <sys/stat.h>

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "batch/folder_lock.hpp"
#include "film_studio.hpp"
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

struct Studio : FilmStudio {
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
  return studio.frame(folder, number);
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
  // Two at a time.
  CHECK(film(studio, "both", {"--jobs", "2"}).exit_code == 0);
  for (int i = 1; i <= 6; ++i) CHECK((frame(studio, "both", i) == frame(studio, "whole", i)));
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
  const auto failed = film(studio, "not.mp4", {}, with_it);
  CHECK(failed.exit_code == 1);
  CHECK_THAT(failed.err, ContainsSubstring("no encoder") && ContainsSubstring("not.frames") &&
                             ContainsSubstring("the command was: ffmpeg -hide_banner") &&
                             ContainsSubstring("libx264"));
  CHECK(std::filesystem::exists(studio.folder / "not.frames/frame_0006.png"));
  CHECK_FALSE(std::filesystem::exists(studio.folder / "not.mp4"));
  const auto without =
      film(studio, "none.mp4", {}, {.environment = {{"PATH", studio.folder / "none"}}});
  CHECK(without.exit_code == 1);
  CHECK_THAT(without.err, ContainsSubstring("install FFmpeg"));
}

TEST_CASE("whatever happens to FFmpeg or the disk, pictures stay and the command is told") {
  const Studio studio;
  std::filesystem::create_directory(studio.folder / "bin");
  const std::string program = studio.folder / "bin/ffmpeg";
  const RunOptions with_it{.environment = {{"PATH", studio.folder / "bin:/usr/bin:/bin"}}};
  const auto become = [&](const std::string& does) {
    studio.folder.file("bin/ffmpeg",
                       "#!/bin/sh\nfor last; do :; done\nlast=${last#file:}\n" + does);
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  };
  // Runs a film; its pictures are drawn the first time alone.
  const auto fails = [&](const std::string& output, const std::string& because) {
    const auto failed = film(studio, output, {}, with_it);
    INFO(failed.err);
    CHECK(failed.exit_code == 1);
    const std::string folder = output.substr(0, output.find('.')) + ".frames";
    CHECK_THAT(failed.err, ContainsSubstring("kept in '" + (studio.folder / folder)) &&
                               ContainsSubstring(because) &&
                               ContainsSubstring("\nthe command was: ffmpeg -hide_banner"));
    for (int i = 1; i <= 6; ++i) CHECK_FALSE(frame(studio, folder, i).empty());
    for (const auto& entry : std::filesystem::directory_iterator(studio.folder / folder)) {
      CHECK(entry.path().filename().string().find("unfinished") == std::string::npos);
    }
    return failed.err.substr(failed.err.find("ffmpeg -hide_banner"));
  };
  become("echo half > \"$last\"\nkill -9 $$\n");
  const std::string command = fails("turn.mp4", "signal 9 ended it");
  become("echo half > \"$last\"\necho 'No space left on device' >&2\nexit 1\n");
  fails("turn.mp4", "No space left on device");
  become("exit 228\n");
  fails("turn.mp4", "FFmpeg ended with code 228 and said nothing");
  become("exit 3\n");
  fails("turn.mp4", "FFmpeg ended with code 3 and said nothing");
  become("exit 0\n");
  fails("turn.mp4", "cannot read");
  // The disk that the film goes to is full.
  become("echo film > \"$last\"\n");
  std::filesystem::create_symlink("/dev/full", studio.folder / "full.mp4");
  fails("full.mp4", "full.mp4");
  // The command that the message prints makes the film.
  CHECK_FALSE(std::filesystem::exists(studio.folder / "turn.mp4"));
  const auto by_hand = run({"/bin/sh", "-c", command}, with_it);
  INFO(by_hand.err);
  CHECK(by_hand.exit_code == 0);
  CHECK(read_text(studio.folder / "turn.mp4") == "film\n");
  // Stopped while FFmpeg works, which is ended too.
  become("echo \"$$\" > \"$0.process\"\nexec sleep 100\n");
  const auto stopped = film(studio, "turn.mp4", {},
                            {.environment = with_it.environment, .interrupt_at = "encoding"});
  CHECK(stopped.exit_code == 130);
  CHECK_THAT(stopped.err, ContainsSubstring("6 of 6 pictures are in"));
  CHECK(read_text(studio.folder / "turn.mp4") == "film\n");
  CHECK_FALSE(frame(studio, "turn.frames", 6).empty());
  // Where it is missing, the film is not begun without a word.
  const auto without =
      film(studio, "turn.mp4", {}, {.environment = {{"PATH", studio.folder / "none"}}});
  CHECK(without.exit_code == 1);
  CHECK_THAT(without.err, ContainsSubstring("FFmpeg is not installed: the pictures") &&
                              ContainsSubstring("install FFmpeg"));
  // At last all is well, and nothing is drawn again.
  become("echo film > \"$last\"\n");
  const auto made = film(studio, "turn.mp4", {}, with_it);
  CHECK(made.exit_code == 0);
  CHECK(json::parse(made.out)["drawn"] == 0);
  CHECK_FALSE(std::filesystem::exists(studio.folder / "turn.frames"));
}

TEST_CASE("a dive into a portal ends as it begins") {
  const Studio studio;
  qjulia::Map map = qjulia::read_map(studio.folder / "ball.qjulia.json");
  map.layers.portals = {{{0, 1.25, 0}, 0.4, 5, {}, {0, 0, 0}, qjulia::PortalMask::outside}};
  qjulia::write_map(map, studio.folder / "stack.qjulia.json");
  const std::string begin = "[film]\nmap = \"stack.qjulia.json\"\nseconds = 1\nrate = 4\n[dive]\n";
  const std::string options =
      "[options]\nsize = \"48x36\"\nsamples = 1\nno_ground = true\nelevation = 0\n";
  const std::string script = studio.folder.file("dive.toml", begin + options);
  const std::vector<std::string> words{"film",   script,     "-o", studio.folder / "dive",
                                       "--json", "--device", "cpu"};
  const auto made = run_command(words);
  INFO(made.err);
  REQUIRE(made.exit_code == 0);
  const json said = json::parse(made.out);
  CHECK(said["pictures"] == 4);
  CHECK(said["seam"] < 2);
  CHECK_FALSE(std::filesystem::exists(studio.folder / "dive/frame_0005.png"));
  CHECK(json::parse(run_command(words).out)["seam"] == said["seam"]);  // it is remembered
  const auto sheet = run_command(
      {"film", "sheet", script, "-o", studio.folder / "dive.png", "--json", "--device", "cpu"});
  CHECK(json::parse(sheet.out)["pictures"] == 4);
  // A rate that leaves part of a picture over ends in the same place.
  const std::string uneven = studio.folder.file(
      "uneven.toml",
      "[film]\nmap = \"stack.qjulia.json\"\nseconds = 1\nrate = 4.6\n[dive]\n" + options);
  const auto five =
      run_command({"film", uneven, "-o", studio.folder / "uneven", "--json", "--device", "cpu"});
  CHECK(json::parse(five.out)["pictures"] == 5);
  CHECK(json::parse(five.out)["seam"] < 2);
  // The film shows the pictures as often as it is deep.
  std::filesystem::create_directory(studio.folder / "bin");
  const std::string program = studio.folder.file("bin/ffmpeg",
                                                 "#!/bin/sh\n"
                                                 "echo \"$@\" > \"$0.words\"\n"
                                                 "for last; do :; done\n"
                                                 "echo film > \"${last#file:}\"\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const std::string deep = studio.folder.file("deep.toml", begin + "copies = 9\n" + options);
  const auto filmed =
      run_command({"film", deep, "-o", studio.folder / "deep.mp4", "--device", "cpu"},
                  {.environment = {{"PATH", studio.folder / "bin:/usr/bin:/bin"}}});
  INFO(filmed.err);
  REQUIRE(filmed.exit_code == 0);
  CHECK_THAT(read_text(program + ".words"),
             ContainsSubstring("-stream_loop 8 -i ") && ContainsSubstring("-frames:v 36 "));
  // FFmpeg would repeat a longer film's pictures, too.
  std::filesystem::create_directory(studio.folder / "deep.frames");
  studio.folder.file("deep.frames/frame_0005.png", "of a longer film");
  const auto further =
      run_command({"film", deep, "-o", studio.folder / "deep.mp4", "--device", "cpu"},
                  {.environment = {{"PATH", studio.folder / "bin:/usr/bin:/bin"}}});
  CHECK(further.exit_code == 2);
  CHECK_THAT(further.err, ContainsSubstring("deep.frames/frame_0005.png' is of a longer film"));
  // A seam is told: the lamps are brighter at the end.
  const std::string bright = studio.folder.file(
      "bright.toml",
      begin + options + "[[key]]\nat = 0\nexposure = 0\n[[key]]\nat = 1\nexposure = 1\n");
  const auto seamed =
      run_command({"film", bright, "-o", studio.folder / "bright", "--json", "--device", "cpu"});
  CHECK(json::parse(seamed.out)["seam"] > 2);
  CHECK_THAT(seamed.err, ContainsSubstring("the dive will show a seam"));
  // Keys of zoom show less from the same place, and are not made good by it.
  const std::string zooming = studio.folder.file(
      "zooming.toml", begin + options + "[[key]]\nat = 0\nzoom = 1\n[[key]]\nat = 1\nzoom = 3\n");
  const auto way_of = [&](const std::string& from) {
    const std::string scene = studio.folder / "way.usda";
    CHECK(run_command({"film", "scene", from, "-o", scene, "--device", "cpu"}).exit_code == 0);
    const std::string text = read_text(scene);
    return text.substr(text.find("xformOp:transform"));
  };
  CHECK(way_of(zooming) == way_of(script));
  CHECK_THAT(studio.refused(begin + "portal = 2\n" + options),
             ContainsSubstring("bad.toml:5: [dive]: portal 2: there is no portal 2"));
  CHECK_THAT(studio.refused(begin + "copies = 0\ndepth = 3\n" + options),
             ContainsSubstring("bad.toml:6: copies: give a whole number, 1 to 1000") &&
                 ContainsSubstring("bad.toml:7: 'depth' is not known in [dive]"));
  CHECK_THAT(studio.refused(begin + options + "[[key]]\nat = 0\nazimuth = 3\n"),
             ContainsSubstring("bad.toml:13: azimuth: a [dive] leaves no room for keys of it"));
  CHECK_THAT(studio.refused(begin + options + "scale = 2\n"),
             ContainsSubstring("it would be moved by the options"));
  CHECK_THAT(studio.refused("[film]\nmap = \"ball.qjulia.json\"\nseconds = 1\n[dive]\n"),
             ContainsSubstring("bad.toml:4: [dive]: portal 1: the map has no portal"));
}

TEST_CASE("a film goes through links and into pipes, and its folder is one command's") {
  const Studio studio;
  std::filesystem::create_directory(studio.folder / "bin");
  const std::string program = studio.folder.file("bin/ffmpeg",
                                                 "#!/bin/sh\n"
                                                 "for last; do :; done\n"
                                                 "echo film > \"${last#file:}\"\n");
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const RunOptions with_it{.environment = {{"PATH", studio.folder / "bin:/usr/bin:/bin"}}};
  const auto is_link = [&](const std::string& name) {
    return std::filesystem::is_symlink(studio.folder / name);
  };
  studio.folder.file("old.mp4", "old");
  std::filesystem::create_symlink("old.mp4", studio.folder / "link.mp4");
  CHECK(film(studio, "link.mp4", {}, with_it).exit_code == 0);
  CHECK(is_link("link.mp4"));
  CHECK(read_text(studio.folder / "old.mp4") == "film\n");
  const std::string pipe = studio.folder / "pipe.mp4";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  std::string got;
  std::jthread reader([&] { got = read_text(pipe); });
  CHECK(film(studio, "pipe.mp4", {}, with_it).exit_code == 0);
  reader.join();
  CHECK(got == "film\n");
  CHECK(std::filesystem::is_fifo(pipe));
  // A file is no folder.
  studio.folder.file("file", "mine");
  const auto no_folder = film(studio, "file");
  CHECK(no_folder.exit_code == 2);
  CHECK_THAT(no_folder.err, ContainsSubstring("is to be a folder of pictures"));
  CHECK(read_text(studio.folder / "file") == "mine");
  // One command at a time, unless all draw parts.
  std::filesystem::create_directory(studio.folder / "held");
  {
    const qjulia::batch::FolderLock lock(studio.folder / "held");
    CHECK_THAT(film(studio, "held").err, ContainsSubstring("is in use by process"));
    CHECK(film(studio, "held", {"--frames", "1:1"}).exit_code == 1);
  }
  {
    const qjulia::batch::FolderLock lock(studio.folder / "held",
                                         qjulia::batch::FolderLock::Kind::shared);
    CHECK(film(studio, "held").exit_code == 1);
    CHECK(film(studio, "held", {"--frames", "1:1"}).exit_code == 0);
  }
  // Parts of two films do not come into one folder.
  CHECK(film(studio, "parts", {"--frames", "1:1"}).exit_code == 0);
  const auto other = film(studio, "parts", {"--frames", "2:2", "--seconds", "1.9"});
  CHECK(other.exit_code == 2);
  CHECK_THAT(other.err, ContainsSubstring("has pictures of another script"));
  CHECK_FALSE(std::filesystem::exists(studio.folder / "parts/frame_0002.png"));
  CHECK(film(studio, "parts", {"--frames", "2:2"}).exit_code == 0);
  // A shorter film names a longer one's pictures, and keeps them.
  CHECK(film(studio, "held").exit_code == 0);
  studio.folder.file("held/frame_0007.png", "mine");
  const auto shorter = film(studio, "held", {"--seconds", "1"});
  CHECK(shorter.exit_code == 0);
  CHECK_THAT(shorter.err,
             ContainsSubstring("has 3 pictures that this film has not, from 'frame_0004.png' on"));
  CHECK(std::filesystem::exists(studio.folder / "held/frame_0004.png"));
  CHECK(read_text(studio.folder / "held/frame_0007.png") == "mine");
}

TEST_CASE("a film says what it keeps from picture to picture, and lamps stand still") {
  const Studio studio;
  const auto told = [&](const std::string& key) {
    const std::string script = studio.folder.file(
        "moves.toml",
        "[film]\nmap = \"ball.qjulia.json\"\nseconds = 2\nrate = 2\n[options]\nsize = "
        "\"32x24\"\nsamples = 1\n[[key]]\nat = 0\n" +
            key + "[[key]]\nat = 2\n" + std::string(key).replace(key.find("0.1"), 3, "0.3"));
    const auto made =
        run_command({"film", script, "-o", studio.folder / "moves", "--json", "--device", "cpu"});
    INFO(made.err);
    REQUIRE(made.exit_code == 0);
    return json::parse(made.out)["kept"];
  };
  CHECK(told("azimuth = 0.1\n") == json{{"all", 3}, {"set", 1}, {"nothing", 0}});
  CHECK(told("lamp_turn = 0.1\nroughness = 0.1\n")["all"] == 3);
  CHECK(told("fill = 0.1\n") == json{{"all", 0}, {"set", 4}, {"nothing", 0}});
  CHECK(told("drift = 0.1\n")["nothing"] == 4);
  CHECK(film(studio, "turn").exit_code == 0);
  const auto job = [&](int number) {
    const auto note = run_command(
        {"info", studio.folder / ("turn/frame_000" + std::to_string(number) + ".png"), "--json"});
    return json::parse(note.out)["made_with"]["job"];
  };
  CHECK(job(1)["options"]["lamp_turn"] == 0);
  CHECK(job(4)["options"]["lamp_turn"] == 0);
  CHECK(job(4)["options"]["azimuth"] == 90);
}

TEST_CASE("an open shutter blurs what moves, and nothing else") {
  const Studio studio;
  const auto drawn = [&](const std::string& name, const std::string& shutter,
                         const std::string& keys) {
    const std::string script = studio.folder.file(
        name + ".toml", "[film]\nmap = \"ball.qjulia.json\"\nseconds = 1\nrate = 2\n" + shutter +
                            "[options]\nsize = \"96x72\"\nsamples = 1\nno_ground = true\n" + keys);
    const auto made =
        run_command({"film", script, "-o", studio.folder / name, "--device", "cpu", "--jobs", "2"});
    INFO(made.err);
    REQUIRE(made.exit_code == 0);
    return read_png(studio.folder / (name + "/frame_0001.png")).pixels;
  };
  const std::string pan =
      "[[key]]\nat = 0\nlook_at = [0, 0, 0]\nstep = \"linear\"\n[[key]]\nat = 1\nlook_at = [2, 0, "
      "0]\n";
  const auto sharp = drawn("sharp", "", pan), blurred = drawn("blurred", "shutter = 1\n", pan);
  // Edges across the way are soft: neighbours differ less, and of the sum nothing is lost.
  const auto steepest = [](const std::vector<std::uint8_t>& pixels) {
    int most = 0;
    for (std::size_t i = 3; i < pixels.size(); ++i) {
      if (i / 3 % 96 > 0) most = std::max(most, std::abs(pixels[i] - pixels[i - 3]));
    }
    return most;
  };
  INFO(steepest(sharp) << " and " << steepest(blurred));
  CHECK(steepest(blurred) < 0.7 * steepest(sharp));
  CHECK((blurred == drawn("again", "shutter = 1\n", pan)));
  // Where the camera stands still, nothing is drawn twice.
  const std::string still = "[[key]]\nat = 0\nroughness = 0.2\n[[key]]\nat = 1\nroughness = 0.2\n";
  CHECK((drawn("still", "", still) == drawn("open", "shutter = 0.5\n", still)));
  CHECK_THAT(studio.refused("[film]\nmap = \"ball.qjulia.json\"\nseconds = 1\nshutter = 2\n"),
             ContainsSubstring("bad.toml:4: shutter: give a share of a picture's time, 0 to 1"));
}

TEST_CASE("a turn goes by its degrees, however many") {
  const Studio studio;
  studio.folder.file("turn.toml", R"([film]
map = "ball.qjulia.json"
seconds = 1
rate = 2
step = "linear"
[options]
size = "16x12"
samples = 1
look_at = [0, 0, 0]
distance = 6
[[key]]
at = 0
rotate = [0, 0, 1, 0]
[[key]]
at = 1
rotate = [0, 0, 1, 720]
)");
  const auto made = run_command({"film", "make", studio.folder / "turn.toml", "-o",
                                 studio.folder / "turn", "--device", "cpu"});
  INFO(made.err);
  REQUIRE(made.exit_code == 0);
  CHECK(frame(studio, "turn", 2).find("\"rotate\":[0.0,0.0,1.0,360.0]") != std::string::npos);
}

TEST_CASE("a film shows several maps, one after the other, in one frame") {
  const Studio studio;
  std::filesystem::create_directory(studio.folder / "steps");
  qjulia::Map map = qjulia::read_map(studio.folder / "ball.qjulia.json");
  for (const int step : {1, 9, 10}) {
    map.dynamics.factors[1].center.x = 0.05 * step;
    qjulia::write_map(map, studio.folder / ("steps/s" + std::to_string(step) + ".qjulia.json"));
  }
  const std::string script = R"([film]
maps = "steps/*.qjulia.json"
seconds = 2
rate = 3
[options]
size = "32x24"
samples = 1
look_at = [0, 0, 0]
distance = 6
)";
  studio.folder.file("several.toml", script);
  const std::string file = studio.folder / "several.toml";
  const auto whole = run_command(
      {"film", "make", file, "-o", studio.folder / "several", "--json", "--device", "cpu"});
  INFO(whole.err);
  REQUIRE(whole.exit_code == 0);
  CHECK(json::parse(whole.out)["kept"]["nothing"] == 3);
  // Each is the picture of its map, in the order of numbers, and its job names the map.
  for (const auto& [number, step] : {std::pair(1, "s1"), std::pair(3, "s9"), std::pair(6, "s10")}) {
    const std::string own = frame(studio, "several", number);
    const std::string again = studio.folder / "again.png";
    const auto made =
        run_command({"run", studio.folder / ("several/frame_000" + std::to_string(number) + ".png"),
                     "--inputs", studio.folder / "steps", "-o", again, "--device", "cpu"});
    INFO(made.err);
    REQUIRE(made.exit_code == 0);
    const std::string first = "several/frame_000" + std::to_string(number) + ".png";
    CHECK((read_png(again).pixels == read_png(studio.folder / first).pixels));
    CHECK((own.find(std::string(step) + ".qjulia.json") != std::string::npos));
  }
  CHECK((frame(studio, "several", 1) != frame(studio, "several", 6)));
  // Keys say how far along the maps the film is.
  studio.folder.file("eased.toml", script + R"([[key]]
at = 0
step = "hold"
maps = 0.5
[[key]]
at = 1
step = "linear"
maps = 1
[[key]]
at = 2
maps = 0
)");
  const auto eased = run_command({"film", "make", studio.folder / "eased.toml", "-o",
                                  studio.folder / "eased", "--device", "cpu"});
  INFO(eased.err);
  REQUIRE(eased.exit_code == 0);
  for (const auto& [number, step] :
       {std::pair(1, "s9"), std::pair(3, "s9"), std::pair(4, "s10"), std::pair(6, "s9")}) {
    INFO(number);
    CHECK((frame(studio, "eased", number).find(std::string(step) + ".qjulia.json") !=
           std::string::npos));
  }
  // Where one map has changed, its film is another one.
  map.dynamics.factors[1].center.x = 0.2;
  qjulia::write_map(map, studio.folder / "steps/s9.qjulia.json");
  const auto parts = run_command({"film", "make", file, "-o", studio.folder / "several", "--frames",
                                  "1:2", "--device", "cpu"});
  CHECK(parts.exit_code == 2);
  CHECK_THAT(parts.err, ContainsSubstring("its map"));

  CHECK_THAT(studio.refused("[film]\nmaps = \"z/*.json\"\nseconds = 1\n"),
             ContainsSubstring("bad.toml:2: maps: no file matches 'z/*.json'"));
  CHECK_THAT(studio.refused("[film]\nmaps = \"steps/*\"\nmap = \"ball.qjulia.json\"\n"
                            "seconds = 1\n"),
             ContainsSubstring("'map' and 'maps'"));
  CHECK_THAT(studio.refused(script + "[[key]]\nat = 0\nmaps = 1.5\n"),
             ContainsSubstring("bad.toml:12: maps: give 0 for the first map, 1 for the last"));
  CHECK_THAT(studio.refused("[film]\nmap = \"ball.qjulia.json\"\nseconds = 1\n"
                            "[[key]]\nat = 0\nmaps = 1\n"),
             ContainsSubstring("bad.toml:6: maps: the film has one map"));
  CHECK_THAT(studio.refused("[film]\nmaps = \"steps/*\"\nseconds = 1\n[dive]\nportal = 1\n"),
             ContainsSubstring("give 'map' for 'maps'"));
}

TEST_CASE("a script's maps are made once, by its own commands") {
  const Studio studio;
  qjulia::Map other = qjulia::read_map(studio.folder / "ball.qjulia.json");
  other.dynamics.factors[1].center.x = 0.3;
  qjulia::write_map(other, studio.folder / "other.qjulia.json");
  const std::string options = "[options]\nsize = \"32x24\"\nsamples = 1\n";
  const std::string script = studio.folder.file(
      "made.toml",
      "[film]\nseconds = 1\nrate = 4\n[film.maps]\ncommand = \"morph\"\n"
      "from = \"ball.qjulia.json\"\nsteps = 4\n[film.maps.to]\ncommand = \"convert\"\n"
      "in = \"other.qjulia.json\"\ndrift = 0.1\n" +
          options);
  const auto make = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"film",   script,     "-o", studio.folder / "out/film",
                                   "--json", "--device", "cpu"};
    words.insert(words.end(), more.begin(), more.end());
    return run_command(words);
  };
  const auto whole = make({});
  INFO(whole.err);
  REQUIRE(whole.exit_code == 0);
  CHECK(json::parse(whole.out)["drawn"] == 4);
  CHECK((frame(studio, "out/film", 1) != frame(studio, "out/film", 4)));
  // Beside the output, in folders named by what they are made of; nothing half-made is left.
  std::vector<std::string> made;
  for (const auto& entry : std::filesystem::directory_iterator(studio.folder / "out/made.made")) {
    made.push_back(entry.path().filename().string());
  }
  std::ranges::sort(made);
  REQUIRE(made.size() == 3);
  CHECK(made[0] == ".lock");
  CHECK(made[1].starts_with("convert-"));
  CHECK(made[2].starts_with("morph-"));
  const std::string last = studio.folder / ("out/made.made/" + made[2] + "/step_0004.qjulia.json");
  const auto written = std::filesystem::last_write_time(last);
  // A film that goes on does not make them again.
  std::filesystem::remove(studio.folder / "out/film/frame_0003.png");
  const auto rest = make({});
  CHECK(json::parse(rest.out)["drawn"] == 1);
  CHECK(std::filesystem::last_write_time(last) == written);
  CHECK(rest.err.find("making") == std::string::npos);
  // The picture says of which map it is, and is drawn again from it.
  const auto again = run_command({"run", studio.folder / "out/film/frame_0003.png", "--inputs",
                                  studio.folder / ("out/made.made/" + made[2]), "-o",
                                  studio.folder / "again.png", "--device", "cpu"});
  INFO(again.err);
  REQUIRE(again.exit_code == 0);
  CHECK(read_png(studio.folder / "again.png").pixels ==
        read_png(studio.folder / "out/film/frame_0003.png").pixels);
  // What is made of another map has another name.
  other.dynamics.factors[1].center.x = 0.2;
  qjulia::write_map(other, studio.folder / "other.qjulia.json");
  CHECK(json::parse(make({}).out)["drawn"] == 4);
  // A sheet and a scene make what they need, too.
  for (const std::string command : {"sheet", "scene"}) {
    const auto shown =
        run_command({"film", command, script, "-o",
                     studio.folder / (command == "sheet" ? "s.png" : "s.usda"), "--device", "cpu"});
    INFO(shown.err);
    CHECK(shown.exit_code == 0);
  }
  // A dive finds the portal of a map that is yet to be made.
  const std::string dive =
      "[film]\nseconds = 1\nrate = 2\n[film.map]\ncommand = \"portals\"\n"
      "map = \"ball.qjulia.json\"\ncount = 1\nsize = 0.2\n[dive]\n";
  const auto dived = run_command({"film", studio.folder.file("dive.toml", dive + options), "-o",
                                  studio.folder / "dive", "--json", "--device", "cpu"});
  INFO(dived.err);
  REQUIRE(dived.exit_code == 0);
  CHECK(json::parse(dived.out)["seam"].is_number());
  // All that is wrong is told, with its line, before anything is made.
  const std::string wrong = studio.refused(
      "[film]\nseconds = 1\n[film.maps]\ncommand = \"morph\"\nfrom = \"none.qjulia.json\"\n"
      "step = 3\n[film.maps.to]\ncommand = \"render\"\n[options]\nsize = \"big\"\n");
  CHECK_THAT(wrong, ContainsSubstring("bad.toml:5: maps.from: from: there is no file") &&
                        ContainsSubstring("bad.toml:6: maps.step: 'morph' has no option 'step'") &&
                        ContainsSubstring("bad.toml:7: maps.to: 'render' makes no map; give "
                                          "convert, fit, paint, portals, shape") &&
                        ContainsSubstring("bad.toml:9: [options]: "));
  CHECK_THAT(studio.refused("[film]\nseconds = 1\n[film.map]\nfrom = \"a\"\n"),
             ContainsSubstring("bad.toml:3: map: give the name of a map's file"));
  CHECK_THAT(studio.refused("[film]\nseconds = 1\n[film.maps]\ncommand = \"convert\"\n"),
             ContainsSubstring("bad.toml:3: maps: 'convert' makes no folder of maps; give morph"));
  CHECK_THAT(studio.refused("[film]\nseconds = 1\n[film.map]\ncommand = \"portals\"\n"
                            "map = \"ball.qjulia.json\"\noutput = \"x.qjulia.json\"\n"),
             ContainsSubstring("bad.toml:6: map.output: "));
}

TEST_CASE("parts of a set fly in a film, and the set stands still meanwhile") {
  const Studio studio;
  // Two balls; the small one is loose.
  qjulia::Map map = qjulia::read_map(studio.folder / "ball.qjulia.json");
  map.dynamics.factors = {{{-0.5, 0, 0, 0}, 6}, {{0.9, 0, 0, 0}, 2}};
  qjulia::write_map(map, studio.folder / "two.qjulia.json");
  const std::string begin =
      "[film]\nmap = \"two.qjulia.json\"\nseconds = 2\nrate = 2\n[options]\nsize = \"64x48\"\n"
      "samples = 1\niterations = 1\n";
  const std::string flying =
      begin + "scatter = \"outward\"\nscatter_seconds = 2\nscatter_resolution = 32\n";
  const std::string keys =
      "[[key]]\nat = 0\nscatter_time = 0\nazimuth = 0\n[[key]]\nat = 2\nscatter_time = 2\n"
      "azimuth = 0\n";
  const std::string script = studio.folder.file("fly.toml", flying + keys);
  const auto made =
      run_command({"film", script, "-o", studio.folder / "fly", "--json", "--device", "cpu"});
  INFO(made.err);
  REQUIRE(made.exit_code == 0);
  CHECK(json::parse(made.out)["kept"]["nothing"] == 3);  // the first is the one that is framed
  CHECK((frame(studio, "fly", 1) != frame(studio, "fly", 4)));
  const auto again =
      run_command({"run", studio.folder / "fly/frame_0004.png", "--inputs", studio.folder.path(),
                   "-o", studio.folder / "again.png", "--device", "cpu"});
  INFO(again.err);
  REQUIRE(again.exit_code == 0);
  CHECK(read_png(studio.folder / "again.png").pixels ==
        read_png(studio.folder / "fly/frame_0004.png").pixels);
  CHECK_THAT(studio.refused(begin + keys),
             ContainsSubstring("bad.toml:11: scatter-time at 0 seconds: nothing flies; give the "
                               "option scatter, too"));
  CHECK_THAT(
      studio.refused(flying + keys + "[[key]]\nat = 1\ndrift = 0\n[[key]]\nat = 2\ndrift = 0.5\n"),
      ContainsSubstring("bad.toml:22: drift moves at 1.5 seconds, while parts fly"));
  CHECK_THAT(studio.refused(flying + "material = \"trap\"\n"),
             ContainsSubstring("leave --material, --cut and --exact out"));
}

TEST_CASE("a film's camera and lamps go to other programs") {
  const Studio studio;
  const auto scene = [&](const std::string& output) {
    return run_command({"film", "scene", studio.script, "-o", studio.folder / output, "--json",
                        "--device", "cpu"});
  };
  const auto usd = scene("scene.usda");
  INFO(usd.err);
  REQUIRE(usd.exit_code == 0);
  CHECK(json::parse(usd.out)["pictures"] == 6);
  const std::string text = read_text(studio.folder / "scene.usda");
  CHECK_THAT(text, ContainsSubstring("endTimeCode = 5\n") &&
                       ContainsSubstring("timeCodesPerSecond = 3\n") &&
                       ContainsSubstring("float focalLength = 44.78") &&
                       ContainsSubstring("def DistantLight \"lamp2\""));
  const auto glb = scene("scene.glb");
  CHECK(glb.exit_code == 0);
  CHECK(glb.err.find("field of view") == std::string::npos);
  const std::string bytes = read_text(studio.folder / "scene.glb");
  CHECK_THAT(bytes,
             ContainsSubstring("KHR_lights_punctual") && ContainsSubstring("\"animations\""));
  // A .glb cannot zoom.
  std::string zooms = kScript;
  zooms.replace(zooms.rfind("azimuth = 180"), 13, "azimuth = 180\nzoom = 3");
  zooms.replace(zooms.find("azimuth = 0"), 11, "azimuth = 0\nzoom = 1");
  studio.folder.file("turn.toml", zooms);
  CHECK_THAT(scene("scene.glb").err, ContainsSubstring("write .usda"));
  CHECK(scene("scene.usda").exit_code == 0);
  CHECK_THAT(read_text(studio.folder / "scene.usda"),
             ContainsSubstring("float focalLength.timeSamples"));
}

TEST_CASE("a sheet shows the film, and its templates can be filmed") {
  const Studio studio;
  const auto sheet = run_command({"film", "sheet", studio.script, "-o", studio.folder / "s.png",
                                  "--pictures", "4", "--json", "--device", "cpu"});
  REQUIRE(sheet.exit_code == 0);
  CHECK(json::parse(sheet.out)["pictures"] == 4);
  const auto note = run_command({"info", studio.folder / "s.png", "--json"});
  CHECK(json::parse(note.out)["made_with"]["job"]["fnv1a64"].contains("map"));
  qjulia::Map map = qjulia::read_map(studio.folder / "ball.qjulia.json");
  map.layers.portals = {{{0, 1.25, 0}, 0.4, 5, {}, {0, 0, 0}, qjulia::PortalMask::outside}};
  qjulia::write_map(map, studio.folder / "stack.qjulia.json");
  for (const char* name : {"turntable", "dissolve", "dive", "zoom", "breathe"}) {
    INFO(name);
    const auto script = run_command({"film", "template", name});
    REQUIRE(script.exit_code == 0);
    std::string text = script.out;
    if (const auto at = text.find("\"bunny.qjulia.json\""); at != std::string::npos) {
      text.replace(at, 19, "\"ball.qjulia.json\"");
    }
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
  // As spreadsheets write tables.
  studio.folder.file("keys.csv",
                     "\xEF\xBB\xBF\"at\";zoom;\"look-at\"\r\n0;1;\"0 0 0\"\r\n;;\r\n2;2.5;\r\n");
  CHECK(run_command(
            {"film", studio.folder / "zoom.toml", "-o", studio.folder / "sheet", "--device", "cpu"})
            .exit_code == 0);
  const std::string keyed = "[film]\nmap = \"ball.qjulia.json\"\nseconds = 1\nkeys = \"k.csv\"\n";
  studio.folder.file("k.csv", "at;zoom\n0;1\n1;2,5\n2;-1\n");
  CHECK_THAT(studio.refused(keyed),
             ContainsSubstring("k.csv:3: zoom: '2,5': numbers have a point, not a comma: 2.5") &&
                 ContainsSubstring("k.csv:4: zoom: the value must be above 0"));
  studio.folder.file("k.csv", "at,zoom\n0,1,5\n");
  CHECK_THAT(studio.refused(keyed), ContainsSubstring("k.csv:2: the row has more cells"));
  studio.folder.file("k.csv", "at,zoom\n0,\"1\n");
  CHECK_THAT(studio.refused(keyed), ContainsSubstring("k.csv:2: a quote has no end"));
  // Blank rows, blank cells at ends, and blanks around values mean nothing.
  studio.folder.file("keys.csv", "\n ,, \nat , zoom,,\n\n0, 1,,\n , ,\n2, \"2.5\",,,\n\n");
  const auto blank = run_command(
      {"film", studio.folder / "zoom.toml", "-o", studio.folder / "blank", "--device", "cpu"});
  INFO(blank.err);
  CHECK(blank.exit_code == 0);
  // An unknown column is named once, and errors in other columns are still reported.
  studio.folder.file("k.csv", "at,zom,zoom,zoom,,fog\n0,1,1,1,1,x\nnow,2,-2,2,2,2\n");
  const std::string told_once = studio.refused(keyed);
  CHECK_THAT(told_once, ContainsSubstring("k.csv:1: zom: there is no such setting") &&
                            ContainsSubstring("k.csv:1: zoom: it has two columns") &&
                            ContainsSubstring("k.csv:1: column 5: it has no name") &&
                            ContainsSubstring("k.csv:2: fog: ") &&
                            ContainsSubstring("k.csv:3: at: ") &&
                            ContainsSubstring("k.csv:3: zoom: the value must be above 0"));
  CHECK(told_once.find("zom", told_once.find("zom: there") + 1) == std::string::npos);
  // All at once, with the line of each.
  CHECK_THAT(studio.refused("[film]\nmap = \"ball.qjulia.json\"\nseconds = -1\nkeys = \"k.csv\"\n"
                            "[options]\nsize = \"big\"\n[[key]]\nstep = \"fast\"\nzoom = 0\n"
                            "fog = [1, 2]\n[dive]\nportal = 0\n[[key]]\nfov = 3\n"),
             ContainsSubstring("bad.toml:3: seconds: ") && ContainsSubstring("k.csv:3: at: ") &&
                 ContainsSubstring("bad.toml:5: [options]: ") &&
                 ContainsSubstring("bad.toml:7: this [[key]] has no 'at'") &&
                 ContainsSubstring("bad.toml:8: step: ") &&
                 ContainsSubstring("bad.toml:9: zoom: the value must be above 0") &&
                 ContainsSubstring("bad.toml:10: fog: give a number") &&
                 ContainsSubstring("bad.toml:12: portal: give a whole number") &&
                 ContainsSubstring("bad.toml:14: fov: there is no such setting"));
  CHECK_THAT(studio.refused("key = [1]\n" + film),
             ContainsSubstring("bad.toml:1: 'key' is not known here"));
  const std::string no_step = studio.refused(film + "step = 3\n");
  CHECK_THAT(no_step, ContainsSubstring("bad.toml:4: step: give a text"));
  CHECK(no_step.find("bad.toml") == no_step.rfind("bad.toml"));
  CHECK_THAT(studio.refused(film + "[[key]]\nat = 0\nazimut = 3\nzoom = 0\n[[key]]\nzoom = 3\n"),
             ContainsSubstring("bad.toml:6: azimut: there is no such") &&
                 ContainsSubstring("bad.toml:7: zoom: the value must be above 0") &&
                 ContainsSubstring("bad.toml:8: this [[key]] has no 'at'"));
  CHECK_THAT(
      studio.refused(film + "[[key]]\nat = 0\nelevation = 1\nroughness = 0\n[[key]]\nat = 1\n"
                            "elevation = 99\nroughness = 2\n"),
      ContainsSubstring("bad.toml:6: elevation at") &&
          ContainsSubstring("bad.toml:7: roughness at"));
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
             ContainsSubstring("hold, linear, ease, spline, geodesic"));
  CHECK_THAT(studio.refused(film + "[[key]]\nat = 0\nelevation = 91\n"),
             ContainsSubstring("bad.toml:6: elevation at 0 seconds"));
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
  CHECK_THAT(run_command({"film", studio.script, "-o", studio.folder / "x.webm"}).err,
             ContainsSubstring("64 x 64 pixels at least, and these have 32 x 24"));
}

/// Films that several processes draw together.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "film_studio.hpp"
#include "run_ranks.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

std::vector<std::string> make_film(const FilmStudio& studio, const std::string& output) {
  return {QJULIA_COMMAND,         "film",   studio.script, "-o",
          studio.folder / output, "--json", "--device",    "cpu"};
}

void check_same(const FilmStudio& studio, const std::string& one, const std::string& other) {
  for (int i = 1; i <= 6; ++i) {
    CHECK_FALSE(studio.frame(one, i).empty());
    CHECK((studio.frame(one, i) == studio.frame(other, i)));  // bytes are not for eyes
  }
}

}  // namespace

TEST_CASE("ranks share a film's pictures and draw the bytes of one process") {
  const FilmStudio studio;
  CHECK(run(make_film(studio, "one")).exit_code == 0);
  const ProcessResult ranks = run_ranks(2, make_film(studio, "two"));
  CAPTURE(ranks.err);
  REQUIRE(ranks.exit_code == 0);
  const json said = json::parse(ranks.out);  // of one rank alone
  CHECK(said["pictures"] == 6);
  CHECK(said["drawn"] == 6);
  check_same(studio, "one", "two");
  // Each has drawn every other picture, anew at its first.
  CHECK(said["kept"]["nothing"] == 6);
  // Nothing is drawn twice.
  const ProcessResult again = run_ranks(2, make_film(studio, "two"));
  CHECK(again.exit_code == 0);
  CHECK(json::parse(again.out)["drawn"] == 0);
  // What is wrong is said once.
  const std::string bad = studio.folder.file("bad.toml", "[film]\nseconds = 1\n");
  const ProcessResult refused =
      run_ranks(2, {QJULIA_COMMAND, "film", bad, "-o", studio.folder / "bad", "--device", "cpu"});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("bad.toml:1: [film] has no map"));
  CHECK(refused.err.find("has no map") == refused.err.rfind("has no map"));
}

TEST_CASE("what a killed rank has not drawn is drawn by the same command") {
  const FilmStudio studio;
  CHECK(run(make_film(studio, "one")).exit_code == 0);
  const std::string script = studio.folder.file("rank.sh", R"(
if [ "$OMPI_COMM_WORLD_RANK" = 1 ]; then
  (for i in $(seq 30000); do
     if [ -e "$2/frame_0001.png" ] || [ -e "$2/frame_0002.png" ]; then break; fi
     sleep 0.01
   done
   kill -9 $$) &
fi
exec "$QJULIA" film "$1" -o "$2" --device cpu
)");
  const std::string out = studio.folder / "killed";
  const ProcessResult killed = run_ranks(2, {"/bin/bash", script, studio.script, out});
  CAPTURE(killed.err);
  const ProcessResult rest = run_ranks(2, make_film(studio, "killed"));
  CHECK(rest.exit_code == 0);
  check_same(studio, "one", "killed");
}

TEST_CASE("two commands draw parts of a film into one folder at the same time") {
  const FilmStudio studio;
  CHECK(run(make_film(studio, "one")).exit_code == 0);
  const auto part = [&](const std::string& frames) {
    auto words = make_film(studio, "parts");
    words.insert(words.end(), {"--frames", frames});
    return run(words).exit_code;
  };
  int second = -1;
  std::jthread other([&] { second = part("4:6"); });
  CHECK(part("1:3") == 0);
  other.join();
  CHECK(second == 0);
  check_same(studio, "one", "parts");
}

TEST_CASE("the first rank makes a script's maps, and all draw them") {
  const FilmStudio studio;
  const std::string script = studio.folder.file("made.toml", R"([film]
seconds = 1
rate = 4
[film.maps]
command = "morph"
from = "ball.qjulia.json"
steps = 4
[film.maps.to]
command = "fit"
mesh = "small.obj"
factors = 8
max_evaluations = 30
[options]
size = "32x24"
samples = 1
)");
  studio.folder.file("small.obj", read_text(QJULIA_TEST_DATA "/icosahedron.obj"));
  const auto made = [&](const std::string& output) {
    return std::vector<std::string>{QJULIA_COMMAND,         "film",   script,     "-o",
                                    studio.folder / output, "--json", "--device", "cpu"};
  };
  const ProcessResult ranks = run_ranks(2, made("made_two/film"));
  CAPTURE(ranks.err);
  REQUIRE(ranks.exit_code == 0);
  REQUIRE(run(made("made_one/film")).exit_code == 0);
  for (int i = 1; i <= 4; ++i) {
    CHECK_FALSE(studio.frame("made_one/film", i).empty());
    CHECK((studio.frame("made_one/film", i) == studio.frame("made_two/film", i)));
  }
}

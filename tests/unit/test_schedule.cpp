// Schedules, built in and from files.

#include <sys/stat.h>

#include <catch2/catch_all.hpp>
#include <fstream>

#include "fit/schedule.hpp"
#include "qjulia/base/error.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;

TEST_CASE("built-in schedules cover the whole budget and end finer than they begin") {
  for (const char* name : {"tight", "fast", "paper"}) {
    const fitting::Schedule schedule = fitting::find_schedule(name);
    CHECK(schedule.levels.back().until == 1.0);
    CHECK(schedule.levels.back().samples >= schedule.levels.front().samples);
    for (std::size_t i = 1; i < schedule.levels.size(); ++i) {
      CHECK(schedule.levels[i].until > schedule.levels[i - 1].until);
      CHECK(schedule.levels[i].band <= schedule.levels[i - 1].band);
      CHECK(schedule.levels[i].space >= schedule.levels[i - 1].space);
    }
  }
  CHECK_THROWS_WITH(fitting::find_schedule("nonesuch"),
                    Catch::Matchers::ContainsSubstring("tight"));
}

TEST_CASE("polishing takes the last two fifths of a schedule") {
  const fitting::Schedule plain = fitting::find_schedule("tight");
  const fitting::Schedule polished = fitting::with_polish(plain, 0.03);
  REQUIRE(polished.levels.size() == plain.levels.size() + 1);
  CHECK(polished.evaluations == Catch::Approx(plain.evaluations / 0.6).margin(1));
  CHECK(polished.automatic.factors == plain.automatic.factors);
  CHECK(polished.automatic.evaluations ==
        Catch::Approx(plain.automatic.evaluations / 0.6).margin(1));
  CHECK(polished.automatic.stages == Catch::Approx(plain.automatic.stages / 0.6).margin(1));
  for (std::size_t i = 0; i < plain.levels.size(); ++i) {
    CHECK(polished.levels[i].until == Catch::Approx(0.6 * plain.levels[i].until));
    CHECK(polished.levels[i].iterations == 1);
  }
  CHECK(polished.levels.back().until == 1);
  CHECK(polished.levels.back().iterations == 2);
  CHECK(polished.levels.back().loss == energy::Loss::tanh);
  CHECK(polished.levels.back().band == Catch::Approx(0.12));
}

TEST_CASE("a schedule's file is read, and what is wrong with it is told by line") {
  const test::TemporaryFolder folder;
  const std::string path = folder / "own.toml";
  const auto read = [&](const std::string& text) {
    std::ofstream(path) << text;
    return fitting::find_schedule(path);
  };
  const fitting::Schedule own = read(
      "evaluations = 7\n[[level]]\nuntil = 0.5\nunknowns = \"clusters\"\nclusters = 9\n"
      "[[level]]\npoints = \"grid\"\nsamples = 12\nreweight = 0.5\n");
  CHECK(own.evaluations == 7);
  REQUIRE(own.levels.size() == 2);
  CHECK(own.levels[0].space == fitting::Space::clusters);
  CHECK(own.levels[0].clusters == 9);
  CHECK(own.levels[1].points == fitting::Points::grid);
  CHECK(own.levels[1].loss == energy::Loss::tanh);
  CHECK(own.levels[1].samples == 12);
  CHECK(own.levels[1].until == 1);
  CHECK(own.automatic.factors == 331);
  CHECK(own.automatic.stages == 0);
  const auto automatic =
      read("evaluations = 7\n[auto]\nfactors = 90\nevaluations = 5\nstages = 3\n[[level]]\n")
          .automatic;
  CHECK(automatic.factors == 90);
  CHECK(automatic.evaluations == 5);
  CHECK(automatic.stages == 3);

  const std::string head = "evaluations = 7\n[[level]]\n";
  const auto refused = [&](const std::string& text, const char* why) {
    CHECK_THROWS_WITH(read(text), Catch::Matchers::ContainsSubstring(why) &&
                                      Catch::Matchers::ContainsSubstring("own.toml"));
  };
  refused("[[level]", "not TOML");
  refused(head + "[;level]]\n", ":3: not TOML");
  refused(head + "n\u00e4me = 1\n", ":3: not TOML: a character outside double quotes");
  const auto name_of = [&](const std::string& toml) {
    return read("# \u00e4\n" + head + "name = " + toml + " # \u00e4\n").levels.front().name;
  };
  CHECK(name_of("\"\u00e4 \\\" '\u00e4\"") == "\u00e4 \" '\u00e4");
  CHECK(name_of("\"# \\\\\"") == "# \\");
  CHECK(name_of("'a \\ # b'") == "a \\ # b");
  CHECK_THROWS_WITH(name_of("'\u00e4'"),
                    Catch::Matchers::ContainsSubstring("outside double quotes"));
  CHECK_THROWS_WITH(name_of("\"\xff\""), Catch::Matchers::ContainsSubstring("not UTF-8"));
  refused("evaluations = 7\n", "at least one [[level]]");
  refused("[[level]]\n", "needs 'evaluations'");
  refused(head + "bend = 1\n", ":3: 'bend' is not known");
  refused(head + "samples = 50\n", ":3: 'samples' must be a number between 100");
  refused(head + "samples = nan\n", ":3: 'samples'");
  refused(head + "steps = 2.5\n", ":3: 'steps' must be whole");
  refused(head + "unknowns = \"some\"\n", "\"scalars\"");
  refused(head + "until = 0.4\n", "until = 1");
  refused(head + "until = 0.4\n[[level]]\nuntil = 0.4\n", "must rise");
  refused(head + "loss = \"tanh\"\nrelocate = 1\n", "needs loss");
  refused(head + "iterations = 17\n", ":3: 'iterations' must be a number between 1 and 16");
  refused(head + "iterations = 2\nloss = \"distance\"\n", "need loss \"tanh\"");
  refused(head + "until = 0.5\niterations = 3\n[[level]]\niterations = 2\n", "may not fall");
  CHECK_THROWS_WITH(fitting::find_schedule(folder / "none.toml"),
                    Catch::Matchers::ContainsSubstring("cannot read"));
  // A pipe would be waited for, and hold nothing the second time.
  const auto pipe = folder / "pipe.toml";
  REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
  CHECK_THROWS_WITH(fitting::find_schedule(pipe), Catch::Matchers::ContainsSubstring("is a pipe"));
}

/// One fit over the ranks of mpirun.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "obj_text.hpp"
#include "run_ranks.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

std::string torus(const TemporaryFolder& folder) {
  return folder.file("torus.obj", qjulia::test::obj_text(qjulia::shapes::torus()));
}

/// `qjulia fit` without the program's name.
std::vector<std::string> fit(const std::string& mesh, const std::string& map, int evaluations,
                             int factors = 30, int parts = 3) {
  return {"fit",
          mesh,
          "-o",
          map,
          "--factors",
          std::to_string(factors),
          "--max-evaluations",
          std::to_string(evaluations),
          "--sample-parts",
          std::to_string(parts)};
}

std::vector<std::string> with_program(std::vector<std::string> command) {
  command.insert(command.begin(), QJULIA_COMMAND);
  return command;
}

/// Everything in a map's file but the times.
json without_times(const std::string& path) {
  json map = json::parse(read_text(path));
  map["provenance"].erase("seconds");
  for (json& stage : map["provenance"]["stages"]) stage.erase("seconds");
  return map;
}

/// A script that runs `$QJULIA fit` with its arguments; on rank 1, `first` is done before.
std::string script(const TemporaryFolder& folder, const std::string& first) {
  return folder.file("rank.sh", "if [ \"$OMPI_COMM_WORLD_RANK\" = 1 ]; then " + first +
                                    "\nfi\nexec \"$QJULIA\" \"$@\"\n");
}

std::vector<std::string> by_script(const std::string& script, std::vector<std::string> command) {
  command.insert(command.begin(), {"/bin/bash", script});
  return command;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

}  // namespace

TEST_CASE("a fit is the same on one, two and three ranks") {
  const TemporaryFolder folder;
  const std::string mesh = torus(folder);
  const std::string alone = folder / "alone.qjulia.json";
  REQUIRE(run_command(fit(mesh, alone, 130)).exit_code == 0);
  CHECK(without_times(alone)["provenance"]["stages"].size() > 1);
  for (const int ranks : {1, 2, 3}) {
    const std::string map = folder / (std::to_string(ranks) + ".qjulia.json");
    const ProcessResult done = run_ranks(ranks, with_program(fit(mesh, map, 130)));
    CAPTURE(ranks, done.err);
    REQUIRE(done.exit_code == 0);
    CHECK(without_times(map) == without_times(alone));
    CHECK(count(done.err, "map: ") == 1);  // rank 0 alone speaks
    CHECK_FALSE(std::filesystem::exists(map + ".checkpoint"));
    auto again = fit(mesh, map, 130);
    again.push_back("--resume");
    const ProcessResult nothing = run_ranks(ranks, with_program(again));
    CHECK(nothing.exit_code == 0);
    CHECK(count(nothing.err, "there is nothing to resume") == 1);
  }
}

TEST_CASE("several blocks of factors give the same fit on one and two ranks", "[slow]") {
  const TemporaryFolder folder;
  const std::string mesh = torus(folder);
  for (const int parts : {1, 2}) {
    const std::string one = folder / "one.qjulia.json";
    const std::string two = folder / "two.qjulia.json";
    REQUIRE(run_command(fit(mesh, one, 130, 140, parts)).exit_code == 0);
    const ProcessResult done = run_ranks(2, with_program(fit(mesh, two, 130, 140, parts)));
    CAPTURE(parts, done.err);
    REQUIRE(done.exit_code == 0);
    CHECK(without_times(two) == without_times(one));
  }
}

TEST_CASE("when a rank is killed the others end, and a resumed fit ends as an unbroken one") {
  const TemporaryFolder folder;
  const std::string mesh = torus(folder);
  const std::string map = folder / "map.qjulia.json";
  const std::string alone = folder / "alone.qjulia.json";
  const std::string checkpoint = map + ".checkpoint";
  const std::string kill =
      script(folder, "(until [ -e '" + checkpoint + "' ]; do sleep 0.01; done; kill -9 $$) &");
  const ProcessResult killed = run_ranks(2, by_script(kill, fit(mesh, map, 1500)));
  CAPTURE(killed.err);
  CHECK_FALSE(killed.timed_out);
  CHECK(killed.exit_code != 0);
  CHECK_THAT(killed.err, ContainsSubstring("rank 1") && ContainsSubstring("signal 9"));
  CHECK_FALSE(std::filesystem::exists(map));
  REQUIRE(std::filesystem::exists(checkpoint));

  auto resumed = fit(mesh, map, 1500);
  resumed.push_back("--resume");
  CHECK(run_ranks(3, with_program(resumed)).exit_code == 0);
  CHECK(run_command(fit(mesh, alone, 1500)).exit_code == 0);
  CHECK(without_times(map) == without_times(alone));
}

TEST_CASE("what one rank cannot do is said once, and ends all with its exit code") {
  const TemporaryFolder folder;
  const std::string mesh = torus(folder);
  const std::string map = folder / "map.qjulia.json";

  const ProcessResult absent = run_ranks(2, with_program(fit(folder / "absent.obj", map, 30)));
  CHECK(absent.exit_code == 2);
  CHECK(count(absent.err, "absent.obj") == 1);

  // Before the fit begins.
  const ProcessResult no_device = run_ranks(
      2, by_script(script(folder, "set -- \"$@\" --device nonesuch"), fit(mesh, map, 30)));
  CHECK(no_device.exit_code == 3);
  CHECK(count(no_device.err, "nonesuch") == 1);

  // In the middle of it.
  const std::string faulty = "export LD_PRELOAD='" QJULIA_FAULTY_OPENCL
                             "' QJULIA_TEST_FAULTS=200:1 "
                             "ASAN_OPTIONS=detect_leaks=0:verify_asan_link_order=0";
  const ProcessResult failed =
      run_ranks(2, by_script(script(folder, faulty), fit(mesh, map, 1500)));
  CAPTURE(failed.err);
  CHECK_FALSE(failed.timed_out);
  CHECK(failed.exit_code == 1);
  CHECK(count(failed.err, "CL_OUT_OF_RESOURCES") == 1);
  CHECK_THAT(failed.err, ContainsSubstring("rank 1: "));
  CHECK_FALSE(std::filesystem::exists(map));
}

TEST_CASE("rank 0's time limit ends the fit on all ranks") {
  const TemporaryFolder folder;
  const std::string map = folder / "map.qjulia.json";
  auto limited = fit(torus(folder), map, 1'000'000);
  limited.insert(limited.end(), {"--time-limit", "6"});
  const ProcessResult done = run_ranks(2, with_program(limited));
  CAPTURE(done.err);
  CHECK(done.exit_code == 0);
  CHECK(without_times(map)["provenance"]["stopped"] == "time_limit");
}

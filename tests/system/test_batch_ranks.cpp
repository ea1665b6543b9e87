/// Batches under mpirun. Loops of the scripts below end after some five minutes: what they wait for
/// may never come.

#include <fmt/format.h>

#include <catch2/catch_all.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "batch_folder.hpp"
#include "run_ranks.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

ProcessResult run_ranks(const std::vector<std::string>& command) {
  return qjulia::test::run_ranks(2, command);
}

}  // namespace

TEST_CASE("ranks share a batch and write the bytes of one process") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  CHECK(run_command({"batch", "run", manifest, "-o", folder / "one"}).exit_code == 1);
  const ProcessResult ranks =
      run_ranks({QJULIA_COMMAND, "batch", "run", manifest, "-o", folder / "two"});
  CAPTURE(ranks.err);
  CHECK(ranks.exit_code == 1);
  CHECK_THAT(ranks.err, ContainsSubstring("rank 0: device") && ContainsSubstring("rank 1: device"));
  const json summary = read_summary(folder / "two");
  CHECK(summary["counts"]["done"] == 5);
  CHECK(summary["counts"]["failed"] == 1);
  std::set<long> processes;
  for (const json& entry : summary["entries"]) processes.insert(entry["process"].get<long>());
  CHECK(processes.size() == 2);
  for (int n = 1; n <= 6; ++n) {  // ranks count together
    const std::string place = fmt::format("[{}/6]", n);
    CHECK(ranks.err.find(place) != std::string::npos);
    CHECK(ranks.err.find(place) == ranks.err.rfind(place));
  }
  for (const std::string& name : kGoodFits) {
    CHECK_FALSE(map_bytes(folder / "one", name).empty());
    CHECK(map_bytes(folder / "one", name) == map_bytes(folder / "two", name));
  }
}

TEST_CASE("what a killed rank worked on is done on resume") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder, "", 400);  // long enough to be killed in
  const std::string out = folder / "out";
  const std::string script = folder.file("rank.sh", R"(
if [ "$OMPI_COMM_WORLD_RANK" = 1 ]; then
  # The process that becomes rank 1 is killed while it works on an entry and another is done.
  (for _ in $(seq 30000); do
     grep -qs '"done"' "$2"/*.status.json &&
       grep -qs '"running"' $(grep -ls "\"process\": $$[,}]" "$2"/*.status.json) && break
     sleep 0.01
   done; kill -9 $$) &
fi
exec "$QJULIA" batch run "$1" -o "$2"
)");
  const ProcessResult killed = run_ranks({"/bin/bash", script, manifest, out});
  CAPTURE(killed.err);
  CHECK(killed.exit_code != 0);
  std::map<std::string, std::filesystem::file_time_type> times;
  for (const std::string& name : kGoodFits) {
    const std::string status = read_text(out + "/" + name + ".status.json");
    if (status.find("\"done\"") == std::string::npos) continue;
    times[name] = std::filesystem::last_write_time(out + "/" + name + ".qjulia.json");
  }
  CHECK(!times.empty());
  CHECK(times.size() < 5);
  CHECK(run_ranks({QJULIA_COMMAND, "batch", "run", manifest, "-o", out, "--resume"}).exit_code ==
        1);
  CHECK(read_summary(out)["counts"]["done"] == 5);
  for (const auto& [name, time] : times) {
    CHECK(std::filesystem::last_write_time(out + "/" + name + ".qjulia.json") == time);
  }
}

TEST_CASE("a rank that is stopped is given up in the stated time, and others do its entries") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder, "", 400);
  const std::string out = folder / "out";
  const std::string script = folder.file("rank.sh", R"(
if [ "$OMPI_COMM_WORLD_RANK" = 1 ]; then
  (for _ in $(seq 30000); do
     grep -qs '"running"' $(grep -ls "\"process\": $$[,}]" "$2"/*.status.json) && break
     sleep 0.01
   done; kill -STOP $$; date +%s.%N > "$3") &
fi
exec "$QJULIA" batch run "$1" -o "$2" --rank-timeout 3 --events "$2.jsonl"
)");
  const ProcessResult ranks = run_ranks({"/bin/bash", script, manifest, out, folder / "stopped"});
  CAPTURE(ranks.err);
  CHECK(ranks.exit_code == 1);  // as alone: one mesh is empty
  CHECK_THAT(ranks.err, ContainsSubstring("rank 1 no longer answers and is given up: others do"));
  CHECK(read_summary(out)["counts"]["done"] == 5);
  const double stopped = std::stod(read_text(folder / "stopped"));
  std::istringstream events(read_text(out + ".jsonl"));
  std::string line;
  int lost = 0, ended = 0;
  while (std::getline(events, line)) {
    const json event = json::parse(line);
    if (event["event"] == "batch_ended") ++ended;
    if (event["event"] != "rank_lost") continue;
    ++lost;
    CHECK(ended == 0);
    // Seconds of the minute: the time is UTC, as `date`'s is from 1970.
    const double second = std::stod(event["time"].get<std::string>().substr(17, 6));
    const double after = std::fmod(second - std::fmod(stopped, 60) + 60, 60);
    CHECK(after > 2.5);
  }
  CHECK(lost == 1);
  CHECK(ended == 1);
}

TEST_CASE("a rank that goes on after it was given up leaves others' files as they are") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder, "", 1500);
  const std::string out = folder / "out";
  // It goes on when another process has done its entry, and others are left.
  const std::string script = folder.file("rank.sh", R"(
if [ "$OMPI_COMM_WORLD_RANK" = 1 ]; then
  (for _ in $(seq 30000); do
     file=$(grep -ls "\"process\": $$[,}]" "$2"/*.status.json) && grep -qs '"running"' $file && break
     sleep 0.01
   done; kill -STOP $$
   for _ in $(seq 30000); do
     grep -qs '"done"' $file && ! grep -qs "\"process\": $$[,}]" $file && break
     sleep 0.01
   done; echo $$ $file > "$3"; kill -CONT $$) &
fi
exec "$QJULIA" batch run "$1" -o "$2" --rank-timeout 1
)");
  const ProcessResult ranks = run_ranks({"/bin/bash", script, manifest, out, folder / "woken"});
  CAPTURE(ranks.err);
  CHECK(ranks.exit_code == 1);  // as alone: one mesh is empty
  std::istringstream words(read_text(folder / "woken"));
  long woken = 0;
  std::string status;
  REQUIRE(words >> woken >> status);
  CHECK_THAT(ranks.err, ContainsSubstring("rank 1 had not answered for 1 s"));
  CHECK(read_summary(out)["counts"]["done"] == 5);
  const json given_away = json::parse(read_text(status));
  CHECK(given_away["state"] == "done");
  CHECK(given_away["process"] != woken);
  for (const auto& item : std::filesystem::directory_iterator(out)) {
    CHECK(item.path().extension() != ".checkpoint");
  }
}

TEST_CASE("what is wrong from the start is said once, and every rank ends") {
  const TemporaryFolder folder;
  const ProcessResult absent =
      run_ranks({QJULIA_COMMAND, "batch", "run", folder / "absent.toml", "-o", folder / "out"});
  CHECK(absent.exit_code == 2);
  CHECK_THAT(absent.err, ContainsSubstring("absent.toml"));
  CHECK(absent.err.find("absent.toml") == absent.err.rfind("absent.toml"));
  const std::string manifest = make_manifest(folder);
  CHECK(run_ranks({QJULIA_COMMAND, "batch", "run", manifest, "-o", manifest}).exit_code == 1);
}

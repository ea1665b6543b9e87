/// Batches under mpirun.

#include <catch2/catch.hpp>
#include <filesystem>
#include <map>
#include <set>

#include "batch_folder.hpp"
#include "process.hpp"

using Catch::Matchers::Contains;
using nlohmann::json;
using qjulia::test::Finished;
using qjulia::test::kGoodFits;
using qjulia::test::make_manifest;
using qjulia::test::map_bytes;
using qjulia::test::read_summary;
using qjulia::test::read_text;
using qjulia::test::run_command;
using qjulia::test::RunOptions;
using qjulia::test::TemporaryFolder;

namespace {

/// @param command of each rank; the environment's QJULIA is the program.
Finished run_ranks(const std::vector<std::string>& command) {
  RunOptions options;
  options.environment = {{"OMPI_ALLOW_RUN_AS_ROOT", "1"},
                         {"OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"},
                         {"OMPI_MCA_rmaps_base_oversubscribe", "1"},
                         {"QJULIA", QJULIA_COMMAND}};
  std::vector<std::string> all = {QJULIA_MPIEXEC, "-np", "2"};
  all.insert(all.end(), command.begin(), command.end());
  return qjulia::test::run(all, options);
}

}  // namespace

TEST_CASE("ranks share a batch and write the bytes of one process") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  CHECK(run_command({"batch", manifest, "-o", folder / "one"}).exit_code == 1);
  const Finished ranks = run_ranks({QJULIA_COMMAND, "batch", manifest, "-o", folder / "two"});
  CAPTURE(ranks.err);
  CHECK(ranks.exit_code == 1);
  CHECK_THAT(ranks.err, Contains("rank 0: device") && Contains("rank 1: device"));
  const json summary = read_summary(folder / "two");
  CHECK(summary["counts"]["done"] == 5);
  CHECK(summary["counts"]["failed"] == 1);
  std::set<long> processes;
  for (const json& entry : summary["entries"]) processes.insert(entry["process"].get<long>());
  CHECK(processes.size() == 2);
  for (const std::string& name : kGoodFits) {
    CHECK_FALSE(map_bytes(folder / "one", name).empty());
    CHECK(map_bytes(folder / "one", name) == map_bytes(folder / "two", name));
  }
}

TEST_CASE("what a killed rank had claimed is done on resume") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder, "", 400);  // long enough to be killed in
  const std::string out = folder / "out";
  const std::string script = folder.file("rank.sh", R"(
if [ "$OMPI_COMM_WORLD_RANK" = 1 ]; then
  # The process that becomes rank 1 is killed while it has something claimed and another is done.
  (until grep -qs '"done"' "$2"/*.status.json && grep -qs "\"process\":$$[,}]" "$2"/*.claim
   do sleep 0.01; done; kill -9 $$) &
fi
exec "$QJULIA" batch "$1" -o "$2"
)");
  const Finished killed = run_ranks({"/bin/bash", script, manifest, out});
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
  CHECK(run_ranks({QJULIA_COMMAND, "batch", manifest, "-o", out, "--resume"}).exit_code == 1);
  CHECK(read_summary(out)["counts"]["done"] == 5);
  for (const auto& [name, time] : times) {
    CHECK(std::filesystem::last_write_time(out + "/" + name + ".qjulia.json") == time);
  }
}

TEST_CASE("what is wrong from the start is said once, and every rank ends") {
  const TemporaryFolder folder;
  const Finished absent =
      run_ranks({QJULIA_COMMAND, "batch", folder / "absent.toml", "-o", folder / "out"});
  CHECK(absent.exit_code == 2);
  CHECK_THAT(absent.err, Contains("absent.toml"));
  CHECK(absent.err.find("absent.toml") == absent.err.rfind("absent.toml"));
  const std::string manifest = make_manifest(folder);
  CHECK(run_ranks({QJULIA_COMMAND, "batch", manifest, "-o", manifest}).exit_code == 1);
}

TEST_CASE("one fit over two ranks is that of one rank with two sample parts, bit for bit") {
  const TemporaryFolder folder;
  make_manifest(folder);
  const std::vector<std::string> fit = {"fit", folder / "torus.obj", "--factors",
                                        "30",  "--max-evaluations",  "130"};
  const auto to = [&](const std::string& map, std::vector<std::string> before,
                      const std::vector<std::string>& after) {
    before.insert(before.end(), fit.begin(), fit.end());
    before.insert(before.end(), {"-o", map});
    before.insert(before.end(), after.begin(), after.end());
    return before;
  };
  const std::string one = folder / "one.qjulia.json";
  const std::string two = folder / "two.qjulia.json";
  CHECK(run_command(to(one, {}, {"--sample-parts", "2"})).exit_code == 0);
  const Finished ranks = run_ranks(to(two, {QJULIA_COMMAND}, {}));
  CAPTURE(ranks.err);
  REQUIRE(ranks.exit_code == 0);
  const json a = json::parse(read_text(one));
  const json b = json::parse(read_text(two));
  CHECK(a["factors"] == b["factors"]);
  CHECK(a["log_scale"] == b["log_scale"]);
  CHECK(a["provenance"]["stages"].size() > 1);
  for (std::size_t i = 0; i < a["provenance"]["stages"].size(); ++i) {
    CHECK(a["provenance"]["stages"][i]["energy_after"] ==
          b["provenance"]["stages"][i]["energy_after"]);
  }
  const Finished absent = run_ranks({QJULIA_COMMAND, "fit", folder / "absent.obj", "-o", two});
  CHECK(absent.exit_code == 2);
}

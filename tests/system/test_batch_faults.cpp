/// Batches under bad luck: a device without resources, a full disk.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "batch_folder.hpp"
#include "process.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

/// PoCL shows the CPU twice: on the thread that waits, and on threads of its own. PoCL 6 calls the
/// first of these devices cpu-minimal and the second cpu, and takes the older names too.
constexpr const char* kBothDevices = "basic pthread";
constexpr const char* kOnThreadThatWaits = "basic|cpu-minimal";

RunOptions with_faults(const std::string& faults) {
  RunOptions options;
  options.environment = {{"LD_PRELOAD", QJULIA_FAULTY_OPENCL},
                         {"QJULIA_TEST_FAULTS", faults},
                         {"ASAN_OPTIONS", "detect_leaks=0:verify_asan_link_order=0"}};
  return options;
}

RunOptions without_memory(const std::string& bytes) {
  RunOptions options = with_faults("0:0");
  options.environment["QJULIA_TEST_REFUSED_BYTES"] = bytes;
  return options;
}

}  // namespace

TEST_CASE("a fit whose device fails once is done again, to the same bytes") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  CHECK(run_command({"batch", "run", manifest, "-o", folder / "good"}).exit_code == 1);
  const ProcessResult result =
      run_command({"batch", "run", manifest, "-o", folder / "bad"}, with_faults("50:1"));
  CAPTURE(result.err);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err,
             ContainsSubstring("will be tried again") && ContainsSubstring("CL_OUT_OF_RESOURCES"));
  const json summary = read_summary(folder / "bad");
  CHECK(summary["counts"]["done"] == 5);
  std::size_t failed_tries = 0;
  for (const json& entry : summary["entries"]) failed_tries += entry["failed_tries"].size();
  CHECK(failed_tries == 1);
  for (const std::string& name : kGoodFits) {
    CHECK_FALSE(map_bytes(folder / "good", name).empty());
    CHECK(map_bytes(folder / "good", name) == map_bytes(folder / "bad", name));
  }
}

TEST_CASE("a device that never works is put out of use, and nothing looks complete") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  const std::string out = folder / "out";
  const ProcessResult result =
      run_command({"batch", "run", manifest, "-o", out}, with_faults("0:1000000000"));
  CAPTURE(result.err);
  CHECK(result.exit_code == 1);
  CHECK_THAT(result.err, ContainsSubstring("is out of use"));
  CHECK(read_summary(out)["counts"]["done"] == 0);
  for (const std::string& name : kGoodFits) {
    CHECK_FALSE(std::filesystem::exists(out + "/" + name + ".qjulia.json"));
  }
  CHECK(run_command({"batch", "run", manifest, "-o", out, "--resume"}).exit_code == 1);
  CHECK(read_summary(out)["counts"]["done"] == 5);
}

TEST_CASE("a batch goes on with the other device when one is lost") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  RunOptions options = with_faults("");
  options.environment["POCL_DEVICES"] = kBothDevices;
  const auto maps = [&](const std::string& out) {
    std::vector<json> all;
    for (const std::string& name : kGoodFits) {
      all.push_back(json::parse(map_bytes(folder / out, name)));
      all.back().erase("provenance");  // has the device's name
    }
    return all;
  };
  const ProcessResult good =
      run_command({"batch", "run", manifest, "-o", folder / "good", "--device", "all"}, options);
  CAPTURE(good.err);
  REQUIRE(read_summary(folder / "good")["counts"]["done"] == 5);
  CHECK_THAT(good.err, ContainsSubstring("device: 0:0") && ContainsSubstring("device: 0:1"));
  options.environment["QJULIA_TEST_LOST"] = std::string("50:-36:") + kOnThreadThatWaits;
  const ProcessResult result =
      run_command({"batch", "run", manifest, "-o", folder / "lost", "--device", "all"}, options);
  CAPTURE(result.err);
  CHECK_THAT(result.err, ContainsSubstring("will be tried again") &&
                             ContainsSubstring("CL_INVALID_COMMAND_QUEUE (-36)"));
  CHECK(read_summary(folder / "lost")["counts"]["done"] == 5);
  CHECK(maps("lost") == maps("good"));
}

TEST_CASE("the only entry of a lost device goes to another") {
  const TemporaryFolder folder;
  folder.file("ball.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const std::string manifest =
      folder.file("m.toml", "[[fit]]\nmesh = \"ball.obj\"\nfactors = 24\nmax_evaluations = 40\n");
  RunOptions options = with_faults("");
  options.environment["POCL_DEVICES"] = kBothDevices;  // the first is given it first
  options.environment["QJULIA_TEST_LOST"] = std::string("50:-9999:") + kOnThreadThatWaits;
  const ProcessResult result =
      run_command({"batch", "run", manifest, "-o", folder / "out", "--device", "all"}, options);
  CAPTURE(result.err);
  CHECK(result.exit_code == 0);
  const json entry = read_summary(folder / "out")["entries"][0];
  CHECK(entry["state"] == "done");
  CHECK_THAT(entry["device"].get<std::string>(),
             !ContainsSubstring("basic") && !ContainsSubstring("cpu-minimal"));
}

/// In a mount namespace of its own, with a disk of ten pages that is enlarged for the second run.
TEST_CASE("a full disk loses nothing that is complete") {
  const TemporaryFolder folder;
  const std::string manifest = make_manifest(folder);
  const std::string script = folder.file("full_disk.sh", R"(
set -u
disk=$1 manifest=$2 results=$3
mkdir -p "$disk" && mount -t tmpfs -o size=40k tmpfs "$disk" || exit 77
"$QJULIA" batch run "$manifest" -o "$disk/out"
echo "first: $?"
cp -r "$disk/out" "$results.first"
mount -o remount,size=4m "$disk"
"$QJULIA" batch run "$manifest" -o "$disk/out" --resume --retry-failed
echo "second: $?"
cp -rp "$disk/out" "$results"
)");
  RunOptions options;
  options.environment = {{"QJULIA", QJULIA_COMMAND}};
  const ProcessResult result =
      qjulia::test::run({"/usr/bin/unshare", "--map-root-user", "--mount", "/bin/bash", script,
                         folder / "disk", manifest, folder / "results"},
                        options);
  CAPTURE(result.out, result.err);
  INFO("this test mounts a small disk: it needs root, or user namespaces");
  REQUIRE(result.exit_code == 0);
  CHECK_THAT(result.out, ContainsSubstring("first: 1") && ContainsSubstring("second: 1"));
  CHECK_THAT(result.err, ContainsSubstring("space left"));
  // Whatever has the name of a map is one: nothing half-written was left.
  std::size_t complete = 0;
  for (const std::string& name : kGoodFits) {
    const std::string bytes = map_bytes(folder / "results.first", name);
    if (bytes.empty()) continue;
    CHECK_FALSE(json::parse(bytes, nullptr, false).is_discarded());
    CHECK(bytes == map_bytes(folder / "results", name));
    ++complete;
  }
  CHECK(complete >= 1);
  CHECK(complete < 5);
  CHECK(read_summary(folder / "results")["counts"]["done"] == 5);
}

/// Tries disks with one more page at a time: one of them has room for a status and for nothing
/// else.
TEST_CASE("the row of a fit that a full disk has ended gives the reason, now and later") {
  const TemporaryFolder folder;
  folder.file("ball.obj", qjulia::test::obj_text(qjulia::shapes::sphere(2)));
  const std::string manifest =
      folder.file("m.toml", "[[fit]]\nmesh = \"ball.obj\"\nfactors = 8\nmax_evaluations = 1\n");
  const std::string script = folder.file("full_disks.sh", R"(
set -u
disk=$1 manifest=$2
for pages in 2 3 4 5; do
  mkdir -p "$disk.$pages" && mount -t tmpfs -o size=$((4 * pages))k tmpfs "$disk.$pages" || exit 77
  "$QJULIA" batch run "$manifest" -o "$disk.$pages" --device cpu 2>&1 | sed 's/^/run: /'
  "$QJULIA" batch status "$disk.$pages" 2>&1 | sed 's/^/later: /'
done
)");
  RunOptions options;
  options.environment = {{"QJULIA", QJULIA_COMMAND}};
  const ProcessResult result = qjulia::test::run({"/usr/bin/unshare", "--map-root-user", "--mount",
                                                  "/bin/bash", script, folder / "disk", manifest},
                                                 options);
  CAPTURE(result.out, result.err);
  INFO("this test mounts small disks: it needs root, or user namespaces");
  REQUIRE(result.exit_code == 0);
  const std::string row = "failed      ball  cannot write '";
  CHECK_THAT(result.out, ContainsSubstring("run:   " + row) && ContainsSubstring("later: " + row));
  CHECK_THAT(result.out, !ContainsSubstring("without a word"));
}

TEST_CASE("a fit makes do with less memory on the device, or says what it lacks") {
  const TemporaryFolder folder;
  const std::string mesh =
      folder.file("ball.obj", qjulia::test::obj_text(qjulia::shapes::sphere(3)));
  const auto fit = [&](const RunOptions& options, const std::string& map) {
    return run_command({"fit", mesh, "-o", map, "--factors", "56", "--max-evaluations", "150",
                        "--json", "--device", "cpu"},
                       options);
  };
  const auto iou = [](const ProcessResult& result) {
    return json::parse(result.out)["stages"].back()["iou"].get<double>();
  };
  const ProcessResult whole = fit({}, folder / "whole.qjulia.json");
  REQUIRE(whole.exit_code == 0);

  // Panels of 1,024 samples by 352 columns (5 · 64 + 16, to an even number of tiles): half as many
  // samples do.
  const ProcessResult halved = fit(without_memory("1441792"), folder / "halved.qjulia.json");
  CAPTURE(halved.err);
  CHECK(halved.exit_code == 0);
  CHECK_THAT(halved.err, ContainsSubstring("refused 1441792 bytes"));
  CHECK(iou(halved) == Catch::Approx(iou(whole)).margin(0.02));

  // The matrix of 352²: its diagonal does.
  const ProcessResult diagonal = fit(without_memory("495616"), folder / "diagonal.qjulia.json");
  CAPTURE(diagonal.err);
  CHECK(diagonal.exit_code == 0);
  CHECK_THAT(diagonal.err, ContainsSubstring("refused 495616 bytes"));
  CHECK(iou(diagonal) > 0.8);

  // 20,000 samples of seven numbers: nothing stands in for them.
  const std::string nothing = folder / "nothing.qjulia.json";
  const ProcessResult refused = fit(without_memory("560000"), nothing);
  CHECK(refused.exit_code == 1);
  CHECK_THAT(refused.err, ContainsSubstring("too little memory") && ContainsSubstring("560000"));
  CHECK_FALSE(std::filesystem::exists(nothing));
}

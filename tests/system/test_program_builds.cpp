/// Building programs on a device whose driver crashes, refuses what was kept, or computes wrongly.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "cpu_id.hpp"
#include "process.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

using Environment = std::map<std::string, std::string>;

/// Commands on a CPU that says it is a GPU, with a folder for caches of their own. PoCL's own
/// cache is that of all tests.
struct Gpu {
  TemporaryFolder folder;
  std::string map = QJULIA_TEST_DATA "/../../docs/maps/bunny.qjulia.json";

  ProcessResult run(std::vector<std::string> arguments, const Environment& faults = {},
                    const char* layout = "cpu") const {
    RunOptions options;
    options.timeout = std::chrono::seconds(600);  // doctor, with an empty cache
    options.environment = faults;
    options.environment.insert({{"LD_PRELOAD", QJULIA_FAULTY_OPENCL},
                                {"ASAN_OPTIONS", "detect_leaks=0:verify_asan_link_order=0"},
                                {"XDG_CACHE_HOME", folder.path().string()},
                                {"QJULIA_TEST_GPU", "1"}});
    arguments.insert(arguments.end(), {"--device", cpu_id(), "--layout", layout});
    return run_command(arguments, options);
  }
  /// A command that builds one program.
  ProcessResult sample(const Environment& faults = {},
                       std::vector<std::string> more = {"--trust-device"}) const {
    std::vector<std::string> arguments{"sample",       map, "-o",       folder / "f.npy",
                                       "--resolution", "4", "--verbose"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments, faults);
  }
  std::vector<std::filesystem::path> kept(const std::string& extension) const {
    std::vector<std::filesystem::path> found;
    for (const auto& entry :
         std::filesystem::directory_iterator(folder.path() / "qjulia/programs")) {
      if (entry.path().extension() == extension) found.push_back(entry.path());
    }
    return found;
  }
};

json failed(const json& report) {
  json programs = json::array();
  for (const json& check : report["programs"]) {
    if (check["passed"] == false) programs.push_back(check["program"]);
  }
  return programs;
}

}  // namespace

TEST_CASE("compiled programs are kept, and loaded by the next command") {
  const Gpu gpu;
  CHECK_THAT(gpu.sample().err, ContainsSubstring("compiled 1 programs, in"));
  const auto first = read_text(gpu.folder / "f.npy");
  CHECK(gpu.kept(".program").size() == 1);
  CHECK(gpu.kept(".building").empty());
  CHECK_THAT(gpu.sample().err,
             ContainsSubstring("compiled 0 programs and loaded 1 that were kept"));
  CHECK(read_text(gpu.folder / "f.npy") == first);
  CHECK_THAT(gpu.sample({{"QJULIA_BINARIES", "off"}}).err,
             ContainsSubstring("compiled 1 programs, in"));
  const ProcessResult refused = gpu.sample({{"QJULIA_BINARIES", "yes"}});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("QJULIA_BINARIES is 'yes'; give auto"));
}

TEST_CASE("PoCL's own cache suffices, and nothing is kept for it") {
  const Gpu gpu;
  CHECK_THAT(gpu.sample({{"QJULIA_TEST_GPU", ""}, {"LD_PRELOAD", ""}}).err,
             ContainsSubstring("compiled 1 programs, in"));
  CHECK_FALSE(std::filesystem::exists(gpu.folder.path() / "qjulia/programs"));
}

TEST_CASE("PoCL on aarch64 gets each program with the features of its own functions") {
  const Gpu gpu;
  const auto first_lines = [&](const std::string& version) {
    const std::string file = gpu.folder / "sources";
    std::filesystem::remove(file);
    // An x86-64 compiler knows none of the features: what it makes of them does not matter.
    gpu.sample({{"QJULIA_TEST_GPU", ""},
                {"QJULIA_TEST_DEVICE_VERSION", version},
                {"QJULIA_TEST_SOURCES", file}});
    return read_text(file);
  };
  CHECK_THAT(first_lines("OpenCL 3.0 PoCL HSTR: pthread-aarch64-unknown-linux-gnu-(null)"),
             Catch::Matchers::StartsWith("#pragma clang attribute push"));
  CHECK_THAT(first_lines("OpenCL 3.0 PoCL HSTR: pthread-x86_64-pc-linux-gnu-znver4"),
             Catch::Matchers::StartsWith("#line 1 \"kernels/"));
}

TEST_CASE("what does not load is compiled again, and its file replaced") {
  const Gpu gpu;
  REQUIRE(gpu.sample().exit_code == 0);
  const auto file = gpu.kept(".program").at(0);
  const std::string whole = read_text(file);
  const auto expect_replaced = [&](const ProcessResult& result) {
    CAPTURE(result.err);
    CHECK(result.exit_code == 0);
    CHECK_THAT(result.err, ContainsSubstring("(1 took the place of files that did not load)"));
    CHECK(read_text(file).size() == whole.size());
    CHECK_THAT(gpu.sample().err, ContainsSubstring("loaded 1 that were kept"));
  };
  for (const char* when : {"create", "build", "kernel"}) {
    CAPTURE(when);
    expect_replaced(gpu.sample({{"QJULIA_TEST_NO_BINARY", when}}));
  }
  std::filesystem::resize_file(file, whole.size() / 2);
  expect_replaced(gpu.sample());
  std::string changed = whole;
  changed[changed.size() - 100] = static_cast<char>(changed[changed.size() - 100] ^ 1);
  std::ofstream(file, std::ios::binary) << changed;
  expect_replaced(gpu.sample());
}

TEST_CASE("doctor goes on when the driver crashes, and names the program and the signal") {
  const Gpu gpu;
  // A build that crashed before is tried again here, and works.
  REQUIRE(gpu.sample({{"QJULIA_TEST_CRASHING_PROGRAM", "field.cl"}}).exit_code == 128 + SIGSEGV);
  REQUIRE(gpu.kept(".building").size() == 1);
  const ProcessResult crashed =
      gpu.run({"doctor", "--json"},
              {{"QJULIA_TEST_CRASHING_PROGRAM", "shade.cl"}, {"QJULIA_BINARIES", "off"}});
  CAPTURE(crashed.err, crashed.out);
  CHECK(crashed.exit_code == 1);
  const json report = json::parse(crashed.out);
  CHECK(failed(report) == json{"shade.cl", "shade.cl"});  // at both precisions
  for (const json& check : report["programs"]) {
    if (check["passed"] == true) {
      CHECK(check["signal"].is_null());
      continue;
    }
    CHECK(check["signal"] == SIGSEGV);
    CHECK_THAT(check["problem"].get<std::string>(), ContainsSubstring("crashed with signal"));
  }
  CHECK(std::ranges::any_of(report["findings"], [](const json& finding) {
    return finding["kind"] == "crash" && finding["path"] == "shade.cl";
  }));
  CHECK(report["builds"]["compiled"].get<int>() > 10);
  CHECK(gpu.kept(".building").size() == 1);  // shade.cl's in single precision, for both
}

TEST_CASE("doctor ends a build that hangs, says which, and goes on", "[slow]") {
  const Gpu gpu;
  const ProcessResult hung =
      gpu.run({"doctor", "--json", "--seconds-per-check", "20"},
              {{"QJULIA_TEST_HANGING_PROGRAM", "gauss_newton.cl"}, {"QJULIA_BINARIES", "off"}});
  CAPTURE(hung.err, hung.out);
  CHECK(hung.exit_code == 1);
  const json report = json::parse(hung.out);
  int hanging = 0, passed_after = 0;
  for (const json& check : report["programs"]) {
    if (check["program"] != "gauss_newton.cl") {
      if (hanging > 0 && check["passed"] == true) ++passed_after;
      continue;
    }
    ++hanging;
    CHECK(check["passed"] == false);
    CHECK(check["signal"].is_null());
    CHECK_THAT(check["problem"].get<std::string>(), ContainsSubstring("took longer than 20 s"));
  }
  CHECK(hanging > 0);
  CHECK(passed_after > 0);
}

TEST_CASE("a build that crashed is not tried again, until it is asked for") {
  const Gpu gpu;
  const Environment crash{{"QJULIA_TEST_CRASHING_PROGRAM", "field.cl"}};
  CHECK(gpu.sample(crash).exit_code == 128 + SIGSEGV);
  const auto left = gpu.kept(".building");
  REQUIRE(left.size() == 1);
  for (const Environment& faults : {crash, Environment{}}) {
    const ProcessResult refused = gpu.sample(faults);
    CAPTURE(refused.err);
    CHECK(refused.exit_code == 1);
    CHECK_THAT(refused.err, ContainsSubstring("field.cl is not compiled for") &&
                                ContainsSubstring("qjulia doctor") &&
                                ContainsSubstring(left[0].string()));
  }
  CHECK(gpu.sample({{"QJULIA_CRASHED_BUILDS", "retry"}}).exit_code == 0);
  CHECK(gpu.kept(".building").empty());
  CHECK(gpu.sample(crash).exit_code == 0);  // it is loaded now
}

TEST_CASE("a GPU is tested before its first use, once, unless it is trusted") {
  const Gpu gpu;
  const auto sample = [&](Environment faults, std::vector<std::string> more = {}) {
    faults["QJULIA_BINARIES"] = "off";  // PoCL takes long to hand programs out
    return gpu.sample(faults, std::move(more));
  };
  const Environment broken{{"QJULIA_TEST_BROKEN_PROGRAM", "gauss_newton.cl"}};
  for (int i = 0; i < 2; ++i) {  // no failure is kept
    const ProcessResult warned = sample(broken);
    CHECK(warned.exit_code == 0);
    CHECK_THAT(warned.err, ContainsSubstring("gauss_newton.cl failed the self-test of") &&
                               ContainsSubstring("--trust-device") &&
                               !ContainsSubstring("field.cl failed"));
  }
  CHECK_THAT(sample(broken, {"--trust-device"}).err, !ContainsSubstring("self-test"));
  CHECK_THAT(sample({}).err, ContainsSubstring("passed its first self-test"));
  CHECK_THAT(sample({}).err, !ContainsSubstring("self-test"));
  CHECK_THAT(sample({{"QJULIA_TEST_GPU", ""}, {"LD_PRELOAD", ""}}).err,
             !ContainsSubstring("self-test"));
}

TEST_CASE(
    "the first self-test is in no trace, profile or list of kernels of the command that runs it") {
  const Gpu gpu;
  const auto kernels = [&](const std::vector<std::string>& more, const std::string& expected) {
    const std::string trace = gpu.folder / "trace.json", profile = gpu.folder / "profile.json";
    std::vector<std::string> arguments{"surface",      gpu.map, "-o",       gpu.folder / "m.ply",
                                       "--resolution", "12",    "--trace",  trace,
                                       "--profile",    profile, "--verbose"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProcessResult result = gpu.run(arguments, {{"QJULIA_BINARIES", "off"}});
    CAPTURE(result.err);
    REQUIRE(result.exit_code == 0);
    CHECK_THAT(result.err, ContainsSubstring(expected));
    std::set<std::string> traced, profiled, listed;
    const json all_traced = json::parse(read_text(trace));
    for (const json& event : all_traced["traceEvents"]) {
      if (event["ph"] == "X" && event["cat"] == "kernel") traced.insert(event["name"]);
    }
    const json all_profiled = json::parse(read_text(profile));
    for (const json& kernel : all_profiled["kernels"]) {
      profiled.insert(kernel["kernel"]);
    }
    std::istringstream lines(result.err);
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line);
      std::string kernel, name;
      int launches = 0;  // is not a number in a table's header
      if (words >> kernel >> name >> launches && kernel == "kernel") listed.insert(name);
    }
    CHECK(traced == profiled);
    CHECK(std::ranges::includes(traced, listed));
    return traced;
  };
  const auto first = kernels({}, "passed its first self-test");
  CHECK_FALSE(first.empty());
  CHECK(first == kernels({"--trust-device"}, "kernel "));
}

TEST_CASE("a GPU that computes wrongly is named with its kernel") {
  const Gpu gpu;
  const ProcessResult wrong =
      gpu.run({"sample", gpu.map, "-o", gpu.folder / "f.npy", "--resolution", "4"},
              {{"QJULIA_TEST_WRONG_WIDTH", "1"}, {"QJULIA_BINARIES", "off"}}, "gpu");
  CAPTURE(wrong.err);
  CHECK(wrong.exit_code == 0);
  CHECK_THAT(wrong.err, ContainsSubstring("gradient_orbit.cl failed the self-test") &&
                            ContainsSubstring("it computes wrongly"));
}

/// Commands on devices with little room, or less than they promise: the layout of GPUs shrinks to
/// what a device takes, and what it cannot do at all is told.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "cpu_id.hpp"
#include "device/program_source.hpp"
#include "obj_text.hpp"
#include "process.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/device/tuning_cache.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using qjulia::Device;
using qjulia::Layout;
using qjulia::Precision;
using qjulia::Tuning;
using namespace qjulia::test;

namespace {

using Environment = std::map<std::string, std::string>;

struct Bench {
  TemporaryFolder folder;
  std::string mesh =
      folder.file("torus.obj", qjulia::test::obj_text(qjulia::shapes::torus(1, 0.45, 32, 16)));

  /// The second level's gradient is that of orbits.
  std::string schedule = folder.file("short.toml", R"(
evaluations = 30
[[level]]
name = "band"
until = 0.5
samples = 2000
band = 0.08
steps = 10
[[level]]
name = "second iterate"
until = 1.0
samples = 2000
band = 0.05
loss = "tanh"
iterations = 2
steps = 10
)");

  /// The command, on a device with the faults given.
  ProcessResult run(std::vector<std::string> arguments, const Environment& faults = {}) const {
    RunOptions options;
    options.environment = faults;
    options.environment["LD_PRELOAD"] = QJULIA_FAULTY_OPENCL;
    options.environment["ASAN_OPTIONS"] = "detect_leaks=0:verify_asan_link_order=0";
    arguments.insert(arguments.end(), {"--device", "cpu"});
    return run_command(arguments, options);
  }

  struct Fit {
    json map;
    double iou = 0;
    std::string err;
  };
  /// A short fit, which must succeed.
  Fit fit(std::vector<std::string> options, const Environment& faults = {}) const {
    const std::string map = folder / "fitted.qjulia.json";
    std::vector<std::string> arguments{"fit", mesh, "-o", map, "--verbose"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ProcessResult finished = run(arguments, faults);
    INFO(finished.err);
    REQUIRE(finished.exit_code == 0);
    const json whole = json::parse(read_text(map));
    Fit result{whole, whole["provenance"]["metrics"]["iou"], finished.err};
    result.map.erase("provenance");
    return result;
  }
};

const std::vector<std::string> kPotential{"--layout",          "gpu", "--factors", "24",
                                          "--max-evaluations", "20"};

/// Settings kept for the CPU, where commands of this process find them.
struct KeptSettings {
  TemporaryFolder folder;
  explicit KeptSettings(const Tuning& tuning) {
    ::setenv("XDG_CACHE_HOME", folder.path().c_str(), 1);
    save_tuning(Device::choose({"cpu"}).with_tuning(Precision::single, tuning), Precision::single);
  }
};

}  // namespace

TEST_CASE("the layout of GPUs fits as well as that of CPUs, twice to the same bytes", "[slow]") {
  const Bench bench;
  const std::vector<std::string> size{"--factors", "48", "--schedule", bench.schedule};
  auto in_gpu_layout = size;
  in_gpu_layout.insert(in_gpu_layout.end(), {"--layout", "gpu"});
  const auto cpu = bench.fit(size);
  const auto gpu = bench.fit(in_gpu_layout);
  CHECK(gpu.iou == Catch::Approx(cpu.iou).margin(0.001));
  CHECK(gpu.map != cpu.map);  // sums in another order
  CHECK(bench.fit(in_gpu_layout).map == gpu.map);
  CHECK_THAT(gpu.err, ContainsSubstring("gpu layout") &&
                          ContainsSubstring("kernel panel_products_shared") &&
                          ContainsSubstring("kernel gradient_orbit"));
  CHECK_THAT(cpu.err, !ContainsSubstring("gpu layout") &&
                          !ContainsSubstring("kernel panel_products_shared"));
}

TEST_CASE("groups that a device refuses get smaller, and the map stays the same", "[slow]") {
  const Bench bench;
  const auto whole = bench.fit(kPotential);
  const std::vector<std::string> iterated{"--layout", "gpu",        "--factors",
                                          "24",       "--schedule", bench.schedule};
  const auto whole_orbits = bench.fit(iterated);
  // The matrix's tiles take 256 work-items, groups of orbits 64, all other groups 64.
  for (const char* group : {"device:128", "device:1", "kernel:16", "nobody:128", "nobody:16"}) {
    CAPTURE(group);
    const Environment faults{{"QJULIA_TEST_GROUP", group}};
    const auto fit = bench.fit(kPotential, faults);
    CHECK(fit.map == whole.map);
    const bool is_told = std::string(group).find("nobody") == std::string::npos;
    CHECK((fit.err.find("refused a group of") == std::string::npos) == is_told);
    const auto with_orbits = bench.fit(iterated, faults);
    CHECK_THAT(with_orbits.err, ContainsSubstring("kernel gradient_orbit"));
    CHECK(with_orbits.iou == Catch::Approx(whole_orbits.iou).margin(0.002));
    const bool has_room =
        std::string(group).find(":16") == std::string::npos && std::string(group) != "device:1";
    if (has_room) CHECK(with_orbits.map == whole_orbits.map);
  }
}

TEST_CASE("groups whose sums exceed 32 KiB of local memory get smaller", "[slow]") {
  Tuning tuning = Device::choose({"cpu"}).with_layout(Layout::gpu).tuning(Precision::single);
  tuning.orbit_group = 256;  // 41 KB
  const KeptSettings kept(tuning);
  const Environment faults{{"QJULIA_TEST_LOCAL_BYTES", "32768"}};
  const Bench bench;
  const std::vector<std::string> options{"--factors", "24", "--schedule", bench.schedule};
  const auto fit = bench.fit(options, faults);
  CHECK_THAT(fit.err, ContainsSubstring("(tuned)") && !ContainsSubstring("local memory"));
  tuning.orbit_group = 128;
  const KeptSettings smaller(tuning);
  CHECK(bench.fit(options).map == fit.map);
}

TEST_CASE("a device without double precision works in single, and says so otherwise") {
  const Bench bench;
  const Environment faults{{"QJULIA_TEST_NO_DOUBLE", "1"}};
  CHECK(bench.fit(kPotential, faults).map == bench.fit(kPotential).map);
  auto in_double = kPotential;
  in_double.insert(in_double.begin(), {"fit", bench.mesh, "-o", bench.folder / "d.qjulia.json"});
  in_double.insert(in_double.end(), {"--precision", "double"});
  const ProcessResult refused = bench.run(in_double, faults);
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("no double precision") && ContainsSubstring("single"));
  const ProcessResult devices = bench.run({"devices", "--json"}, faults);
  CHECK(json::parse(devices.out)["devices"][0]["double_precision"] == false);
}

TEST_CASE("buffers of at most 64 MB suffice, and smaller ones make sums of fewer groups",
          "[slow]") {
  const Bench bench;
  const std::string map = bench.folder / "torus.qjulia.json";
  REQUIRE(bench.run({"fit", bench.mesh, "-o", map, "--factors", "24", "--max-evaluations", "20"})
              .exit_code == 0);
  const auto output = [&](std::vector<std::string> command, const std::string& extension,
                          const Environment& faults) {
    const std::string file = bench.folder / ("out" + extension);
    command.insert(command.begin() + 1, {map, "-o", file});
    const ProcessResult finished = bench.run(command, faults);
    CAPTURE(finished.err);
    CHECK(finished.exit_code == 0);
    return read_text(file);
  };
  const Environment small{{"QJULIA_TEST_LARGEST_BUFFER", "67108864"}};
  const auto same = [&](const std::vector<std::string>& command, const std::string& extension) {
    return output(command, extension, small) == output(command, extension, {});
  };
  CHECK(same({"surface", "--resolution", "256"}, ".ply"));
  CHECK(same({"sample", "--resolution", "160"}, ".npy"));
  CHECK(same({"render", "--size", "320x240"}, ".png"));
  // 300 factors: 6 MB of sums for 64 groups, 9 MB for the whole matrix.
  const std::vector<std::string> large{"--factors", "300", "--schedule", bench.schedule};
  const auto fit = bench.fit(large, {{"QJULIA_TEST_LARGEST_BUFFER", "4194304"}});
  // What the device reports is looked at first, so that it is never asked for more.
  CHECK_THAT(fit.err, !ContainsSubstring("refused") && ContainsSubstring("kernel gradient_orbit"));
  CHECK(fit.iou > 0.8);
}

TEST_CASE("a fit that the device cannot hold is refused before it starts") {
  const Bench bench;
  const std::string map = bench.folder / "none.qjulia.json";
  const ProcessResult refused =
      bench.run({"fit", bench.mesh, "-o", map, "--factors", "2000", "--verbose"},
                {{"QJULIA_TEST_LARGEST_BUFFER", "1000000"}});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err, ContainsSubstring("--factors") && ContainsSubstring("in one buffer") &&
                              ContainsSubstring("fewer factors") && !ContainsSubstring("kernel"));
  CHECK_FALSE(std::filesystem::exists(map));
}

TEST_CASE("a launch without resources ends the command with what to do") {
  const Bench bench;
  const std::string map = bench.folder / "none.qjulia.json";
  const ProcessResult refused = bench.run({"fit", bench.mesh, "-o", map, "--factors", "24"},
                                          {{"QJULIA_TEST_FAULTS", "30:1000000"}});
  CHECK(refused.exit_code == 1);
  CHECK_THAT(refused.err, ContainsSubstring("launching kernel") &&
                              ContainsSubstring("CL_OUT_OF_RESOURCES") &&
                              ContainsSubstring("qjulia doctor"));
  CHECK_FALSE(std::filesystem::exists(map));
}

TEST_CASE("a fit whose device is lost keeps what it reached, and --resume goes on") {
  const Bench bench;
  const auto fit = [&](const std::string& map, std::vector<std::string> more,
                       const Environment& faults) {
    std::vector<std::string> arguments{
        "fit", bench.mesh, "-o", bench.folder / map, "--factors", "24", "--max-evaluations", "60"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return bench.run(arguments, faults);
  };
  const auto fitted = [&](const std::string& map) {
    json whole = json::parse(read_text(bench.folder / map));
    whole.erase("provenance");
    return whole;
  };
  REQUIRE(fit("whole.qjulia.json", {}, {}).exit_code == 0);
  const std::string device = Device::choose({"cpu"}).info().name;
  for (const auto& [code, name] : {std::pair{"-36", "CL_INVALID_COMMAND_QUEUE (-36)"},
                                   std::pair{"-9999", "NVIDIA's (-9999)"}}) {
    const std::string map = std::string("lost") + code + ".qjulia.json";
    const ProcessResult lost =
        fit(map, {}, {{"QJULIA_TEST_LOST", std::string("150:") + code + ":" + device}});
    CAPTURE(lost.err);
    CHECK(lost.exit_code == 1);
    CHECK_THAT(lost.err,
               ContainsSubstring(name) && ContainsSubstring("the driver has lost the device") &&
                   ContainsSubstring(map + ".checkpoint' keeps") && ContainsSubstring("--resume"));
    CHECK_FALSE(std::filesystem::exists(bench.folder / map));
    // What was evaluated in the stage is kept too, though no time to save it had come.
    constexpr std::size_t kDigits = 16;
    const std::string kept = read_text(bench.folder / (map + ".checkpoint"));
    REQUIRE(kept.size() > kDigits);
    CHECK(json::from_cbor(kept.substr(kDigits))["evaluated"].size() > 0);
    const ProcessResult resumed = fit(map, {"--resume"}, {});
    CAPTURE(resumed.err);
    CHECK(resumed.exit_code == 0);
    CHECK(fitted(map) == fitted("whole.qjulia.json"));
  }
}

TEST_CASE("a driver that waits busily is slept for, and doctor and the trace say how long") {
  const Bench bench;
  const std::string trace = bench.folder / "trace.json";
  const auto waiting = [&](const Environment& faults) {
    RunOptions options;
    options.environment = faults;
    options.environment["QJULIA_BINARIES"] = "off";  // PoCL takes long to hand programs out
    options.environment["LD_PRELOAD"] = QJULIA_FAULTY_OPENCL;
    options.environment["ASAN_OPTIONS"] = "detect_leaks=0:verify_asan_link_order=0";
    const ProcessResult result =
        run_command({"fit", bench.mesh, "-o", bench.folder / "m.qjulia.json", "--factors", "200",
                     "--max-evaluations", "400", "--device", cpu_id(), "--layout", "cpu",
                     "--trust-device", "--trace", trace},
                    options);
    CAPTURE(result.err);
    REQUIRE(result.exit_code == 0);
    return json::parse(read_text(trace))["otherData"];
  };
  const json busy = waiting({{"QJULIA_TEST_BUSY_WAITS", "1"}});
  CAPTURE(busy.dump());
  const double waited = busy["waited_seconds"];
  // Where other programs leave a busy wait less than a quarter of a core, it is not taken for one.
  CHECK((busy["waiting_slept_seconds"].get<double>() > 0 ||
         busy["waiting_processor_seconds"].get<double>() < 0.25 * waited));
  // PoCL's own waits are left as they are.
  const json patient = waiting({});
  CAPTURE(patient.dump());
  CHECK(patient["waiting_slept_seconds"] == 0);
  CHECK(patient["waiting_processor_seconds"].is_number());
}

TEST_CASE("--layout and QJULIA_LAYOUT are checked") {
  const Bench bench;
  CHECK(bench.run({"devices", "--layout", "huh"}).exit_code == 2);
  const ProcessResult refused = bench.run({"devices"}, {{"QJULIA_LAYOUT", "huh"}});
  CHECK(refused.exit_code == 2);
  CHECK_THAT(refused.err,
             ContainsSubstring("QJULIA_LAYOUT") && ContainsSubstring("cpu, gpu or auto"));
}

TEST_CASE("doctor finds nothing wrong with a good device, in either layout", "[slow]") {
  const Bench bench;
  for (const char* layout : {"cpu", "gpu"}) {
    const ProcessResult finished = bench.run({"doctor", "--json", "--layout", layout});
    CAPTURE(finished.err, finished.out);
    CHECK(finished.exit_code == 0);
    const json report = json::parse(finished.out);
    CHECK(report["passed"] == true);
    CHECK(report["layout"] == layout);
    CHECK(report["findings"].is_array());
    CHECK(report["waiting"]["seconds"].is_number());
    // Every program there is.
    std::set<std::string> checked, all;
    for (const json& program : report["programs"]) checked.insert(program["program"]);
    for (const auto& [file, text] : qjulia::device::embedded_kernels()) {
      const std::filesystem::path path(file);
      if (path.extension() == ".cl") all.insert(path.filename());
    }
    CHECK(all.size() > 10);
    CHECK(checked == all);
  }
}

TEST_CASE("doctor finds the program that computes wrongly, and the one that does not build",
          "[slow]") {
  const Bench bench;
  const auto failed = [](const ProcessResult& finished) {
    std::vector<std::string> programs;
    const json report = json::parse(finished.out);
    for (const json& check : report["programs"]) {
      if (check["passed"] == false && check["precision"] == "single") {
        programs.push_back(check["program"]);
      }
    }
    return programs;
  };
  const ProcessResult wrong =
      bench.run({"doctor", "--json", "--layout", "gpu"}, {{"QJULIA_TEST_WRONG_WIDTH", "1"}});
  CHECK(wrong.exit_code == 1);
  CHECK(failed(wrong) == std::vector<std::string>{"gradient_orbit.cl"});

  const Environment broken{{"QJULIA_TEST_BROKEN_PROGRAM", "shade.cl"}};
  const ProcessResult unbuilt = bench.run({"doctor", "--json"}, broken);
  CHECK(unbuilt.exit_code == 1);
  CHECK(failed(unbuilt) == std::vector<std::string>{"shade.cl"});
  const json report = json::parse(unbuilt.out);
  for (const json& check : report["programs"]) {
    if (check["passed"] == true) continue;
    CHECK(check["built"] == false);
    CHECK_THAT(read_text(check["build_log"]), ContainsSubstring("shade.cl did not build"));
  }
  // In a shared folder for temporary files somebody else has put links to a file of this user.
  const TemporaryFolder shared;
  const std::string precious = bench.folder.file("precious", "mine");
  for (const char* name :
       {"qjulia-doctor-shade.cl-single.log", "qjulia-doctor-shade.cl-double.log"}) {
    std::filesystem::create_symlink(precious, shared / name);
  }
  Environment in_shared = broken;
  in_shared["TMPDIR"] = shared.path();
  const ProcessResult among_links = bench.run({"doctor", "--json"}, in_shared);
  CHECK(among_links.exit_code == 1);
  CHECK(read_text(precious) == "mine");
  for (const json& check : json::parse(among_links.out)["programs"]) {
    if (check["passed"] == true) continue;
    const std::filesystem::path log = check["build_log"].get<std::string>();
    CHECK_THAT(read_text(log), ContainsSubstring("shade.cl did not build"));
    CHECK(log.parent_path().parent_path() == shared.path());
    CHECK(std::filesystem::status(log.parent_path()).permissions() ==
          std::filesystem::perms::owner_all);
  }
  const ProcessResult told = bench.run({"doctor"}, broken);
  CHECK(told.exit_code == 1);
  CHECK_THAT(told.out, ContainsSubstring("FAILED shade.cl") &&
                           ContainsSubstring("compiler's log: ") &&
                           ContainsSubstring("programs failed"));
}

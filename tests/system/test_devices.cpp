/// Which device is chosen, and what is said where there is none: on platforms that a fake driver
/// shows.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "base/surroundings.hpp"
#include "process.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

/// The command where no driver is installed but the fake one, which shows these platforms; none of
/// it where there are none.
ProcessResult with_platforms(const std::string& platforms, std::vector<std::string> arguments) {
  const TemporaryFolder folder;
  if (!platforms.empty()) folder.file("fake.icd", std::string(QJULIA_FAKE_ICD) + "\n");
  RunOptions options;
  options.environment = {{"OCL_ICD_VENDORS", folder.path()},
                         {"QJULIA_TEST_PLATFORMS", platforms},
                         {"OCL_ICD_PLATFORM_SORT", "none"},
                         {"QJULIA_DEVICE", ""},
                         {"ASAN_OPTIONS", "detect_leaks=0"}};
  return run_command(std::move(arguments), options);
}

json devices_on(const std::string& platforms, std::vector<std::string> arguments = {}) {
  arguments.insert(arguments.begin(), {"devices", "--json"});
  const ProcessResult result = with_platforms(platforms, arguments);
  CAPTURE(result.err);
  REQUIRE(result.exit_code == 0);
  return json::parse(result.out);
}

const std::string kCpu = "Portable Computing Language=cpu|pthread|AuthenticAMD|16|5000|1||";
const std::string kIntegrated = "Intel(R) OpenCL=gpu|UHD 770|Intel(R) Corporation|32|1650|1|khr:0|";
const std::string kOld = "NVIDIA CUDA=gpu|GT 1030|NVIDIA Corporation|3|1468|0|nv:2|";
const std::string kNew =
    "AMD Accelerated Parallel Processing=gpu|RX 7900|Advanced Micro Devices|"
    "96|2500|0|amd:3|";

}  // namespace

TEST_CASE("without a platform the loader's code is told, and what fits the surroundings") {
  for (const char* command : {"devices", "doctor"}) {
    const ProcessResult result = with_platforms("", {command});
    CAPTURE(command, result.err);
    CHECK(result.exit_code == 3);
    CHECK_THAT(result.err, ContainsSubstring("CL_PLATFORM_NOT_FOUND_KHR (-1001)") &&
                               ContainsSubstring("no OpenCL driver is listed"));
    // A test's own process has the same surroundings but for the drivers, which it has.
    for (const auto& finding : qjulia::base::surroundings()) {
      CHECK_THAT(result.err, ContainsSubstring(finding.text));
    }
  }
}

TEST_CASE("a platform without a device is named with its code") {
  const ProcessResult result = with_platforms("Empty=-1;Broken=-6", {"devices"});
  CAPTURE(result.err);
  CHECK(result.exit_code == 3);
  CHECK_THAT(result.err,
             ContainsSubstring("'Empty' shows no device: CL_DEVICE_NOT_FOUND (-1)") &&
                 ContainsSubstring("'Broken' shows no device: CL_OUT_OF_HOST_MEMORY (-6)"));
}

TEST_CASE("share needs a device, and without one leaves no page") {
  const TemporaryFolder folder;
  const std::string page = folder / "page.html";
  const std::string map = QJULIA_TEST_DATA "/../../docs/maps/quadratic.qjulia.json";
  CHECK(with_platforms("", {"share", map, "-o", page}).exit_code == 3);
  CHECK(!std::filesystem::exists(page));
}

TEST_CASE("doctor --json tells what applies where there is no device") {
  const ProcessResult result = with_platforms("", {"doctor", "--json"});
  CHECK(result.exit_code == 3);
  const json report = json::parse(result.out);
  CHECK(report["device"].is_null());
  CHECK(report["passed"] == false);
  CHECK_THAT(report["problem"].get<std::string>(), ContainsSubstring("-1001"));
  const bool has_drivers = std::ranges::any_of(
      report["findings"], [](const json& finding) { return finding["kind"] == "drivers"; });
  CHECK(has_drivers);
}

TEST_CASE("the fastest GPU is chosen, and the list says why") {
  // In whatever order the loader has them.
  for (const auto& [platforms, best] :
       {std::pair{kCpu + ';' + kIntegrated + ';' + kOld + ';' + kNew, "3:0"},
        std::pair{kNew + ';' + kOld + ';' + kIntegrated + ';' + kCpu, "0:0"},
        std::pair{kCpu + ';' + kIntegrated + ';' + kOld, "2:0"},
        std::pair{kCpu + ';' + kIntegrated, "1:0"}, std::pair{kCpu, "0:0"}}) {
    CAPTURE(platforms);
    const json report = devices_on(platforms);
    CHECK(report["chosen"] == best);
    for (const json& device : report["devices"]) {
      CHECK((device["rank"] == 1) == (device["id"] == best));
    }
  }
  const ProcessResult list = with_platforms(kCpu + ';' + kIntegrated + ';' + kOld, {"devices"});
  CHECK_THAT(list.out, ContainsSubstring("* 2:0") &&
                           ContainsSubstring("ranks first: GPUs with memory of their own") &&
                           ContainsSubstring("rank 1: gpu with memory of its own") &&
                           ContainsSubstring("rank 2: gpu that shares the host's memory") &&
                           ContainsSubstring("rank 3: cpu"));
  const json asked = devices_on(kCpu + ';' + kNew, {"--device", "cpu"});
  CHECK(asked["chosen"] == "0:0");
  CHECK_THAT(asked["why"].get<std::string>(), ContainsSubstring("--device asks for 'cpu'"));
  CHECK(devices_on(kOld + ';' + kNew, {"--device", "gpu"})["chosen"] == "1:0");
}

#if defined(__aarch64__) || defined(__x86_64__)
TEST_CASE("a CPU whose driver tells of one lane is shown with those of its architecture") {
  const json devices = devices_on(kCpu + ';' + kOld)["devices"];
  CHECK(devices[0]["native_float_lanes"] == 4);
  // Billions of multiply-adds a second: 16 units at 5 GHz.
  CHECK(devices[0]["estimated_speed"] == Catch::Approx(16 * 5 * 4));
  CHECK(devices[1]["native_float_lanes"] == 1);
}
#endif

TEST_CASE("a GPU that two platforms show is one device, and either can be asked for") {
  const std::string mesa = "rusticl=gpu|AD102|nouveau|999|9999|0|khr:2|";
  const std::string pocl =
      "Portable Computing Language=gpu|GT 1030|NVIDIA Corporation|3|1468|0||7f";
  const std::string vendor = kOld + "7f";
  const std::string all = mesa + ';' + pocl + ';' + vendor + ';' + kCpu;
  const json report = devices_on(all);
  CHECK(report["chosen"] == "2:0");
  CHECK(report["devices"][0]["same_as"] == "2:0");  // by its place on the bus
  CHECK(report["devices"][1]["same_as"] == "2:0");  // by its UUID
  CHECK(report["devices"][2]["same_as"].is_null());
  CHECK(report["devices"][3]["same_as"].is_null());
  CHECK(devices_on(all, {"--device", "0:0"})["chosen"] == "0:0");
  CHECK_THAT(with_platforms(all, {"devices"}).out,
             ContainsSubstring("the same GPU as 2:0") &&
                 ContainsSubstring("--device 0:0 chooses this one"));
  // Another place on the bus: two cards of one make.
  const json two = devices_on(kOld + ";rusticl=gpu|GT 1030|NVIDIA|3|1468|0|khr:4|");
  for (const json& device : two["devices"]) CHECK(device["same_as"].is_null());
  // The place of the bus's bridge is no GPU's.
  const json unknown = devices_on(kIntegrated + ";rusticl=gpu|Mali|ARM|4|900|1|khr:0|");
  for (const json& device : unknown["devices"]) {
    CHECK(device["same_as"].is_null());
    CHECK(device["pci_address"].is_null());
  }
  // AMD's own question gives the same address as the common one.
  const json amd = devices_on("rusticl=gpu|RX|AMD|96|2500|0|khr:3|;" + kNew);
  CHECK(amd["devices"][0]["same_as"] == "1:0");
  CHECK(amd["devices"][0]["pci_address"] == "0000:03:00.0");
}

TEST_CASE("doctor tells of a GPU that two platforms show") {
  const std::string twice = kOld + ";rusticl=gpu|AD102|nouveau|9|999|0|khr:2|";
  const ProcessResult result = with_platforms(twice, {"doctor", "--json", "--device", "no such"});
  CHECK(result.exit_code == 3);
  bool is_told = false;
  const json report = json::parse(result.out);
  for (const json& finding : report["findings"]) {
    if (finding["kind"] != "same-device") continue;
    is_told = true;
    CHECK(finding["path"] == "1:0");
    CHECK_THAT(finding["text"].get<std::string>(),
               ContainsSubstring("'--device 1:0' still chooses this one"));
  }
  CHECK(is_told);
}

TEST_CASE("batch --device all uses a GPU once that two platforms show") {
  const TemporaryFolder folder;
  const std::string manifest =
      folder.file("m.toml", "[[fit]]\nmesh = \"" QJULIA_TEST_DATA "/icosahedron.obj\"\n");
  const std::string twice = kOld + ";rusticl=gpu|AD102|nouveau|9|999|0|khr:2|;" + kCpu;
  const ProcessResult result =
      with_platforms(twice, {"batch", "run", manifest, "-o", folder / "out", "--device", "all"});
  CAPTURE(result.err);  // the fake devices cannot fit
  CHECK_THAT(result.err, ContainsSubstring("device: 0:0 gpu GT 1030") &&
                             ContainsSubstring("device: 2:0 cpu") &&
                             !ContainsSubstring("device: 1:0"));
}

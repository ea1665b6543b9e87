/// --trace: what ran when, of whole commands.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "obj_text.hpp"
#include "process.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using nlohmann::json;
using namespace qjulia::test;

namespace {

struct TracedFit {
  TemporaryFolder folder;
  std::string map = folder / "torus.qjulia.json";
  std::string trace = folder / "trace.json";
  ProcessResult finished;
  std::vector<json> stages, kernels;

  explicit TracedFit(const RunOptions& options = {}) {
    const auto mesh =
        folder.file("torus.obj", qjulia::test::obj_text(qjulia::shapes::torus(1, 0.45, 32, 16)));
    finished = run_command({"fit", mesh, "-o", map, "--factors", "24", "--max-evaluations", "40",
                            "--device", "cpu", "--verbose", "--trace", trace},
                           options);
    INFO(finished.err);
    REQUIRE(finished.exit_code == 0);
    const json whole = json::parse(read_text(trace));
    for (const json& event : whole.at("traceEvents")) {
      if (event["ph"] != "X") continue;
      (event["cat"] == "kernel" ? kernels : stages).push_back(event);
    }
  }

  json stage(const std::string& name) const {
    const auto found =
        std::ranges::find_if(stages, [&](const json& event) { return event["name"] == name; });
    INFO(name);
    REQUIRE(found != stages.end());
    return *found;
  }
};

double start(const json& event) { return event["ts"].get<double>(); }
double length(const json& event) { return event["dur"].get<double>(); }
double end(const json& event) { return start(event) + length(event); }

bool nests(const json& inner, const json& outer) {
  constexpr double kRounding = 0.002;  // microseconds, of three decimals
  return start(inner) >= start(outer) - kRounding && end(inner) <= end(outer) + kRounding;
}

/// Of the lines "kernel NAME LAUNCHES launches SECONDS s" of --verbose.
struct KernelTotals {
  std::size_t launches = 0, lines = 0;
  double seconds = 0;
};
KernelTotals told(const std::string& err) {
  KernelTotals sum;
  std::istringstream lines(err);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string kernel, name, unit;
    std::size_t launches = 0;
    double seconds = 0;
    if (!(words >> kernel >> name >> launches >> unit >> seconds) || kernel != "kernel") continue;
    ++sum.lines;
    sum.launches += launches;
    sum.seconds += seconds;
  }
  return sum;
}

}  // namespace

TEST_CASE("a fit's trace has its stages and kernels, nested within the whole") {
  const TracedFit fit;
  const json whole = fit.stage("qjulia");
  CHECK(start(whole) == 0);
  for (const json& event : fit.stages) CHECK(nests(event, whole));
  for (const json& event : fit.kernels) CHECK(nests(event, whole));
  for (const char* name : {"read the mesh", "measure the mesh", "signed distance", "sample pool",
                           "placement", "calibration", "save"}) {
    CHECK(length(fit.stage(name)) > 0);
  }
  const json wide_band = fit.stage("wide band");
  for (const char* name : {"draw samples", "preconditioner", "minimise", "overlap"}) {
    CHECK(nests(fit.stage(name), wide_band));
  }
  // One after the other.
  CHECK(end(fit.stage("placement")) <= start(wide_band));
  CHECK(end(wide_band) <= start(fit.stage("calibration")));

  double seconds = 0, last_end = 0;
  for (const json& event : fit.kernels) {
    CHECK(start(event) >= last_end - 0.002);
    CHECK(event["args"]["clock"] == "device");
    last_end = end(event);
    seconds += 1e-6 * length(event);
  }
  const KernelTotals sum = told(fit.finished.err);
  CHECK(sum.launches == fit.kernels.size());
  CHECK(seconds == Catch::Approx(sum.seconds).margin(0.0006 * static_cast<double>(sum.lines)));
  // Energies of the minimiser ran while it minimised.
  const json minimise = fit.stage("minimise");
  CHECK(std::ranges::count_if(fit.kernels, [&](const json& event) {
          return event["name"] == "gradient_potential" && nests(event, minimise);
        }) >= 5);
}

TEST_CASE("kernels of a device whose events have no times are timed by the wall") {
  RunOptions options;
  options.environment = {{"LD_PRELOAD", QJULIA_FAULTY_OPENCL},
                         {"QJULIA_TEST_NO_TIMES", "1"},
                         {"ASAN_OPTIONS", "detect_leaks=0:verify_asan_link_order=0"}};
  const TracedFit fit(options);
  const json whole = fit.stage("qjulia");
  CHECK(fit.kernels.size() > 100);
  for (const json& event : fit.kernels) {
    CHECK(event["args"]["clock"] == "wall");
    CHECK(length(event) > 0);
    CHECK(nests(event, whole));
  }
  CHECK(told(fit.finished.err).launches == fit.kernels.size());
}

TEST_CASE("other commands leave traces too, and refuse at once one that cannot be written") {
  const TracedFit fit;
  const std::string trace = fit.folder / "surface.json";
  const std::string surface = fit.folder / "torus.ply";
  CHECK(run_command({"surface", fit.map, "-o", surface, "--resolution", "24", "--device", "cpu",
                     "--trace", trace})
            .exit_code == 0);
  CHECK_THAT(read_text(trace), ContainsSubstring("level_set"));
  const auto check_stages = [&](const std::vector<std::string>& names, const std::string& parent) {
    const json whole = json::parse(read_text(trace));
    std::vector<json> stages;
    for (const json& event : whole.at("traceEvents")) {
      if (event["ph"] == "X" && event["cat"] == "stage") stages.push_back(event);
    }
    const auto named = [&](const std::string& name) {
      INFO(name);
      const auto found =
          std::ranges::find(stages, json(name), [](const json& e) { return e["name"]; });
      REQUIRE(found != stages.end());
      return *found;
    };
    for (const std::string& name : names) CHECK(length(named(name)) > 0);
    // Together they account for the command's time, but for a device's start and its builds.
    double told = 0;
    for (const json& event : stages) {
      const bool is_whole = event["name"] == "qjulia" || event["name"] == parent;
      if (!is_whole) told += length(event);
    }
    CHECK(told > 0.5 * length(named("qjulia")));
  };
  check_stages({"read the map", "stop radii", "find the box", "bound blocks", "wait for values",
                "wait for triangles", "measure and write"},
               "extract the surface");
  CHECK(run_command({"render", fit.map, "-o", fit.folder / "torus.png", "--size", "64x48",
                     "--device", "cpu", "--trace", trace})
            .exit_code == 0);
  check_stages({"read the map", "studio", "lattice", "sky", "lamps", "rays", "shade", "write"}, "");

  const std::string none = fit.folder / "none.ply";
  const ProcessResult refused = run_command(
      {"surface", fit.map, "-o", none, "--device", "cpu", "--trace", fit.folder / "no/trace.json"});
  CHECK(refused.exit_code == 1);
  CHECK_THAT(refused.err, ContainsSubstring("no/trace.json"));
  CHECK_FALSE(std::filesystem::exists(none));
}

// A fit that is watched: what it tells, and that it goes the same way.

#include <algorithm>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <stop_token>

#include "qjulia/fit.hpp"
#include "qjulia/map_file.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

TEST_CASE("a fit tells its energies and its map at each stage, and goes the same way") {
  const Device& device = test::shared_device();
  const TriangleMesh mesh = shapes::torus(1, 0.4);
  FitOptions options;
  options.factors = 24;
  options.schedule = "fast";
  options.max_evaluations = 150;
  const FitResult plain = fit(device, mesh, options);

  std::size_t energies = 0;
  std::vector<StageReport> stages;
  std::vector<Map> maps;
  options.observer.on_evaluation = [&](double energy) {
    CHECK(std::isfinite(energy));
    ++energies;
  };
  options.observer.on_stage = [&](const StageReport& stage, const Map& map) {
    stages.push_back(stage);
    maps.push_back(map);
  };
  const FitResult watched = fit(device, mesh, options);
  CHECK(to_json(watched.map) == to_json(plain.map));
  CHECK(energies == static_cast<std::size_t>(watched.evaluations));
  REQUIRE(stages.size() == watched.stages.size() + 1);
  CHECK(stages.front().name == "placement");
  CHECK(stages.front().iou < stages.back().iou);
  // The last stage's map is the result.
  CHECK(to_json(maps.back()) == to_json(watched.map));
  for (const Map& map : maps) CHECK_NOTHROW(map.validate());
}

TEST_CASE("a fit that its watcher stops ends with what it has reached") {
  std::stop_source stop;
  FitOptions options;
  options.factors = 24;
  int stages = 0;
  options.observer.on_stage = [&](const StageReport&, const Map&) {
    if (++stages == 2) stop.request_stop();
  };
  ProgressMonitor monitor;
  monitor.stop = stop.get_token();
  const FitResult result = fit(test::shared_device(), shapes::torus(1, 0.4), options, monitor);
  CHECK(result.stopped == StopReason::interrupted);
  CHECK(result.stages.size() == 1);
  CHECK(result.map.frame.detail.has_value());
}

TEST_CASE("a mesh too large for the time limit is fitted by a coarser one, which is said") {
  const auto said = [](const FitResult& result) {
    return std::ranges::any_of(result.warnings, [](const std::string& warning) {
      return warning.find("too short a time limit to measure") != std::string::npos;
    });
  };
  const TriangleMesh mesh = shapes::sphere(6);
  FitOptions options;
  options.factors = 8;
  options.max_evaluations = 1;
  const FitResult whole = fit(test::shared_device(), mesh, options);
  CHECK_FALSE(said(whole));
  options.time_limit = 1e-3;
  const FitResult coarse = fit(test::shared_device(), mesh, options);
  CHECK(said(coarse));
  CHECK(coarse.map.frame.box->size().x() == Approx(whole.map.frame.box->size().x()).epsilon(1e-12));
  CHECK(*coarse.map.frame.inradius == Approx(*whole.map.frame.inradius).epsilon(0.03));
}

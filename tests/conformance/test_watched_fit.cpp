// A fit that is watched: what it tells, and that it goes the same way.

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stop_token>

#include "base/setting_json.hpp"
#include "fit/checkpoint.hpp"
#include "map/reference_iteration.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/fit/fit_settings.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/mesh/shape.hpp"
#include "qjulia/surface/compare.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

FitOptions short_fit() {
  FitOptions options;
  options.factors = 24;
  options.schedule = "fast";
  options.max_evaluations = 150;
  return options;
}

/// The mean of |F_1 - L| over the points of the surface on one side of x = 0, in units of that
/// over all.
double share_of_error(const Map& map, const TriangleMesh& mesh, double side) {
  std::vector<Quaternion> points;
  std::vector<bool> is_there;
  for (const SurfacePoint& p : sample_surface(mesh, 2000, 5)) {
    const Eigen::Vector3d x = map.frame.shape_to_map.to_map(p.position);
    points.push_back({x.x(), x.y(), x.z(), map.dynamics.slice});
    is_there.push_back(side * p.position.x() > 0);
  }
  const auto field = Field(test::shared_device(), map).at(points);
  double there = 0, all = 0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const double error = std::abs(field[i] - map.dynamics.surface_level);
    all += error;
    if (is_there[i]) there += error;
  }
  return there / all;
}

void refuses_weights(const SampleWeights& weights, const char* problem) {
  FitOptions options = short_fit();
  options.weights = weights;
  CHECK_THROWS_WITH(
      fit(test::shared_device(), shapes::torus(1, 0.4), options),
      Catch::Matchers::StartsWith("weights") && Catch::Matchers::ContainsSubstring(problem));
}

}  // namespace

TEST_CASE("a fit tells its energies and its map at each stage, and goes the same way") {
  const Device& device = test::shared_device();
  const TriangleMesh mesh = shapes::torus(1, 0.4);
  FitOptions options = short_fit();
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

TEST_CASE("the IoU of a stage, and of the result, is that of the map it gives") {
  constexpr int kCells = 48;
  const Box box{{-1, -0.6, -0.4}, {1.2, 0.5, 0.3}};
  const TriangleMesh mesh = shapes::box(box.low, box.high);
  const auto counted = [&](const Map& map, int iterations) {
    const double side = 1.15 * 2.2;
    std::vector<Quaternion> points;
    std::vector<bool> is_in_shape;
    for (int i = 0; i < kCells * kCells * kCells; ++i) {
      const Eigen::Vector3d cell(i % kCells, i / kCells % kCells, i / kCells / kCells);
      const Eigen::Vector3d x =
          box.center() + side * ((cell.array() + 0.5) / kCells - 0.5).matrix();
      const Eigen::Vector3d q = map.frame.shape_to_map.to_map(x);
      points.push_back({q.x(), q.y(), q.z(), map.dynamics.slice});
      is_in_shape.push_back((x.array() > box.low.array()).all() &&
                            (x.array() < box.high.array()).all());
    }
    const auto field = reference::field(map, points, iterations, 20);
    double both = 0, either = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const bool is_in_set = field[i] < map.dynamics.surface_level;
      both += is_in_set && is_in_shape[i] ? 1 : 0;
      either += is_in_set || is_in_shape[i] ? 1 : 0;
    }
    return both / either;
  };
  FitOptions options;
  options.factors = 8;
  options.schedule = "fast";
  options.seed = GENERATE(1U, 2U, 3U);
  options.polish = options.seed == 3;
  options.max_evaluations = options.polish ? 150 : 4;
  options.steepness = 5;
  options.observer.on_stage = [&](const StageReport& stage, const Map& map) {
    CAPTURE(stage.name);
    CHECK(stage.iou == Catch::Approx(counted(map, stage.iterations)).margin(0.002));
  };
  const FitResult result = fit(test::shared_device(), mesh, options);
  REQUIRE(!result.stages.empty());
  const StageReport& last = result.stages.back();
  CHECK(last.iterations == (options.polish ? 2 : 1));
  CHECK(last.iou == Catch::Approx(counted(result.map, last.iterations)).margin(0.002));

  CompareOptions comparing;
  comparing.resolution = kCells;
  comparing.iterations = last.iterations;
  const FitMetrics metrics = compare(test::shared_device(), result.map, mesh, comparing).back();
  CHECK(last.iou == Catch::Approx(metrics.iou).margin(0.002));
  const bool is_poor = counted(result.map, 1) < 0.9;
  CHECK(is_poor == std::ranges::any_of(result.warnings, [&](const std::string& warning) {
          const std::string said = fmt::format("IoU of {:.2f} only", counted(result.map, 1));
          return warning.find(said) != std::string::npos;
        }));
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
  CHECK(coarse.map.frame.box->size().x() ==
        Catch::Approx(whole.map.frame.box->size().x()).epsilon(1e-12));
  CHECK(*coarse.map.frame.inradius == Catch::Approx(*whole.map.frame.inradius).epsilon(0.03));
}

TEST_CASE("a fit taken stage by stage goes the same way as one that runs through") {
  const Device& device = test::shared_device();
  const TriangleMesh mesh = shapes::torus(1, 0.4);
  FitOptions options = short_fit();
  options.up = UpAxis::z;
  options.steepness = 2;
  std::vector<Map> maps;
  options.observer.on_stage = [&](const StageReport&, const Map& map) { maps.push_back(map); };
  const FitResult plain = fit(device, mesh, options);

  options.observer = {};
  Fit stepped(device, mesh, options);
  CHECK(to_json(stepped.map()) == to_json(maps.at(0)));
  CHECK(stepped.stages().empty());
  std::size_t steps = 0;
  while (const auto stage = stepped.step()) {
    REQUIRE(steps < plain.stages.size());
    const StageReport& expected = plain.stages[steps++];
    CHECK(stage->name == expected.name);
    CHECK(stage->evaluations == expected.evaluations);
    CHECK(stage->energy_after == expected.energy_after);
    CHECK(stepped.stages().size() == steps);
    if (!stepped.stopped()) CHECK(to_json(stepped.map()) == to_json(maps.at(steps)));
  }
  CHECK(steps == plain.stages.size());
  CHECK(stepped.stopped() == StopReason::evaluations);
  CHECK_FALSE(stepped.step());
  const FitResult result = stepped.result();
  CHECK(to_json(result.map) == to_json(plain.map));
  CHECK(to_json(stepped.map()) == to_json(plain.map));
  CHECK(result.stopped == plain.stopped);
  CHECK(result.evaluations == plain.evaluations);
  CHECK(result.mean_distance == plain.mean_distance);
  CHECK(result.warnings == plain.warnings);
}

TEST_CASE(
    "a stepped fit that is ended early gives what it has reached, and its checkpoint goes on") {
  const Device& device = test::shared_device();
  const TriangleMesh mesh = shapes::torus(1, 0.4);
  FitOptions options = short_fit();
  const FitResult plain = fit(device, mesh, options);
  const test::TemporaryFolder folder;
  options.checkpoint = folder / "fit.checkpoint";
  Fit begun(device, mesh, options);
  REQUIRE(begun.step());
  CHECK_FALSE(begun.stopped());
  const Map reached = begun.map();
  Fit moved = std::move(begun);
  const FitResult result = moved.result();
  CHECK(result.stopped == StopReason::interrupted);
  CHECK(result.stages.size() == 1);
  CHECK(result.map.dynamics.factors.size() == reached.dynamics.factors.size());
  CHECK_FALSE(moved.step());

  options.resume = true;
  Fit resumed(device, mesh, options);
  CHECK(resumed.stages().size() == 1);
  while (resumed.step()) {
  }
  CHECK(to_json(resumed.result().map) == to_json(plain.map));
}

TEST_CASE("a stop request ends a stepped fit") {
  std::stop_source stop;
  ProgressMonitor monitor;
  monitor.stop = stop.get_token();
  Fit stepped(test::shared_device(), shapes::torus(1, 0.4), short_fit(), monitor);
  REQUIRE(stepped.step());
  stop.request_stop();
  CHECK_FALSE(stepped.step());
  CHECK(stepped.stopped() == StopReason::interrupted);
  CHECK(stepped.result().stages.size() == 1);
}

TEST_CASE("weights say where a fit follows the shape, and equal ones change nothing") {
  const Device& device = test::shared_device();
  const TriangleMesh mesh = shapes::torus(1, 0.4);
  const bool by_tanh = GENERATE(false, true);
  FitOptions options = short_fit();
  if (by_tanh) options.schedule = "paper";
  options.max_evaluations = 60;
  const FitResult plain = fit(device, mesh, options);
  std::size_t largest = 0;
  options.weights = [&](std::span<const Eigen::Vector3d> points) {
    largest = std::max(largest, points.size());
    return std::vector<double>(points.size(), 4);
  };
  CHECK(to_json(fit(device, mesh, options).map) == to_json(plain.map));
  CHECK(largest > 1000);
  // In the mesh's coordinates: the half with x > 0.
  const auto one_half = [](std::span<const Eigen::Vector3d> points) {
    std::vector<double> weights;
    for (const auto& x : points) weights.push_back(x.x() > 0 ? 1 : 0.001);
    return weights;
  };
  options.weights = one_half;
  const FitResult weighted = fit(device, mesh, options);
  CAPTURE(by_tanh);
  // Few exponents follow the tanh, and not where F is steep.
  const double most = by_tanh ? 0.97 : 0.7;
  CHECK(share_of_error(weighted.map, mesh, 1) < most * share_of_error(plain.map, mesh, 1));
}

TEST_CASE("weights that cannot be used are refused, and a checkpoint knows its own") {
  const auto all = [](double weight) {
    return [weight](std::span<const Eigen::Vector3d> points) {
      return std::vector<double>(points.size(), weight);
    };
  };
  refuses_weights(all(-1), "is -1; give 0 or more");
  refuses_weights(all(std::numeric_limits<double>::quiet_NaN()), "is nan");
  refuses_weights(all(std::numeric_limits<double>::infinity()), "is inf");
  refuses_weights(all(0), "sum to 0");
  refuses_weights(all(1e308), "sum to inf");
  refuses_weights([](auto) { return std::vector<double>(3, 1); }, "there are 3 for");

  const test::TemporaryFolder folder;
  const TriangleMesh mesh = shapes::torus(1, 0.4);
  FitOptions options = short_fit();
  options.checkpoint = folder / "fit.checkpoint";
  options.max_evaluations = 30;
  options.weights = all(2);
  const FitResult done = fit(test::shared_device(), mesh, options);
  options.resume = true;
  CHECK(to_json(fit(test::shared_device(), mesh, options).map) == to_json(done.map));
  options.weights = all(3);
  CHECK_THROWS_WITH(fit(test::shared_device(), mesh, options),
                    Catch::Matchers::ContainsSubstring("other options"));
}

namespace {

/// Gives a value other than the usual one to each type that settings of fits have.
struct Change {
  void operator()(bool* value) const { *value = !*value; }
  void operator()(std::uint64_t* value) const { ++*value; }
  void operator()(double* value) const { *value += 1; }
  void operator()(std::string* value) const { *value = "paper"; }
  void operator()(const WordPlace& value) const { value.set(1 - value.index()); }
  void operator()(DetailChoice* value) const { *value = 0.031; }
  void operator()(std::optional<int>* value) const { *value = 12; }
  void operator()(std::optional<double>* value) const { *value = 0.5; }
  void operator()(std::optional<UpAxis>* value) const { *value = UpAxis::minus_x; }
  template <class Other>
  void operator()(const Other&) const {
    FAIL("a type that no setting of a fit had");
  }
};

}  // namespace

TEST_CASE("a checkpoint belongs to all settings that the factors depend on") {
  const Device& device = test::shared_device();
  const TriangleMesh mesh = shapes::torus();
  const std::string usual = fitting::fit_key(mesh, FitOptions{}, device);
  std::size_t differing = 0;
  for (const FitSetting& setting : fit_settings()) {
    CAPTURE(setting.name);
    if (setting.name == "precision" && !device.info().has_double) continue;
    if (setting.name == "schedule") continue;
    FitOptions options;
    std::visit(Change(), setting.place(options));
    CHECK((fitting::fit_key(mesh, options, device) == usual) == setting.may_differ_on_resume);
    if (setting.may_differ_on_resume) ++differing;
  }
  CHECK(differing == 4);  // steepness, up, time limit and target IoU
  // A schedule counts by its text.
  FitOptions named, written;
  named.schedule = "fast";
  written.schedule_text = schedule_text("fast");
  CHECK(fitting::fit_key(mesh, named, device) == fitting::fit_key(mesh, written, device));
  CHECK(fitting::fit_key(mesh, named, device) != usual);
}

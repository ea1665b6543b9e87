// Wishes, settings and sources that nobody should give to devices and to what measures them.

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>
#include <stop_token>

#include "hostile.hpp"
#include "profile/command_profile.hpp"
#include "qjulia/map/opencl.hpp"
#include "qjulia/profile/own_launch.hpp"

using namespace qjulia;
using namespace qjulia::test;

namespace {

const Device& hostile_device() { return test::shared_device(); }

}  // namespace

TEST_CASE("hostile wishes for devices are refused") {
  for (const char* wanted :
       {"no such device", "99:99", "-1:-1", ":", "\xff", "999999999999999:1"}) {
    CAPTURE(wanted);
    CHECK_THROWS_AS(Device::choose({wanted}), NoDeviceError);
  }
  for (const int n : kHostileCounts) {
    CAPTURE(n);
    const auto with = [&](auto change) {
      Tuning tuning = hostile_device().tuning(Precision::single);
      change(tuning);
      return hostile_device().with_tuning(Precision::single, tuning);
    };
    // 0 is the device's own width.
    takes(n == 0, "with_lane_width", "lane_width", [&] {
      const Device device = hostile_device().with_lane_width(n);
      return device.lane_width(Precision::single) == hostile_device().lane_width(Precision::single);
    });
    refuses("with_tuning", "lane_width", [&] { with([&](Tuning& t) { t.lane_width = n; }); });
    refuses("with_tuning", "panel_block", [&] {
      with([&](Tuning& t) {
        t.panel_block = n;
        t.panel_samples = 16;
      });
    });
    takes(is_within(n, 1, 1024), "with_tuning", "orbit_items",
          [&] { with([&](Tuning& t) { t.orbit_items = n; }); });
  }
  accepts("to_json", [] { return to_json(DeviceInfo{}).at("name") == ""; });
  accepts("known_fault", [] { return known_fault(DeviceInfo{}).empty(); });
  accepts("tuning_file", [] { return tuning_file({}).extension() == ".json"; });
  accepts("with_cached_tuning", [] {
    const CachedTuning cached = with_cached_tuning(hostile_device());
    cached.device.tuning(Precision::single).validate();
  });
  accepts("with_known_tuning",
          [] { with_known_tuning(hostile_device()).tuning(Precision::single).validate(); });
  refuses("import_tuning", "/no/such/file.json",
          [] { import_tuning(hostile_device(), "/no/such/file.json"); });
  accepts("record", [] { hostile_device().sibling().record(nullptr); });
}

TEST_CASE("OpenCL objects that do not belong together are refused") {
  const BufferField field(hostile_device(), good_map());
  refuses("BufferField's points", [&] { field.at(nullptr, 1, 1, nullptr); });
  refuses("BufferField's gradient", [&] { field.gradient_at(nullptr, 1, nullptr); });
  refuses("device_from_opencl", [] { device_from_opencl(nullptr, nullptr, nullptr); });
  refuses("device_from_opencl of another context", [] {
    const Device other = Device::choose({"cpu"});
    device_from_opencl(opencl_context(hostile_device()), opencl_device(hostile_device()),
                       opencl_queue(other));
  });
  const auto build = [](const std::string& source, const std::string& name) {
    build_kernel(hostile_device(), good_map(), Precision::single, source, name);
  };
  for (const std::string& name : {std::string(), std::string("\0", 1), std::string("\xff{}%s")}) {
    refuses("build_kernel", "the source has no kernel named '", [&] { build("", name); });
    for (const char* source :
         {"#include", "#include \"../map.clh\"", "#include \"the caller's source\""}) {
      CHECK_THROWS_AS(build(source, name), KernelBuildError);
    }
    survives("build_kernel", "a compiler may ignore what stands after a zero, or complain",
             [&] { build(std::string("\0\n\xff", 3), name); });
  }
}

TEST_CASE("hostile sizes of measurements are refused by name") {
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const bool is_law = x == kHuge || x == 1e-300;
    takes(is_law, "fit_law", "a law of scaling needs", [&] {
      fit_law({{1, 1, 1, x}, {1, 2, 1, x}, {1, 1, 2, x}});
    });
    // A tiny bound leaves no measurement to find a law from.
    takes(x == kHuge, "measure_scaling", x == 1e-300 ? "a law of scaling needs" : "most_slots",
          [&] {
            const ScalingReport report = measure_scaling(
                hostile_device(),
                {.samples = {64, 65}, .factors = {8, 9}, .iterations = {1}, .most_slots = x});
            return report.points.size() == 4;
          });
    const ProfileReport empty;
    const nlohmann::json baseline = to_json(empty);
    refuses("regressions", "nothing in the baseline has the same size",
            [&] { regressions(empty, baseline, x); });
  }
  for (const int n : kHostileCounts) {
    CAPTURE(n);
    takes(is_within(n, 1, 1000), "ProfileOptions", "repeats",
          [&] { ProfileOptions{.repeats = n}.validate(); });
    refuses("ProfileOptions", "lane_width", [&] { ProfileOptions{.lane_width = n}.validate(); });
  }
  const Device& device = hostile_device();
  refuses("profile", "sample_points", [&] { profile(device, {.sample_points = 0}); });
  refuses("tune", "factors", [&] { tune(device, {.factors = ~std::size_t{0}}); });
  const auto own = [&](auto change) {
    OwnLaunch launch{.kernel = "none", .run = [] {}};
    change(launch);
    return profile_launch(device, launch);
  };
  refuses("profile_launch", "run", [&] { own([](OwnLaunch& l) { l.run = {}; }); });
  refuses("profile_launch", "slots", [&] { own([](OwnLaunch& l) { l.slots = -1; }); });
  refuses("profile_launch", "bytes", [&] { own([](OwnLaunch& l) { l.bytes = kNan; }); });
  refuses("profile_launch", "repeats", [&] { own([](OwnLaunch& l) { l.repeats = 0; }); });
  accepts("profile_launch", [&] { return own([](OwnLaunch&) {}).share_verdict.empty(); });
  refuses("measure_scaling", "sample_points", [&] { measure_scaling(device, {.samples = {0}}); });
  refuses("measure_scaling", "factors", [&] { measure_scaling(device, {.factors = {}}); });
  refuses("fit_law", "a law of scaling needs", [] { fit_law({}); });
  refuses("measure_grid", "grid", [&] { measure_grid(device, {}, {{"no_setting", {1}}}); });
  refuses("measure_grid", "grid", [&] { measure_grid(device, {}, {{"lane_width", {}}}); });
}

TEST_CASE("reports of nothing, and of impossible times, are written") {
  CHECK(to_csv(ScalingReport{}).ends_with("\n"));
  CHECK(to_json(ScalingReport{}).is_object());
  const ProfileReport empty;
  CHECK(std::ranges::count(to_csv(empty), '\n') == 1);  // the names of columns
  CHECK(to_json(empty).at("kernels").empty());
  accepts("disturbances", [&] { empty.disturbances(); });
  CHECK(empty.what_limits().empty());
  CHECK(to_json(InstructionMix{}).is_object());
  CHECK(InstructionMix{}.ceiling() == 0);
  CHECK(InstructionMix{}.slots() == InstructionMix{}.operations());
  CHECK(cache_rates({}).empty());
  CHECK_FALSE(cache_rates({{-7, kNan, -kInfinity}}).empty());
  CHECK(verdict_text({}, kNan, -kInfinity) == "-");
  CHECK_FALSE(verdict_text("x", kNan, -kInfinity).empty());
  CHECK(to_json(TuneReport{}).is_object());
  CHECK(to_json(SelfTestReport{}).is_object());
  CHECK_FALSE(SelfTestReport{}.has_passed());
  CHECK(to_json(GridReport{}).is_object());
  accepts("to_csv", [] { to_csv(GridReport{}); });
  const profiling::LaunchCounter counter;
  const profiling::CommandProfile nothing =
      profiling::command_profile({}, Trace(), counter.work(), {}, kNan);
  CHECK(to_json(nothing).is_object());
  CHECK_FALSE(to_text(nothing).empty());
  CHECK(profiling::measure_roofs(hostile_device()).fma_per_second > 0);
  profiling::CommandMeasure measure = profiling::CommandMeter(hostile_device()).finish({});
  measure.cpu = {{7, 1}, {-7, kNan}};
  measure.fma_per_second_before = -1;
  CHECK_FALSE(
      to_text(profiling::command_profile({}, Trace(), counter.work(), measure, -1)).empty());
}

TEST_CASE("who watches hears what is reported, and a stop ends what runs") {
  std::vector<double> heard;
  const ProgressMonitor monitor{[&](const Progress& p) { heard.push_back(p.fraction); }, {}, {}};
  monitor.report({"\xff", -kInfinity, kNan, ""});
  CHECK(heard == std::vector{-kInfinity});
  const ProgressMonitor deaf{};
  accepts("report", [&] { deaf.report({"", kNan, 0, ""}); });
  std::stop_source source;
  source.request_stop();
  CHECK_THROWS_AS(throw_if_stopped(source.get_token()), Interrupted);
}

TEST_CASE("a check that a self-test does not have is refused") {
  const std::size_t count = self_test_plan(hostile_device()).size();
  for (const std::size_t number : {count, std::numeric_limits<std::size_t>::max()}) {
    refuses("self_test_check", "number", [&] { self_test_check(hostile_device(), number); });
  }
}

TEST_CASE("fields and energies of no points are empty or refused") {
  const Map map = good_map();
  const Field field(hostile_device(), map);
  CHECK(field.at({}).empty());
  CHECK(field.decided_at({}, 2).empty());
  CHECK(field.versors_at({}).empty());
  CHECK(field.images_at({}).empty());
  CHECK(field.orbits_at({}, 2).empty());
  CHECK(field.escape_counts_at({}, 2).empty());
  CHECK(field.gradient_at({}).empty());
  refuses("Energy", [&] { Energy(hostile_device(), map, {}); });
  refuses("shell_thickness", [&] { shell_thickness(field, {}, 0); });
  refuses("median_level", [&] { median_level(field, {}, 0); });
  refuses("with_measured_detail", [&] { with_measured_detail(hostile_device(), map, {}); });
}

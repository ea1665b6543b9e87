// Settings other than the defaults: the same results, and where they are kept.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "device/known_devices.hpp"
#include "profile/tune_clock.hpp"
#include "profile/workload.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/device/tuning_cache.hpp"
#include "qjulia/profile/tune.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

constexpr std::array kJobs{profiling::TuneJob::energy, profiling::TuneJob::gradient,
                           profiling::TuneJob::orbit_energy, profiling::TuneJob::orbit_gradient,
                           profiling::TuneJob::gauss_newton};

ProfileOptions tiny_workload() {
  ProfileOptions options;
  options.sample_points = 3000;
  options.factors = 40;
  options.repeats = 1;
  return options;
}

/// Settings are kept in a folder of this test's own.
struct OwnCache {
  test::TemporaryFolder folder;
  OwnCache() { ::setenv("XDG_CACHE_HOME", folder.path().c_str(), 1); }
  ~OwnCache() { ::unsetenv("QJULIA_TUNING"); }
};

Device tuned(const Device& device) {
  Tuning tuning = device.tuning(Precision::single);
  tuning.lane_width = tuning.lane_width == 8 ? 16 : 8;
  tuning.energy_vectors = 7;
  return device.with_tuning(Precision::single, tuning);
}

}  // namespace

TEST_CASE("every setting gives the default's results but for rounding", "[slow]") {
  const Device device = test::shared_device();
  const profiling::Workload work = profiling::make_workload(tiny_workload());
  for (const Precision precision : {Precision::single, Precision::dbl}) {
    if (precision == Precision::dbl && !test::can_check(device, precision)) continue;
    profiling::TuneBench standard(device, work, precision);
    for (const int width : {1, 8, 16}) {
      for (const Tuning& tuning :
           {Tuning{width, 1, 1, 1, 1, 256, 256, 1}, Tuning{width, 7, 1000, 300, 5, 96, 3, 16},
            Tuning{width, 64, 17, 5, 1, 4096, 1, 1}}) {
        profiling::TuneBench bench(device.with_tuning(precision, tuning), work, precision);
        for (const profiling::TuneJob job : kJobs) {
          CAPTURE(to_json(tuning).dump(), static_cast<int>(job));
          CHECK(profiling::largest_difference(bench.run(job), standard.run(job)) <
                (precision == Precision::dbl ? 1e-10 : 1e-4));
        }
      }
    }
  }
}

TEST_CASE("a tuner tries settings that the device can use") {
  const Device device = test::shared_device();
  const TuneReport report = tune(device, tiny_workload());
  CHECK(report.trials.size() >= 10);
  for (const TuneTrial& trial : report.trials) {
    CAPTURE(trial.setting, trial.value, trial.refused);
    CHECK(trial.difference <= report.tolerance);
    CHECK(trial.time_ratio.has_value() == trial.refused.empty());
  }
  // One run of each says nothing for certain.
  CHECK(report.before == device.tuning(Precision::single));
  CHECK(report.tuning == report.before);
  CHECK_FALSE(report.why_kept.empty());
  CHECK(to_json(report).at("tuning") == to_json(report.tuning));
}

namespace {

/// A tuner's report by made-up times: those of a device with these settings take `factor` as long.
TuneReport tuned_by(const Device& device, const std::function<double(const Tuning&)>& factor,
                    int repeats = 5, const std::vector<std::string>& disturbances = {}) {
  ProfileOptions options = tiny_workload();
  options.sample_points = 256;
  options.factors = 8;
  options.repeats = repeats;
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> noise(0.99, 1.01);
  profiling::TuneClock clock;
  clock.seconds = [&](profiling::TuneBench& bench, profiling::TuneJob) {
    return noise(random) * factor(bench.device().tuning(Precision::single));
  };
  clock.disturbances = [&] { return disturbances; };
  return profiling::tune_by(clock, device, options, {});
}

}  // namespace

TEST_CASE("a tuner changes what is certainly 3 % faster, and nothing else") {
  const Device device = test::shared_device();
  const Tuning before = device.tuning(Precision::single);
  const auto larger_panels = [&](double ratio) {
    return [=](const Tuning& tuning) {
      return tuning.panel_samples == 2 * before.panel_samples ? ratio : 1.0;
    };
  };
  Tuning better = before;
  better.panel_samples *= 2;
  const TuneReport faster = tuned_by(device, larger_panels(0.9));
  CHECK(faster.tuning == better);
  CHECK(faster.why_kept.empty());
  REQUIRE(faster.time_ratio);
  CHECK(faster.time_ratio->high <= 0.97);
  CHECK(faster.time_ratio->middle == Catch::Approx(0.9).epsilon(0.01));
  CHECK(std::ranges::count(faster.trials, true, &TuneTrial::taken) == 1);

  // A gain of 1.5 % is too small to change the sums of later fits.
  const TuneReport little = tuned_by(device, larger_panels(0.985));
  CHECK(little.tuning == before);
  CHECK_THAT(little.why_kept, Catch::Matchers::ContainsSubstring("panel_samples") &&
                                  Catch::Matchers::ContainsSubstring("0.97"));
  CHECK(std::ranges::count(little.trials, true, &TuneTrial::taken) == 0);

  // Runs that lie far apart, faster on average.
  int run = 0;
  const TuneReport uncertain = tuned_by(device, [&](const Tuning& tuning) {
    return larger_panels(0.9)(tuning) * (++run % 3 == 0 ? 1.25 : 1.0);
  });
  CHECK(uncertain.tuning == before);

  const TuneReport few = tuned_by(device, larger_panels(0.5), 4);
  CHECK(few.tuning == before);
  CHECK_THAT(few.why_kept, Catch::Matchers::ContainsSubstring("4 runs") &&
                               Catch::Matchers::ContainsSubstring("give 5 repeats"));
}

TEST_CASE("a tuner keeps the settings that a device has while the machine is busy") {
  Tuning before = test::shared_device().tuning(Precision::single);
  before.panel_block /= 2;  // not the default
  const Device device = test::shared_device().with_tuning(Precision::single, before);
  const auto half = [&](const Tuning& tuning) { return tuning == before ? 1.0 : 0.5; };
  CHECK(tuned_by(device, half).tuning != before);
  const TuneReport busy = tuned_by(device, half, 5, {"somebody else works"});
  CHECK(busy.tuning == before);
  CHECK_THAT(busy.why_kept, Catch::Matchers::ContainsSubstring("busy"));
  CHECK(to_json(busy)["disturbances"][0] == "somebody else works");
}

TEST_CASE("kept settings come back, those of either precision") {
  const OwnCache cache;
  const Device device = test::shared_device();
  CHECK(with_cached_tuning(device).warning.empty());
  CHECK_FALSE(with_cached_tuning(device).device.is_tuned(Precision::single));

  save_tuning(tuned(device), Precision::single);
  CHECK(tuning_file(device.info()).string().starts_with(cache.folder.path().string()));
  const CachedTuning kept = with_cached_tuning(device);
  CHECK(kept.warning.empty());
  CHECK(kept.device.is_tuned(Precision::single));
  CHECK_FALSE(kept.device.is_tuned(Precision::dbl));
  CHECK(kept.device.tuning(Precision::single) == tuned(device).tuning(Precision::single));

  Tuning wide = device.tuning(Precision::dbl);
  wide.orbit_items = 16;
  save_tuning(device.with_tuning(Precision::dbl, wide), Precision::dbl);
  CHECK(with_cached_tuning(device).device.tuning(Precision::dbl) == wide);
  CHECK(with_cached_tuning(device).device.is_tuned(Precision::single));

  // The defaults of a device are not in its cache's hands.
  CHECK_FALSE(device.is_tuned(Precision::single));
  ::setenv("QJULIA_TUNING", "off", 1);
  CHECK_FALSE(with_cached_tuning(device).device.is_tuned(Precision::single));
}

TEST_CASE("a device starts from its entry in the table of known devices") {
  const Device device = test::shared_device();
  const DeviceInfo& info = device.info();
  const Tuning wanted = tuned(device).tuning(Precision::single);
  const nlohmann::json entry{{"device", info.name},
                             {"platform", info.platform_name},
                             {"driver", "another"},
                             {"compute_units", info.compute_units},
                             {"single", to_json(wanted)}};
  const auto started = [&](const nlohmann::json& table) {
    return device::with_table(device, table.dump());
  };
  const auto array = [](const nlohmann::json& one) { return nlohmann::json::array({one}); };
  const Device known = started(array(entry));
  CHECK(known.tuning(Precision::single) == wanted);
  CHECK(known.is_tuned(Precision::single));
  CHECK_FALSE(known.is_tuned(Precision::dbl));
  for (const char* name : {"device", "platform", "compute_units"}) {
    nlohmann::json other = entry;
    other[name] = name == std::string("compute_units") ? nlohmann::json(info.compute_units + 1)
                                                       : nlohmann::json("another");
    CAPTURE(name);
    CHECK_FALSE(started(array(other)).is_tuned(Precision::single));
  }
  nlohmann::json wrong = entry;
  wrong["single"]["lane_width"] = 5;
  CHECK_THROWS_AS(started(array(wrong)), InputError);
  // The table as it is holds nothing that a device would refuse.
  for (const auto& [path, text] : device::known_devices()) {
    for (const nlohmann::json& one : nlohmann::json::parse(text)) {
      for (const char* precision : {"single", "double"}) {
        if (one.contains(precision)) CHECK_NOTHROW(tuning_from(one[precision]));
      }
    }
  }
}

TEST_CASE("settings travel to a twin in a file") {
  const OwnCache cache;
  const Device device = test::shared_device();
  const auto file = cache.folder.path() / "settings.json";
  export_tuning(tuned(device), file);
  CHECK_FALSE(with_cached_tuning(device).device.is_tuned(Precision::single));
  const Device twin = import_tuning(device, file);
  CHECK(twin.tuning(Precision::single) == tuned(device).tuning(Precision::single));
  CHECK(with_cached_tuning(device).device.tuning(Precision::single) ==
        tuned(device).tuning(Precision::single));
  nlohmann::json foreign;
  std::ifstream(file) >> foreign;
  foreign["device"] = "another";
  std::ofstream(file) << foreign;
  CHECK_THROWS_WITH(import_tuning(device, file),
                    Catch::Matchers::ContainsSubstring("settings of \"another\""));
}

TEST_CASE("corrupt and foreign settings are passed over with a warning, and replaced") {
  const OwnCache cache;
  const Device device = test::shared_device();
  save_tuning(tuned(device), Precision::single);
  const std::filesystem::path file = tuning_file(device.info());
  std::ifstream stream(file);
  const auto good = nlohmann::json::parse(stream);
  const auto put = [&](const std::string& text) { std::ofstream(file) << text; };

  auto foreign = good, future = good, wrong = good, odd = good;
  foreign["owner"]["driver"] = "another";
  future["version"] = 2;
  wrong["single"]["lane_width"] = 5;
  odd["single"] = "fast";
  for (const std::string& text :
       {std::string(), std::string("{\"format\""), std::string("[]"), std::string("null"),
        foreign.dump(), future.dump(), wrong.dump(), odd.dump(), good.dump().substr(0, 100)}) {
    put(text);
    CAPTURE(text);
    const CachedTuning kept = with_cached_tuning(device);
    CHECK_THAT(kept.warning, Catch::Matchers::ContainsSubstring(file.string()) &&
                                 Catch::Matchers::ContainsSubstring("tune this device again"));
    CHECK_FALSE(kept.device.is_tuned(Precision::single));
  }
  save_tuning(tuned(device), Precision::single);
  CHECK(with_cached_tuning(device).device.is_tuned(Precision::single));
}

TEST_CASE("settings of another device, driver or program are looked for elsewhere") {
  const OwnCache cache;
  DeviceInfo info = test::shared_device().info();
  const auto file = tuning_file(info);
  info.driver_version += "1";
  CHECK(tuning_file(info) != file);
  info = test::shared_device().info();
  info.name += " II";
  CHECK(tuning_file(info) != file);
}

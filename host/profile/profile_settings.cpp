#include "qjulia/profile/profile_settings.hpp"

#include <array>
#include <string_view>
#include <vector>

#include "qjulia/map/orbit_settings.hpp"

namespace qjulia {
namespace {

std::vector<SettingOf<ProfileOptions>> own_profile_settings() {
  return {
      {{.name = "sample_points",
        .values = "INT",
        .least = 64,
        .most = 100'000'000,
        .example = "500",
        .help = "Points at which kernels compute"},
       [](ProfileOptions& o) -> ValuePlace { return &o.sample_points; }},
      {{.name = "factors",
        .values = "INT",
        .least = 8,
        .most = 20'000,
        .example = "16",
        .help = "Factors of the map that is made up where none is given"},
       [](ProfileOptions& o) -> ValuePlace { return &o.factors; }},
      {{.name = "repeats",
        .values = "INT",
        .least = 1,
        .most = 1000,
        .example = "2",
        .help = "Timed runs of each kernel"},
       [](ProfileOptions& o) -> ValuePlace { return &o.repeats; }},
      {{.name = "seed",
        .values = "INT",
        .example = "7",
        .help = "Random seed of the points and of the map that is made up"},
       [](ProfileOptions& o) -> ValuePlace { return &o.seed; }},
      {{.name = "lane_width",
        .values = "INT",
        .least = 1,
        .most = 16,
        .left_out = "what suits the device",
        .example = "8",
        .help = "Lanes of a work-item: 1, 8 or 16"},
       [](ProfileOptions& o) -> ValuePlace { return &o.lane_width; }},
      {{.name = "iterations",
        .values = "INT",
        .least = 2,
        .most = 16,
        .left_out = "4, and 6 for pictures and surfaces",
        .example = "2",
        .help = "n of the jobs of several iterates"},
       [](ProfileOptions& o) -> ValuePlace { return &o.iterations; }},
      {{.name = "time_limit",
        .values = "SECONDS",
        .least = Setting::kAboveZero,
        .left_out = "none",
        .example = "60",
        .help = "Time for the whole run: jobs share what is left of it, and are left out where one "
                "run does not fit"},
       [](ProfileOptions& o) -> ValuePlace { return &o.time_limit; }},
      {{.name = "counters",
        .example = "",
        .help = "Also count, on CPUs, cycles, instructions, cache misses, stalled cycles, CPU "
                "seconds and page faults of each kernel, and show what the driver says of its "
                "work-groups, memory and registers"},
       [](ProfileOptions& o) -> ValuePlace { return &o.counters; }},
  };
}

}  // namespace

std::span<const SettingOf<ProfileOptions>> profile_settings() {
  static const std::vector<SettingOf<ProfileOptions>> all = [] {
    std::vector<SettingOf<ProfileOptions>> made = own_profile_settings();
    made.push_back({precision_setting(),
                    [](ProfileOptions& o) -> ValuePlace { return WordPlace(o.precision); }});
    return made;
  }();
  return all;
}

std::span<const SettingOf<ProfileOptions>> tune_settings() {
  static const std::vector<SettingOf<ProfileOptions>> all = [] {
    constexpr std::array<std::string_view, 5> kNames{"sample_points", "factors", "repeats", "seed",
                                                     "precision"};
    std::vector<SettingOf<ProfileOptions>> made;
    made.reserve(kNames.size());
    for (const std::string_view name : kNames) {
      made.push_back(setting_named(profile_settings(), name, "profiles"));
    }
    return made;
  }();
  return all;
}

}  // namespace qjulia

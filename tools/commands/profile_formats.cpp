#include "commands/profile_formats.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

namespace qjulia::tools {
namespace {

using Json = nlohmann::json;

constexpr double kMilli = 1e-3, kMicro = 1e-6, kNano = 1e-9;

std::string benchmark_name(const Json& kernel) {
  return fmt::format("{}/n:{}", kernel.at("kernel").get<std::string>(),
                     kernel.at("iterations").get<int>());
}

/// github.com/google/benchmark: a context, and a benchmark for each run.
Json google_benchmark(const Json& report) {
  const Json& made = report.at("made");
  Json context{{"date", made.at("date")},
               {"executable", "qjulia"},
               {"num_cpus", report.at("device").at("compute_units")},
               {"cpu_scaling_enabled", false},
               {"caches", Json::array()},
               {"load_avg", made.at("load_average")},
               {"library_build_type", "release"},
               {"device", report.at("device").at("name")},
               {"driver", report.at("device").at("driver")},
               {"version", made.at("version")},
               {"commit", made.at("commit")}};
  if (made.contains("host")) context["host_name"] = made.at("host");
  Json benchmarks = Json::array();
  int family = 0;
  for (const Json& kernel : report.at("kernels")) {
    const Json& runs = kernel.at("runs");
    const Json& seconds = runs.at("seconds");
    const Json& cpu = runs.at("cpu_seconds");
    for (std::size_t i = 0; i < seconds.size(); ++i) {
      const double real = seconds[i].get<double>() / kMicro;
      benchmarks.push_back({{"name", benchmark_name(kernel)},
                            {"family_index", family},
                            {"per_family_instance_index", 0},
                            {"run_name", benchmark_name(kernel)},
                            {"run_type", "iteration"},
                            {"repetitions", seconds.size()},
                            {"repetition_index", i},
                            {"threads", 1},
                            {"iterations", 1},
                            {"real_time", real},
                            {"cpu_time", cpu.is_null() ? real : cpu[i].get<double>() / kMicro},
                            {"time_unit", "us"}});
    }
    ++family;
  }
  return {{"context", context}, {"benchmarks", benchmarks}};
}

/// bencher.dev's metric format: a benchmark's measures, each a value with its bounds.
Json bencher(const Json& report) {
  Json all = Json::object();
  for (const Json& kernel : report.at("kernels")) {
    Json& measures = all[benchmark_name(kernel)];
    measures["latency"] = {{"value", kernel.at("median_seconds").get<double>() / kNano},
                           {"lower_value", kernel.at("median_low").get<double>() / kNano},
                           {"upper_value", kernel.at("median_high").get<double>() / kNano}};
    if (kernel.at("share_of_limit").is_null()) continue;
    measures["share-of-limit"] = {{"value", kernel.at("share_of_limit")},
                                  {"lower_value", kernel.at("share_low")},
                                  {"upper_value", kernel.at("share_high")}};
  }
  return all;
}

/// A line for where it was measured, and one for each kernel.
std::string lines(const Json& report) {
  Json first = report;
  first.erase("kernels");
  std::string text = first.dump(-1, ' ', true);
  for (const Json& kernel : report.at("kernels")) text += '\n' + kernel.dump(-1, ' ', true);
  return text;
}

std::string pasteable(const Json& report, const std::string& table) {
  const Json &made = report.at("made"), &device = report.at("device");
  const auto word = [](const Json& json) { return json.get<std::string>(); };
  std::string text = fmt::format(
      "qjulia {} ({}, {}) on {}, {} {}, {}\n\n```\n{}\n```", word(made.at("version")),
      made.at("commit").is_null() ? "commit not known" : "commit " + word(made.at("commit")),
      word(made.at("build")), word(device.at("name")), word(device.at("platform")),
      word(device.at("driver")), word(made.at("date")), table);
  for (const Json& sign : report.at("disturbances"))
    text += fmt::format("\n\nBusy: {}.", word(sign));
  return text;
}

/// One combination of settings that was measured, or could not be.
struct Configuration {
  Json settings;
  std::map<std::string, std::vector<double>> seconds;  ///< by job
  std::string refused;
  double correctness = 1;  ///< 1, or 0 where results were wrong
};

std::vector<Configuration> configurations(const Json& report) {
  std::vector<Configuration> all;
  if (report.contains("times")) {  // a grid: a row for each job
    for (const Json& row : report.at("times")) {
      Json settings = row.at("tuning");
      settings.update(row.at("asked"));  // what was refused, too
      if (all.empty() || all.back().settings != settings) all.push_back({settings, {}, {}, 1});
      if (row.at("refused").is_null()) {
        all.back().seconds[row.at("job")] = row.at("seconds").get<std::vector<double>>();
      } else {
        all.back().refused = row.at("refused");
      }
    }
    return all;
  }
  Json best = report.at("before");
  for (const Json& trial : report.at("trials")) {
    Configuration tried{best, {}, {}, 1};
    tried.settings[trial.at("setting").get<std::string>()] = trial.at("value");
    for (const Json& time : trial.at("times")) {
      tried.seconds[time.at("job")].push_back(time.at("seconds"));
    }
    if (!trial.at("refused").is_null()) tried.refused = trial.at("refused");
    const Json& difference = trial.at("difference");
    if (difference.is_null() || difference > report.at("tolerance")) tried.correctness = 0;
    if (trial.at("taken") == true) best = tried.settings;
    all.push_back(std::move(tried));
  }
  return all;
}

/// "T4", the format of autotuning results that Kernel Tuner writes, version 1.0.0.
Json t4(const Json& report) {
  Json results = Json::array();
  for (const Configuration& one : configurations(report)) {
    Json measurements = Json::array(), runtimes = Json::array();
    double sum = 0;
    for (const auto& [job, seconds] : one.seconds) {
      const double fastest = *std::ranges::min_element(seconds) / kMilli;
      measurements.push_back({{"name", job}, {"value", fastest}, {"unit", "ms"}});
      for (const double s : seconds) runtimes.push_back(s / kMilli);
      sum += fastest;
    }
    // No time at all is no time of 0.
    if (one.refused.empty())
      measurements.push_back({{"name", "time"}, {"value", sum}, {"unit", "ms"}});
    const char* const state = one.correctness < 1    ? "correctness"
                              : !one.refused.empty() ? "runtime"
                                                     : "correct";
    results.push_back({{"timestamp", report.at("made").at("date")},
                       {"configuration", one.settings},
                       {"times", {{"runtimes", runtimes}}},
                       {"invalidity", state},
                       {"correctness", one.correctness},
                       {"measurements", measurements},
                       {"objectives", {"time"}}});
  }
  return {{"schema_version", "1.0.0"}, {"results", results}, {"metadata", report.at("made")}};
}

/// "T1", the format of search spaces: every setting with the values that were tried.
Json t1(const Json& report) {
  std::map<std::string, std::set<int>> values;
  for (const Configuration& one : configurations(report)) {
    for (const auto& [name, value] : one.settings.items()) values[name].insert(value.get<int>());
  }
  Json parameters = Json::array();
  for (const auto& [name, all] : values) {
    parameters.push_back(
        {{"Name", name}, {"Type", "int"}, {"Values", fmt::format("[{}]", fmt::join(all, ", "))}});
  }
  return {
      {"General", {{"FormatVersion", 1}, {"TimeUnit", "Milliseconds"}, {"OutputFormat", "JSON"}}},
      {"ConfigurationSpace", {{"TuningParameters", parameters}, {"Conditions", Json::array()}}},
      {"KernelSpecification",
       {{"Language", "OpenCL"},
        {"KernelName", "energy_terms"},
        {"KernelFile", "energy.cl"},
        {"Device", {{"Name", report.at("device")}}},
        {"GlobalSize", {{"X", "samples / (lane_width * energy_vectors)"}}},
        {"LocalSize", {{"X", "1"}}}}}};
}

std::string pretty(const Json& json) { return json.dump(2, ' ', true); }

}  // namespace

std::string exported_profile(const nlohmann::json& report, const std::string& table,
                             std::string_view format) {
  if (format == "google-benchmark") return pretty(google_benchmark(report));
  if (format == "bencher") return pretty(bencher(report));
  return format == "lines" ? lines(report) : pasteable(report, table);
}

std::string exported_tuning(const nlohmann::json& report, std::string_view format) {
  return pretty(format == "t4" ? t4(report) : t1(report));
}

}  // namespace qjulia::tools

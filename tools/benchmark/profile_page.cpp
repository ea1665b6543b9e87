#include "benchmark/profile_page.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <optional>

#include "base/base64.hpp"
#include "base/median.hpp"
#include "benchmark/profile_comparison.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/profile/profile.hpp"
#include "report/html.hpp"
#include "report/plot.hpp"

namespace qjulia::benchmark {
namespace {

using nlohmann::json;
using report::Plot;
using report::PlotSeries;

constexpr double kGiga = 1e9, kMilli = 1e-3;

constexpr const char* kPageHead =
    "<meta name=\"viewport\" content=\"width=device-width\"/>"
    "<style>.wide{overflow-x:auto}.plots{display:grid;gap:1rem;"
    "grid-template-columns:repeat(auto-fill,minmax(min(100%,20rem),1fr))}"
    "figure img{width:100%;height:auto}td,th{vertical-align:top}"
    "@media(max-width:40rem){body{margin:1rem auto}.wide table{min-width:56rem}"
    ".wide img{min-width:38rem}}</style>";

std::string text_of(const json& value) {
  if (value.is_null()) return "-";
  return value.is_string() ? value.get<std::string>() : value.dump();
}

/// The facts that two reports may differ in, by what they are called.
std::vector<std::pair<std::string, std::string>> facts_of(const json& report) {
  const json made = report.value("made", json::object());
  const json& device = report.at("device");
  std::vector<std::pair<std::string, std::string>> facts;
  for (const char* name : {"version", "commit", "build"}) {
    facts.emplace_back(name, text_of(made.value(name, json())));
  }
  facts.emplace_back("device", text_of(device.at("name")));
  for (const char* name : {"platform", "driver", "compute_units"}) {
    facts.emplace_back(name, text_of(device.value(name, json())));
  }
  for (const char* name : {"layout", "tuning"}) {
    facts.emplace_back(name, text_of(report.at(name)));
  }
  return facts;
}

std::string date_of(const json& report) {
  return text_of(report.value("made", json::object()).value("date", json()));
}

/// A plot as a picture of its own: names inside a plot are those of every other plot.
std::string plot_figure(const Plot& plot, const std::string& caption) {
  return fmt::format(
      "<figure><img alt=\"{0}\" width=\"{2}\" height=\"{3}\" "
      "src=\"data:image/svg+xml;base64,{1}\"/><figcaption>{0}</figcaption></figure>\n",
      html::escaped(caption), base::base64(plot_svg(plot)), plot.width, plot.height);
}

std::string wide(const std::string& content) {
  return "<div class=\"wide\">\n" + content + "</div>\n";
}

std::string reports_table(const std::vector<NamedProfile>& profiles) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    const json& report = profiles[i].report;
    std::map<std::string, std::string> facts;
    for (const auto& [name, value] : facts_of(report)) facts[name] = value;
    const json waited = report.value("waited_share", json());
    rows.push_back(
        {fmt::format("{}", i + 1), profiles[i].name, date_of(report), facts["version"],
         facts["commit"], facts["device"], facts["driver"],
         waited.is_number() ? fmt::format("{:.0f} %", 100 * waited.get<double>()) : "-"});
  }
  return wide(html::table(
      {"no.", "file", "date", "version", "commit", "device", "driver", "waited"}, rows));
}

std::string changes(const std::vector<NamedProfile>& profiles) {
  std::string items;
  for (std::size_t i = 1; i < profiles.size(); ++i) {
    const auto before = facts_of(profiles[i - 1].report), after = facts_of(profiles[i].report);
    std::vector<std::string> changed;
    for (std::size_t k = 0; k < after.size(); ++k) {
      if (before[k].second == after[k].second) continue;
      changed.push_back(
          fmt::format("{}: {} → {}", after[k].first, before[k].second, after[k].second));
    }
    items +=
        fmt::format("<li>from {} to {}: {}</li>\n", i, i + 1,
                    changed.empty() ? std::string("nothing that the reports record")
                                    : html::escaped(fmt::format("{}", fmt::join(changed, "; "))));
  }
  return items.empty() ? "<p>One report alone.</p>\n" : "<ul>\n" + items + "</ul>\n";
}

/// Seconds of a kernel in a report: CPU seconds where they are known.
struct KernelTime {
  double seconds = 0, low = 0, high = 0;
  bool is_cpu = false;
};

KernelTime time_of(const json& kernel) {
  const json& runs = kernel.at("runs");
  const json& cpu = runs.at("cpu_seconds");
  KernelTime time;
  time.is_cpu = cpu.is_array() && !cpu.empty();
  const auto seconds = (time.is_cpu ? cpu : runs.at("seconds")).get<std::vector<double>>();
  if (seconds.empty()) throw InputError("a kernel has no runs; measure again");
  time.low = std::ranges::min(seconds);
  time.high = std::ranges::max(seconds);
  time.seconds = base::median(seconds);
  return time;
}

/// What must be the same for times to be compared.
std::string trend_name(const json& report, const json& kernel) {
  return fmt::format(
      "{}, n = {}; {} samples, {} factors, {}; {}, {} time", kernel.at("kernel").get<std::string>(),
      kernel.at("iterations").get<int>(), kernel.at("samples").dump(), kernel.at("factors").dump(),
      kernel.at("precision").get<std::string>(), report.at("device").at("name").get<std::string>(),
      time_of(kernel).is_cpu ? "CPU" : "wall");
}

std::string trends(const std::vector<NamedProfile>& profiles) {
  struct Trend {
    PlotSeries middle, low, high;
    bool is_cpu = false;
  };
  std::map<std::string, Trend> all;
  std::vector<std::string> order;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    for (const json& kernel : profiles[i].report.at("kernels")) {
      const std::string name = trend_name(profiles[i].report, kernel);
      const KernelTime time = time_of(kernel);
      const auto [at, is_new] = all.try_emplace(name);
      if (is_new) order.push_back(name);
      Trend& trend = at->second;
      trend.is_cpu = time.is_cpu;
      const auto add = [&](PlotSeries& series, double seconds) {
        series.x.push_back(static_cast<double>(i + 1));
        series.y.push_back(seconds / kMilli);
      };
      add(trend.middle, time.seconds);
      add(trend.low, time.low);
      add(trend.high, time.high);
    }
  }
  std::string text = "<div class=\"plots\">\n";
  for (const std::string& name : order) {
    Trend& trend = all[name];
    if (trend.middle.x.size() < 2) continue;
    trend.middle.label = "median";
    trend.middle.points = true;
    trend.low.label = "fastest run";
    trend.high.label = "slowest run";
    Plot plot;
    plot.width = 480;
    plot.height = 320;
    plot.x = {"report", false, std::pair(0.5, static_cast<double>(profiles.size()) + 0.5)};
    const double most = std::ranges::max(trend.high.y);
    plot.y = {trend.is_cpu ? "CPU ms" : "ms", false, std::pair(0.0, most > 0 ? 1.15 * most : 1.0)};
    plot.series = {trend.middle, trend.low, trend.high};
    text += plot_figure(plot, name);
  }
  return text + "</div>\n";
}

/// Lines of memory and each cache up to the multiply-adds, and each kernel at the bytes that memory
/// must give it and at those that its loop loads.
std::string roofline_of(const json& report) {
  const json& limits = report.at("limits");
  const double roof = limits.at("fma_per_second").get<double>() / kGiga;
  std::vector<std::pair<std::string, double>> slopes{
      {"memory", limits.at("bytes_per_second").get<double>() / kGiga}};
  for (const json& cache : limits.value("caches", json::array())) {
    const double speed = cache.at("bytes_per_second").get<double>() / kGiga;
    if (speed > 0) slopes.emplace_back(fmt::format("L{}", cache.at("level").get<int>()), speed);
  }
  if (!(roof > 0) || !(slopes.front().second > 0)) return "<p>Its limits are not known.</p>\n";
  PlotSeries of_memory, of_loop;
  of_memory.label = "at the bytes of memory";
  of_loop.label = "at the bytes that its loop loads";
  for (PlotSeries* const series : {&of_memory, &of_loop}) {
    series->line = false;
    series->points = true;
  }
  double nearest = roof / slopes.front().second / 10, farthest = 100 * nearest, slowest = roof / 20;
  for (const json& kernel : report.at("kernels")) {
    const json &slots = kernel.at("slots"), &share = kernel.at("share_of_limit");
    const json& bytes = kernel.at("memory_bytes");
    if (!slots.is_number() || !share.is_number()) continue;
    const double of_bytes = bytes.is_number() && bytes.get<double>() > 0
                                ? slots.get<double>() / bytes.get<double>()
                                : 0;
    const double most = kernel.at("limit") == "fma" ? roof : slopes.front().second * of_bytes;
    const double speed = share.get<double>() * most;
    const auto add = [&](PlotSeries& series, double intensity, const std::string& name) {
      if (!(intensity > 0 && speed > 0)) return;
      slowest = std::min(slowest, 0.5 * speed);
      series.x.push_back(intensity);
      series.y.push_back(speed);
      series.names.push_back(name);
      nearest = std::min(nearest, intensity / 4);
      farthest = std::max(farthest, 4 * intensity);
    };
    add(of_memory, of_bytes,
        fmt::format("{}, n = {}", kernel.at("kernel").get<std::string>(),
                    kernel.at("iterations").get<int>()));
    const json mix = kernel.value("instruction_mix", json());
    if (mix.is_object() && mix.value("data_bytes", 0.0) > 0) {
      const double real_bytes = kernel.at("precision") == "double" ? 8 : 4;
      add(of_loop, mix.value("slot_bytes", 0.0) / real_bytes / mix.value("data_bytes", 1.0), "");
    }
  }
  for (const auto& [name, slope] : slopes) nearest = std::min(nearest, roof / slope / 2);
  farthest *= 30;  // room for the legend
  Plot plot;
  plot.width = 760;
  plot.height = 460;
  plot.x = {"slots per byte", true, std::pair(nearest, farthest)};
  plot.y = {"G slots per second", true, std::pair(slowest, 2 * roof)};
  for (const auto& [name, slope] : slopes) {
    const double begin = std::max(nearest, slowest / slope);
    const bool is_memory = name == slopes.front().first;
    PlotSeries line;
    line.label = fmt::format("{}, {:.3g} GB/s", name, slope);
    line.x = {begin, roof / slope};
    line.y = {begin * slope, roof};
    if (is_memory) {  // which goes on along the multiply-adds
      line.label += fmt::format("; multiply-adds, {:.3g} G/s", roof);
      line.x.push_back(farthest);
      line.y.push_back(roof);
    }
    plot.series.push_back(std::move(line));
  }
  for (PlotSeries* const series : {&of_memory, &of_loop}) {
    if (!series->x.empty()) plot.series.push_back(*series);
  }
  return wide(
      plot_figure(plot,
                  "roofline of the last report; kernels whose slots are not counted are left "
                  "out"));
}

std::string share_text(const json& kernel) {
  const json& share = kernel.at("share_of_limit");
  if (!share.is_number()) {
    const auto number = [&](const char* name) {
      const json& value = kernel.at(name);
      return value.is_number() ? std::optional(value.get<double>()) : std::nullopt;
    };
    const json& verdict = kernel.at("share_verdict");
    return verdict_text(verdict.is_string() ? verdict.get<std::string>() : std::string(),
                        number("share_low"), number("share_high"));
  }
  return fmt::format("{:.1f} % ({:.1f} to {:.1f})", 100 * share.get<double>(),
                     100 * kernel.at("share_low").get<double>(),
                     100 * kernel.at("share_high").get<double>());
}

std::string verdicts(const std::vector<NamedProfile>& profiles) {
  std::map<std::pair<std::string, int>, std::string> against_last;
  std::string note;
  if (profiles.size() > 1) {
    try {
      const ProfileComparison found =
          compare_profiles(profiles[profiles.size() - 2].report, profiles.back().report,
                           {.across = Across::drivers});
      for (const KernelComparison& kernel : found.kernels) {
        against_last[{kernel.kernel, kernel.iterations}] =
            kernel.ratio ? fmt::format("{} ({:.2f} to {:.2f})", to_string(kernel.verdict),
                                       kernel.ratio->low, kernel.ratio->high)
                         : to_string(kernel.verdict);
      }
    } catch (const InputError& error) {
      note = fmt::format("<p>The last two reports are not compared: {}.</p>\n",
                         html::escaped(error.what()));
    }
  }
  std::vector<std::vector<std::string>> rows;
  for (const json& kernel : profiles.back().report.at("kernels")) {
    const std::string name = kernel.at("kernel");
    const int n = kernel.at("iterations");
    const KernelTime time = time_of(kernel);
    const auto found = against_last.find({name, n});
    rows.push_back({name, fmt::format("{}", n),
                    fmt::format("{:.4g}{}", time.seconds / kMilli, time.is_cpu ? " CPU" : ""),
                    share_text(kernel), found == against_last.end() ? "-" : found->second,
                    text_of(kernel.value("limited_by", json()))});
  }
  return note + wide(html::table({"kernel", "n", "ms", "share of its limit",
                                  "time over that of the report before", "what limits it"},
                                 rows));
}

}  // namespace

std::string profile_page(std::vector<NamedProfile> profiles) {
  for (const NamedProfile& profile : profiles) {
    expect_measured(profile.report, "'" + profile.name + "'");
    try {
      facts_of(profile.report);
      for (const json& kernel : profile.report.at("kernels")) {
        time_of(kernel);
        trend_name(profile.report, kernel);
        share_text(kernel);
      }
      roofline_of(profile.report);
    } catch (const json::exception&) {
      throw InputError(fmt::format(
          "'{}' is no report of 'qjulia profile measure --json' of this version; measure again",
          profile.name));
    } catch (const InputError& error) {
      throw InputError(fmt::format("'{}': {}", profile.name, error.what()));
    }
  }
  const bool are_dated = std::ranges::all_of(
      profiles, [](const NamedProfile& profile) { return date_of(profile.report) != "-"; });
  if (are_dated) {
    std::ranges::stable_sort(profiles, {}, [](const auto& p) { return date_of(p.report); });
  }
  const json& last = profiles.back().report;
  std::string body = "<h2>Reports</h2>\n" + reports_table(profiles);
  body += "<h2>What changed</h2>\n" + changes(profiles);
  body += "<h2>Kernels of the last report</h2>\n" + verdicts(profiles);
  for (const json& sign : last.value("disturbances", json::array())) {
    body += fmt::format("<p>Busy: {}.</p>\n", html::escaped(text_of(sign)));
  }
  body += "<h2>Roofline</h2>\n" + roofline_of(last);
  if (profiles.size() > 1) body += "<h2>Trends</h2>\n" + trends(profiles);
  return html::page("Profiles of qjulia", body, kPageHead);
}

}  // namespace qjulia::benchmark

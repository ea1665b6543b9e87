#include "profile_tuning.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "base/text.hpp"
#include "failure.hpp"
#include "profile_tables.hpp"
#include "qjulia/error.hpp"
#include "qjulia/tuning_cache.hpp"

namespace qjulia::tools {

void add_to_grid(const std::string& text, TuneGrid& grid) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) {
    throw InputError(fmt::format(
        "'{}' is not a setting with values; give NAME=A,B,C such as lane_width=1,8,16", text));
  }
  std::vector<int>& values = grid[text.substr(0, equals)];
  for (const std::string& value : base::split(text.substr(equals + 1), ',')) {
    values.push_back(whole_number(value));
  }
}

int run_tune(const TrustedDevice& wanted, const ProfileOptions& options, Session& session) {
  const Device device = session.open_device(wanted);
  const std::string file = tuning_file(device.info()).string();
  const TuneReport report = tune(device, options, session.monitor());
  if (report.why_kept.empty()) {
    save_tuning(device.with_tuning(report.precision, report.tuning), report.precision);
  }
  nlohmann::json json = to_json(report);
  json["file"] = file;
  session.console.result(profile_table(report, file), json);
  if (!report.disturbances.empty()) {
    session.console.warn(fmt::format("the machine was busy: {}; tune on an idle machine",
                                     fmt::join(report.disturbances, "; ")));
  }
  return kDone;
}

int run_grid(const TrustedDevice& wanted, const ProfileOptions& options, const TuneGrid& grid,
             const std::string& csv, Session& session) {
  const Device device = session.open_device(wanted);
  const GridReport report = measure_grid(device, options, grid, session.monitor());
  if (!csv.empty()) base::write_file(csv, to_csv(report));
  session.console.result(profile_table(report), to_json(report));
  return kDone;
}

int run_export(const TrustedDevice& wanted, const std::string& file, Session& session) {
  const Device device = session.open_device(wanted);
  export_tuning(device, file);
  session.console.result(fmt::format("settings of '{}': {}", device.info().name, file),
                         {{"device", device.info().name},
                          {"file", file},
                          {"single", to_json(device.tuning(Precision::single))},
                          {"double", to_json(device.tuning(Precision::dbl))}});
  return kDone;
}

int run_import(const TrustedDevice& wanted, const std::string& file, Session& session) {
  const Device device = import_tuning(session.open_device(wanted), file);
  const std::string kept = tuning_file(device.info()).string();
  session.console.result(fmt::format("settings of '{}' kept in: {}", device.info().name, kept),
                         {{"device", device.info().name},
                          {"file", kept},
                          {"single", to_json(device.tuning(Precision::single))},
                          {"double", to_json(device.tuning(Precision::dbl))}});
  return kDone;
}

}  // namespace qjulia::tools

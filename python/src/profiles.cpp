/// Profiles, tuning, checks of a device.

#include <pybind11/stl.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "jobs/doctor_report.hpp"
#include "jobs/run_facts.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "parts.hpp"
#include "qjulia/device/tuning_cache.hpp"
#include "qjulia/profile/own_launch.hpp"
#include "qjulia/profile/profile_settings.hpp"
#include "qjulia/profile/tune.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

std::string report_text(const nlohmann::json& json) {
  return json.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

/// What profiles and tuning measure: made up where map or mesh is null.
template <class Table>
ProfileOptions measured(Keywords& keywords, const Table& table, const KeptMap* map,
                        const TriangleMesh* mesh) {
  ProfileOptions options;
  keywords.take_all(table, options);
  if (map != nullptr) options.map = map->map;
  if (mesh != nullptr) options.mesh = *mesh;
  return options;
}

std::string profiled(const OpenDevice& device, const KeptMap* map, const TriangleMesh* mesh,
                     const std::vector<std::string>& jobs, const std::vector<std::string>& kernels,
                     bool with_host, const py::object& on_progress, const py::dict& given) {
  Keywords keywords("profile", given);
  ProfileOptions options = measured(keywords, profile_settings(), map, mesh);
  keywords.expect_no_more();
  options.jobs = jobs;
  options.kernels = kernels;
  options.validate();
  nlohmann::json report;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] { report = to_json(profile(device.device, options, monitor)); });
  report["made"] = tools::run_facts(with_host);
  return report_text(report);
}

std::string tuned(const OpenDevice& device, const KeptMap* map, const TriangleMesh* mesh, bool keep,
                  bool with_host, const py::object& on_progress, const py::dict& given) {
  Keywords keywords("tune", given);
  const ProfileOptions options = measured(keywords, tune_settings(), map, mesh);
  keywords.expect_no_more();
  options.validate();
  nlohmann::json report;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] {
    const TuneReport found = tune(device.device, options, monitor);
    if (keep && found.why_kept.empty()) {
      save_tuning(device.device.with_tuning(found.precision, found.tuning), found.precision);
    }
    report = to_json(found);
  });
  report["file"] = tuning_file(device.device.info()).string();
  report["made"] = tools::run_facts(with_host);
  return report_text(report);
}

std::string checked(const OpenDevice& device, const std::string& programs,
                    const py::object& on_progress) {
  nlohmann::json report;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] {
    const DriverFacts facts = driver_facts(device.device);
    const tools::ProcessChecks checks = tools::check_here(device.device, programs, monitor);
    report = tools::doctor_report(device.device, facts, checks,
                                  tools::doctor_findings(device.device, facts, checks));
    tools::keep_build_logs(checks.report, report);
  });
  return report_text(report);
}

std::string profiled_launch(const OpenDevice& device, const std::string& kernel,
                            const py::object& run, const py::dict& given) {
  if (PyCallable_Check(run.ptr()) == 0) {
    throw py::type_error("run must be a function without arguments, not " + shown(run));
  }
  Watcher watcher;
  OwnLaunch launch;
  launch.kernel = kernel;
  launch.run = [&] {
    watcher.on_caller([&] { run(); });
    throw_if_stopped(watcher.token());
  };
  Keywords keywords("profile_launch", given);
  keywords.take("slots", launch.slots);
  keywords.take("bytes", launch.bytes);
  keywords.take("at_most", launch.at_most);
  keywords.take("precision", launch.precision);
  keywords.take("repeats", launch.repeats);
  keywords.expect_no_more();
  launch.validate();
  nlohmann::json figures;
  ProgressMonitor monitor;
  monitor.stop = watcher.token();
  watcher.run(device, [&] { figures = to_json(profile_launch(device.device, launch, monitor)); });
  return report_text(figures);
}

}  // namespace

void add_profiles(py::module_& module) {
  module.def("profile", &profiled);
  module.def("tune", &tuned);
  module.def("doctor", &checked);
  module.def("profile_launch", &profiled_launch);
  module.def("profile_settings", [] { return described(profile_settings(), ProfileOptions{}); });
  module.def("tune_settings", [] { return described(tune_settings(), ProfileOptions{}); });
}

}  // namespace qjulia::python

/// Jobs: what the command's files hold, and what they are made again from.

#include <string>
#include <vector>

#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "device.hpp"
#include "jobs/job_run.hpp"
#include "parts.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::tools {

const char* const kProgramDescription = "The commands that make files from files.";

void describe(CommandLine& program, ChosenCommand& chosen) {
  for (const auto add : {add_fit, add_shape, add_paint, add_portals, add_surface, add_render,
                         add_sample, add_compare, add_convert, add_run}) {
    add(program, chosen);
  }
}

}  // namespace qjulia::tools

namespace qjulia::python {
namespace {

/// Runs the job of this text. @return its report as JSON, and its warnings
py::tuple run(const std::string& text, const std::string& output, const OpenDevice& device,
              const py::object& on_progress) {
  tools::Job job = tools::job_from_json(nlohmann::json::parse(text), "the job");
  tools::find_files(job.options, tools::command_usage(job.command),
                    std::filesystem::current_path());
  tools::Said said;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] { said = tools::run_job(job, output, {device.device, monitor}); });
  return py::make_tuple(said.report.dump(), said.warnings);
}

}  // namespace

void add_jobs(py::module_& module) { module.def("run", &run); }

}  // namespace qjulia::python

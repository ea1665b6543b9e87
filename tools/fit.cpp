/// qjulia fit: a mesh in, a map out.

#include "qjulia/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "commands.hpp"
#include "exit_code.hpp"
#include "files.hpp"
#include "fit_options.hpp"
#include "launched_ranks.hpp"
#include "options.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/report.hpp"
#include "qjulia/tuning_cache.hpp"

namespace qjulia::tools {
namespace {

struct Arguments {
  std::string mesh;
  std::string output;
  std::string device;
  std::string report;  ///< folder; empty: none
  FitArguments fit;
  bool resume = false;
};

std::string stage_line(const StageReport& stage) {
  return fmt::format(
      "stage {:16} {:5} evaluations {:8.1f} s  energy {:10.4g} -> {:10.4g}  IoU {:.4f} at n = {}",
      stage.name, stage.evaluations, stage.seconds, stage.energy_before, stage.energy_after,
      stage.iou, stage.iterations);
}

std::string summary(const Arguments& arguments, const FitResult& result, double seconds) {
  std::string text;
  if (!result.stages.empty()) {
    const StageReport& last = result.stages.back();
    text = fmt::format("energy {:.4g}, IoU {:.3f} at n = {} on a coarse grid\n", last.energy_after,
                       last.iou, last.iterations);
  }
  return text + fmt::format(
                    "{} factors, {} evaluations, {:.1f} s; ended: {}\n"
                    "map: {}\n"
                    "next: qjulia render {} -o picture.png",
                    result.map.factors.size(), result.evaluations, seconds,
                    to_string(result.stopped), arguments.output, arguments.output);
}

nlohmann::json report(const Arguments& arguments, const FitResult& result, double seconds) {
  nlohmann::json json = result.map.provenance;
  json["map"] = arguments.output;
  json["factors"] = result.map.factors.size();
  json["seconds"] = seconds;
  return json;
}

/// True when the output is the finished result of the same mesh and options.
bool is_done(const Arguments& arguments, const FitOptions& options) {
  if (!std::filesystem::exists(arguments.output)) return false;
  const nlohmann::json made = read_map(arguments.output).provenance;
  return made.is_object() && made.value("stopped", "interrupted") != "interrupted" &&
         made.value("options", nlohmann::json()) == to_json(options) &&
         made.value("mesh", nlohmann::json()) == file_json(arguments.mesh);
}

/// This rank's device, as `Device::choose` takes it.
std::string own_device(const LaunchedRanks& ranks, const std::string& wanted) {
  if (ranks.size() == 1) return wanted;
  const DeviceInfo info = devices_of(ranks, wanted).front();
  return fmt::format("{}:{}", info.platform, info.index);
}

/// Rank 0's part, or all of it where there is one rank.
int fit_mesh(const Arguments& arguments, const FitOptions& options, LaunchedRanks& ranks,
             Session& session) {
  Invitation invitation(ranks);
  if (is_mesh_file(arguments.output)) {
    throw InputError(fmt::format("--output '{}' has the name of a mesh; end it in .qjulia.json",
                                 arguments.output));
  }
  require_writable(arguments.output);
  if (arguments.resume && is_done(arguments, options)) {
    session.console.summary(
        fmt::format("map: {} is finished; there is nothing to resume", arguments.output),
        {{"map", arguments.output}, {"resumed", false}});
    return kDone;
  }
  MeshReport mesh_report;
  const TriangleMesh mesh = [&] {
    const TraceStage stage(session.trace(), "read the mesh");
    return read_mesh(arguments.mesh, &mesh_report);
  }();
  for (const std::string& warning : mesh_report.warnings()) {
    session.console.warn(fmt::format("{}: {}", arguments.mesh, warning));
  }
  const Device device = session.open_device(own_device(ranks, arguments.device));

  FitOptions remaining = options;
  // The limit is of the whole command; what is left may not be nothing.
  remaining.time_limit = std::max(options.time_limit - session.seconds(), 1e-3);
  remaining.checkpoint = arguments.output + ".checkpoint";
  remaining.resume = arguments.resume;
  invitation.send();
  FitResult result = fit(device, mesh, remaining, session.watch(), ranks);
  for (const std::string& warning : result.warnings) session.console.warn(warning);
  {
    const TraceStage stage(session.trace(), "save");
    result.map.provenance = provenance(arguments.mesh, options, device, result);
    write_map(result.map, arguments.output);
  }
  const bool interrupted = result.stopped == StopReason::interrupted;
  if (!interrupted) std::filesystem::remove(remaining.checkpoint);

  if (!arguments.report.empty() && !interrupted) {
    const TraceStage stage(session.trace(), "report");
    const std::string title = std::filesystem::path(arguments.mesh).filename().string();
    write_report(make_report(device, mesh, result, title, {}, session.watch()),
                 std::filesystem::path(arguments.report) / "report.html");
  }

  for (const StageReport& stage : result.stages) session.console.detail(stage_line(stage));
  session.report_kernels(device);
  const double seconds = session.seconds();
  session.console.summary(summary(arguments, result, seconds), report(arguments, result, seconds));
  return interrupted ? kInterrupted : kDone;
}

int run(const Arguments& arguments, Session& session) {
  const auto ranks = join_ranks();
  return together(*ranks, [&]() -> int {
    FitOptions options = checked_options(arguments.fit);
    if (!arguments.fit.sample_parts) options.sample_parts = ranks->size();
    if (ranks->rank() == 0) return fit_mesh(arguments, options, *ranks, session);
    session.leave_trace();  // rank 0 writes it
    if (!is_invited(*ranks)) return kDone;
    serve_fit(
        *ranks,
        [&] {
          const auto [device, warning] =
              with_kept_tuning(Device::choose(own_device(*ranks, arguments.device)));
          if (!warning.empty()) session.console.warn(warning);
          return device;
        },
        options.precision);
    return kDone;
  });
}

void describe_options(CLI::App& command, Arguments& a) {
  command.add_option("MESH", a.mesh, "Triangle mesh: .obj, .off, .ply or .stl")
      ->required()
      ->type_name("");
  command.add_option("-o,--output", a.output, "Map file to write, such as bunny.qjulia.json")
      ->required()
      ->type_name("MAP");
  add_fit_options(command, a.fit);
  command.add_flag("--resume", a.resume,
                   "Go on where an earlier run of the same command was stopped or killed: it kept "
                   "MAP.checkpoint. Without one, start afresh; with the finished map, do nothing");
  command
      .add_option("--report", a.report,
                  "Folder for report.html: pictures, curves, figures and options on one page "
                  "that needs nothing else. Made after the fit, in some seconds more")
      ->type_name("DIR");
  add_device(command, a.device);
}

}  // namespace

void add_fit(CLI::App& program, ChosenCommand& chosen) {
  auto* command = program.add_subcommand("fit", "Fit a map to a mesh");
  command->footer(
      "Examples:\n"
      "  qjulia fit bunny.obj -o bunny.qjulia.json\n"
      "  qjulia fit bunny.obj -o quick.qjulia.json --factors 100 --time-limit 20\n"
      "Meshes with holes are welcome; what is wrong with them is reported. Ctrl-C ends the fit\n"
      "and saves what was reached (exit code 130); --resume then goes on. A resumed fit ends with\n"
      "the same map as one that was never stopped, unless a time limit ends it.");
  auto arguments = std::make_shared<Arguments>();
  describe_options(*command, *arguments);
  add_trace(*command, chosen.trace);
  add_verbosity(*command, chosen.verbosity);
  command->callback([arguments, &chosen] {
    chosen.run = [arguments](Session& session) { return run(*arguments, session); };
  });
}

}  // namespace qjulia::tools

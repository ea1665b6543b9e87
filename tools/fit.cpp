/// qjulia fit: a mesh in, a map out.

#include "qjulia/fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "commands.hpp"
#include "exit_code.hpp"
#include "files.hpp"
#include "options.hpp"
#include "provenance.hpp"
#include "qjulia/error.hpp"
#include "qjulia/map_file.hpp"

namespace qjulia::tools {
namespace {

struct Arguments {
  std::string mesh;
  std::string output;
  std::string device;
  std::string unknowns = "all";
  std::string precision = "single";
  std::optional<double> time_limit;
  FitOptions options;
};

FitOptions checked_options(const Arguments& arguments) {
  FitOptions options = arguments.options;
  options.unknowns = arguments.unknowns == "all" ? Unknowns::all : Unknowns::exponents;
  options.precision = arguments.precision == "double" ? Precision::dbl : Precision::single;
  if (arguments.time_limit) options.time_limit = *arguments.time_limit;
  options.validate();
  return options;
}

std::string stage_line(const StageReport& stage) {
  return fmt::format(
      "stage {:16} {:5} evaluations {:8.1f} s  energy {:10.4g} -> {:10.4g}  IoU {:.4f}", stage.name,
      stage.evaluations, stage.seconds, stage.energy_before, stage.energy_after, stage.iou);
}

std::string summary(const Arguments& arguments, const FitResult& result, double seconds) {
  std::string text;
  if (!result.stages.empty()) {
    const StageReport& last = result.stages.back();
    text = fmt::format("energy {:.4g}, IoU {:.3f} at n = 1 on a coarse grid\n", last.energy_after,
                       last.iou);
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

int run(const Arguments& arguments, Session& session) {
  const FitOptions options = checked_options(arguments);
  if (is_mesh_file(arguments.output)) {
    throw InputError(fmt::format("--output '{}' has the name of a mesh; end it in .qjulia.json",
                                 arguments.output));
  }
  require_writable(arguments.output);
  MeshReport mesh_report;
  const TriangleMesh mesh = read_mesh(arguments.mesh, &mesh_report);
  for (const std::string& warning : mesh_report.warnings()) {
    session.console.warn(fmt::format("{}: {}", arguments.mesh, warning));
  }
  const Device device = session.open_device(arguments.device);

  FitOptions remaining = options;
  // The limit is of the whole command; what is left may not be nothing.
  remaining.time_limit = std::max(options.time_limit - session.seconds(), 1e-3);
  FitResult result = fit(device, mesh, remaining, session.watch());
  for (const std::string& warning : result.warnings) session.console.warn(warning);
  result.map.provenance = provenance(arguments.mesh, options, device.info(), result);
  write_map(result.map, arguments.output);

  for (const StageReport& stage : result.stages) session.console.detail(stage_line(stage));
  session.report_kernels(device);
  const double seconds = session.seconds();
  session.console.summary(summary(arguments, result, seconds), report(arguments, result, seconds));
  return result.stopped == StopReason::interrupted ? kInterrupted : kDone;
}

void describe_options(CLI::App& command, Arguments& a) {
  command.add_option("MESH", a.mesh, "Triangle mesh: .obj, .off, .ply or .stl")
      ->required()
      ->type_name("");
  command.add_option("-o,--output", a.output, "Map file to write, such as bunny.qjulia.json")
      ->required()
      ->type_name("MAP");
  command
      .add_option("--factors", a.options.factors,
                  "Factors of the map, 8 to 20000: more follow the shape more closely, and cost "
                  "time in proportion")
      ->capture_default_str();
  add_number(command, "--detail", a.options.detail,
             "Thickness of the fractal shell as a fraction of the shape's box diagonal, 0.001 to "
             "0.1: 0.005 smooth, 0.01 first detail, 0.02 to 0.03 clearly fractal, 0.05 heavily "
             "grooved. 'surface' and 'render' can change it later")
      ->capture_default_str();
  command
      .add_option("--time-limit", a.time_limit,
                  "Seconds of the whole command; the map reached by then is saved. Default: none")
      ->type_name("SECONDS");
  command
      .add_option("--max-evaluations", a.options.max_evaluations,
                  "Most evaluations of energy and gradient; 0 is the schedule's own number")
      ->capture_default_str();
  command
      .add_option("--seed", a.options.seed,
                  "Seed of all random choices. The same seed, options and device give the same "
                  "factors bit for bit, unless a time limit ends the fit")
      ->check(CLI::NonNegativeNumber)
      ->type_name("INT")
      ->capture_default_str();
  command.add_option("--schedule", a.options.schedule, "Name of a built-in fit schedule")
      ->capture_default_str();
  command
      .add_option("--unknowns", a.unknowns,
                  "What the fit may change: exponents alone, or exponents and centres")
      ->check(CLI::IsMember({"all", "exponents"}))
      ->capture_default_str();
  command.add_option("--precision", a.precision, "Arithmetic on the device")
      ->check(CLI::IsMember({"single", "double"}))
      ->capture_default_str();
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
      "and saves what was reached (exit code 130).");
  auto arguments = std::make_shared<Arguments>();
  describe_options(*command, *arguments);
  add_verbosity(*command, chosen.verbosity);
  command->callback([arguments, &chosen] {
    chosen.run = [arguments](Session& session) { return run(*arguments, session); };
  });
}

}  // namespace qjulia::tools

/// qjulia fit: a mesh in, a map out.

#include "qjulia/fit/fit.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/deadline.hpp"
#include "base/file_types.hpp"
#include "base/output_check.hpp"
#include "base/output_file.hpp"
#include "commands/commands.hpp"
#include "commands/launched_ranks.hpp"
#include "commands/roughness_report.hpp"
#include "describe/files.hpp"
#include "describe/fit_options.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"
#include "report/report.hpp"

namespace qjulia::tools {
namespace {

struct FitCommandArguments {
  std::string mesh;
  OutputName output;
  TrustedDevice device;
  std::string report;  ///< folder; empty: none
  FitOptions fit;
  std::string initial;  ///< the map to start from; empty: none
  RoughnessTarget target;
  bool resume = false;
};

std::string summary(const FitCommandArguments& arguments, const FitResult& result, bool verbose) {
  return fmt::format("{}\n{}\nmap: {}\nnext: qjulia render {} -o picture.png",
                     verbose ? full_summary(result) : brief_summary(result),
                     up_line(*result.map.frame.up, arguments.fit.up), arguments.output.path,
                     shell_word(arguments.output.path));
}

nlohmann::json report(const FitCommandArguments& arguments, const FitResult& result,
                      double seconds) {
  nlohmann::json json = result.map.provenance.json();
  json["map"] = arguments.output.path;
  json["factors"] = result.map.dynamics.factors.size();
  json["up"] = to_string(*result.map.frame.up);
  json["seconds"] = seconds;
  return json;
}

/// True when the output is the finished result of the same mesh and options.
bool is_done(const FitCommandArguments& arguments, const FitOrigin& origin) {
  if (!std::filesystem::is_regular_file(arguments.output.path)) return false;
  const nlohmann::json made = read_map(arguments.output.path).provenance.json();
  return made.is_object() && made.value("stopped", "interrupted") != "interrupted" &&
         made.value("/target/asked"_json_pointer, nlohmann::json()) ==
             asked_json(arguments.target) &&
         made.value("options", nlohmann::json()) == origin.options &&
         made.value("mesh", nlohmann::json()) == origin.mesh;
}

std::filesystem::path report_file(const FitCommandArguments& arguments) {
  return std::filesystem::path(arguments.report) / "report.html";
}

/// None for an output that is no file, such as /dev/null.
std::filesystem::path checkpoint_file(const FitCommandArguments& arguments) {
  if (base::is_special(arguments.output.path)) return {};
  return arguments.output.path + ".checkpoint";
}

void check_files(const FitCommandArguments& arguments, const FitOptions& options,
                 Session& session) {
  check_map_name(arguments.output.path);
  std::vector<std::filesystem::path> inputs{arguments.mesh};
  if (base::extension_of(options.schedule) == ".toml") inputs.emplace_back(options.schedule);
  if (!arguments.initial.empty()) inputs.emplace_back(arguments.initial);
  OutputName output = arguments.output;
  output.must_be_new = output.must_be_new && !arguments.resume;
  std::vector<base::Output> outputs{output_named("--output", output)};
  if (const auto checkpoint = checkpoint_file(arguments); !checkpoint.empty()) {
    outputs.push_back(
        output_named("the checkpoint of --output", {checkpoint.string(), output.must_be_new}));
  }
  if (!arguments.report.empty()) {
    outputs.push_back({.name = "--report", .path = report_file(arguments), .makes_folder = true});
  }
  session.check_outputs({inputs, outputs});
  if (!arguments.report.empty()) {
    // The folder must not be where another output goes, either.
    outputs.back() = {"--report", arguments.report};
    base::check_distinct({}, outputs);
  }
}

void make_report(const FitCommandArguments& arguments, const Device& device,
                 const TriangleMesh& mesh, const FitResult& result, Session& session) {
  const TraceStage stage(session.trace(), "report");
  const std::string title = std::filesystem::path(arguments.mesh).filename().string();
  const report::FitReport report =
      report::make_report(device, mesh, result, title, session.monitor());
  report::write_report(report, report_file(arguments));
}

/// What --resume does with a finished map: its report, if it is asked for.
int show_finished(const FitCommandArguments& arguments, const TrustedDevice& device_choice,
                  Session& session) {
  nlohmann::json json = {{"map", arguments.output.path}, {"resumed", false}};
  std::string text =
      fmt::format("map: {} is finished; there is nothing to resume", arguments.output.path);
  if (!arguments.report.empty()) {
    const FitResult result = finished_fit(read_map(arguments.output.path), arguments.output.path);
    const TriangleMesh mesh = session.read_mesh(arguments.mesh);
    const Device device = session.open_device(device_choice);
    make_report(arguments, device, mesh, result, session);
    text += "\nreport: " + report_file(arguments).string();
    json["report"] = report_file(arguments).string();
  }
  session.console.summary(text, json);
  return kDone;
}

/// @throws InputError if reading takes longer than the time limit, which leaves no time to fit.
TriangleMesh read_in_time(const std::string& mesh, double time_limit, Session& session) {
  constexpr double kLate = 0.5;  // seconds; measuring the mesh coarsely takes about one more
  const base::Deadline deadline(session.stop(), time_limit + kLate - session.seconds());
  try {
    return session.read_mesh(mesh, deadline.token());
  } catch (const Interrupted&) {
    if (session.stop().stop_requested()) throw;
    throw InputError(
        fmt::format("--time-limit: reading '{}' alone takes longer than {:g} s; give more seconds, "
                    "or a mesh of fewer triangles",
                    mesh, time_limit));
  }
}

/// What a rank has before the fit begins.
struct FitStart {
  bool is_done = false;  ///< there is nothing to fit
  FitOrigin origin;      ///< rank 0 alone has one
  TriangleMesh mesh;
  std::optional<Device> device;
};

/// Rank 0 checks the files and speaks; every rank reads the mesh and opens its own device.
FitStart start(const FitCommandArguments& arguments, const FitOptions& options,
               LaunchedRanks& ranks, Session& session) {
  FitStart start;
  if (ranks.rank() == 0) {
    check_files(arguments, options, session);
    start.origin = origin_of(options, session.job());
    start.is_done = arguments.resume && is_done(arguments, start.origin);
    if (start.is_done) return start;
    // With --resume the name may be that of an earlier run's map, whose checkpoint lies beside it.
    if (arguments.output.must_be_new && !std::filesystem::exists(checkpoint_file(arguments))) {
      base::check_writable(output_named("--output", arguments.output));
    }
    start.mesh = read_in_time(arguments.mesh, options.most_seconds(), session);
  } else {
    start.mesh = qjulia::read_mesh(arguments.mesh, session.monitor().stop);
  }
  start.device = open_rank_device(ranks, arguments.device, session);
  return start;
}

/// Writes the map; where its folder is gone or full by now, into the folder for temporary files.
/// @throws OutputError which says where the map is then
void keep(const Map& map, const std::string& output) {
  try {
    return write_map(map, output);
  } catch (const OutputError& error) {
    std::error_code no_folder;
    const std::filesystem::path folder = std::filesystem::temp_directory_path(no_folder);
    const std::string kept =
        (folder / fmt::format("qjulia-{}-{}", ::getpid(), name_of(output))).string();
    try {
      write_map(map, kept);
    } catch (const OutputError&) {
      throw error;
    }
    throw OutputError(fmt::format("{}. The map that was reached is in '{}'", error.what(), kept));
  }
}

/// Gives the map, which is written already, the roughness that is asked for.
/// @throws InputError which says that the map is kept without it
ReachedRoughness made_rough(const FitCommandArguments& arguments, const FitStart& start, Map& map,
                            Session& session) {
  if (!arguments.target.is_set()) return {};
  try {
    ReachedRoughness reached =
        reach_target(*start.device, map, arguments.target, &start.mesh, session);
    keep(map, arguments.output.path);
    return reached;
  } catch (const OptionError& error) {
    throw OptionError(error.field(), fmt::format("{}. '{}' has the map without it", error.problem(),
                                                 arguments.output.path));
  }
}

/// Writes the map and the report, and says so.
int save(const FitCommandArguments& arguments, const FitStart& start, FitResult result,
         Session& session) {
  {
    const TraceStage stage(session.trace(), "save");
    result.map.provenance = provenance(start.origin, *start.device, result);
    keep(result.map, arguments.output.path);
  }
  bool interrupted = result.stopped == StopReason::interrupted;
  const ReachedRoughness reached =
      interrupted ? ReachedRoughness() : made_rough(arguments, start, result.map, session);
  if (!interrupted) {
    std::error_code ignored;  // a checkpoint of the same fit does no harm
    std::filesystem::remove(checkpoint_file(arguments), ignored);
  }
  for (const std::string& warning : result.warnings) session.console.warn(warning);
  if (!arguments.report.empty() && !interrupted) {
    try {
      make_report(arguments, *start.device, start.mesh, result, session);
    } catch (const Interrupted&) {
      interrupted = true;
      session.console.warn("interrupted; the map is finished, and --resume makes its report");
    }
  }
  session.report_kernels(*start.device);
  session.console.summary(reached.text + summary(arguments, result, session.console.verbose()),
                          report(arguments, result, session.seconds()));
  return interrupted ? kInterrupted : kDone;
}

/// The fit; where the device fails, the error says that the checkpoint is kept.
FitResult fit_or_tell(const FitStart& begun, const FitOptions& options, Session& session,
                      LaunchedRanks& ranks) {
  try {
    return fit(*begun.device, begun.mesh, options, session.monitor(), ranks);
  } catch (const DeviceError& error) {
    std::error_code ignored;
    if (options.checkpoint.empty() || !std::filesystem::exists(options.checkpoint, ignored)) throw;
    throw Error(
        fmt::format("{}\n'{}' keeps what the fit had reached: the same command with --resume goes "
                    "on from there",
                    error.what(), options.checkpoint.string()));
  }
}

int run_fit(const FitCommandArguments& arguments, Session& session) {
  LaunchedRanks ranks;
  if (ranks.rank() > 0) session.leave_trace();  // rank 0 writes it
  FitOptions options;
  FitStart begun;
  const int code = together(ranks, [&]() -> int {
    options = arguments.fit;
    if (!arguments.initial.empty()) options.initial = read_map(arguments.initial, session.stop());
    options.validate();
    arguments.target.validate();
    if (!options.sample_parts) options.sample_parts = ranks.size();
    begun = start(arguments, options, ranks, session);
    return kDone;
  });
  if (code != kDone) return code;
  if (ranks.all_gather({begun.is_done ? 1.0 : 0.0}).front().front() != 0) {
    return ranks.rank() == 0
               ? show_finished(arguments, own_device(ranks, arguments.device), session)
               : kDone;
  }
  return together(ranks, [&]() -> int {
    FitOptions remaining = options;
    // The limit covers the whole command; some time must remain.
    remaining.time_limit = std::max(options.most_seconds() - session.seconds(), 1e-3);
    remaining.checkpoint = checkpoint_file(arguments);
    remaining.resume = arguments.resume;
    remaining.observer.on_warning = [&](const std::string& warning) {
      session.console.warn(warning);
    };
    FitResult result = fit_or_tell(begun, remaining, session, ranks);
    return ranks.rank() == 0 ? save(arguments, begun, std::move(result), session) : kDone;
  });
}

void describe_fit(Command command, FitCommandArguments& a) {
  command
      .input("MESH", a.mesh,
             "Triangle mesh, or points with normals: " +
                 base::extension_list(base::FileContent::mesh, base::FileUse::read))
      .offers_files(readable({base::FileContent::mesh}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.mesh, ".qjulia.json"); }, "MAP",
          "Map file to write, such as bunny.qjulia.json." + named_text("mesh", ".qjulia.json"))
      .offers_files({".json"});
  add_fit_options(command, a.fit);
  command
      .file(
          "--initial", a.initial, "MAP",
          "Start from this map's factors in place of a placement: from the map of a shape that was "
          "a little different, with '--schedule follow', or to go on with a finished map")
      .offers_files(readable({base::FileContent::map}));
  add_settings(command, target_settings(), a.target);
  command
      .flag("--resume", a.resume,
            "Go on where an earlier run of the same command was stopped or killed: it kept "
            "MAP.checkpoint. Without one, start afresh; with the finished map, do nothing")
      .not_in_job();
  command
      .file("--report", a.report, "DIR",
            "Folder for report.html: pictures, curves, figures and options on one page that "
            "needs nothing else. Made after the fit, in some seconds more")
      .not_in_job()
      .offers_folders();
  add_device_to_use(command, a.device);
}

}  // namespace

void add_fit(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"fit", "Fit a map to a mesh", R"(Examples:
  qjulia fit bunny.obj -o bunny.qjulia.json
  qjulia fit bunny.obj -o quick.qjulia.json --factors 100 --time-limit 20
Meshes with holes are welcome; what is wrong with them is reported. Ctrl-C ends the fit
and saves what was reached (exit code 130); --resume then goes on. A resumed fit ends with
the same factors as one that was never stopped, unless a time limit ends it.)",
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_fit, run_fit);
}

}  // namespace qjulia::tools

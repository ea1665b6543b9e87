/// qjulia morph: two maps in, the maps on the way from one to the other out.

#include <fmt/format.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"
#include "qjulia/morph/morph_steps.hpp"

namespace qjulia::tools {
namespace {

struct MorphArguments {
  std::string from, to, output;
  TrustedDevice device;
  MorphOptions options;
};

std::filesystem::path step_file(const std::string& folder, int step) {
  return std::filesystem::path(folder) / fmt::format("step_{:04}.qjulia.json", step);
}

Plan plan_morph(const MorphArguments& arguments) {
  const std::filesystem::path folder(arguments.output);
  std::error_code ignored;
  const auto status = std::filesystem::status(folder, ignored);
  if (folder.has_extension() || (exists(status) && !is_directory(status))) {
    throw InputError(fmt::format(
        "--output: '{}' is to be a folder of maps; give a name without an extension that no file "
        "has",
        arguments.output));
  }
  arguments.options.validate();
  Plan plan{{arguments.from, arguments.to}, {}};
  for (int step = 1; step <= arguments.options.steps; ++step) {
    plan.outputs.push_back({"--output", step_file(arguments.output, step), {}, true});
  }
  return plan;
}

std::string flicker_text(const Flicker& flicker) {
  if (flicker.steps == 0) return "flicker: too few steps to tell; give four or more";
  return fmt::format(
      "flicker: {:.3f} % of the cells change sides in a step and are back within two more, {:.3f} "
      "% in the worst step; {:.2f} % change sides in a step",
      100 * flicker.mean, 100 * flicker.worst, 100 * flicker.changed);
}

nlohmann::json to_json(const Flicker& flicker) {
  if (flicker.steps == 0) return {};
  return {{"mean", flicker.mean}, {"worst", flicker.worst}, {"changed", flicker.changed}};
}

/// A morph of fewer steps leaves the rest of a longer one. Nothing removes them.
void warn_of_further_steps(const MorphArguments& arguments, Session& session) {
  const std::filesystem::path next = step_file(arguments.output, arguments.options.steps + 1);
  std::error_code ignored;
  if (!std::filesystem::exists(next, ignored)) return;
  session.console.warn(fmt::format(
      "'{}' and those after it are of a morph of more steps; remove them, or they become part of "
      "what is made of this folder",
      next.string()));
}

int run_morph(const MorphArguments& arguments, const Plan& /*plan*/, Session& session) {
  const Map from = session.read_map(arguments.from);
  const Map to = session.read_map(arguments.to);
  const Device device = session.open_device(arguments.device);
  const ProgressMonitor monitor = session.monitor();
  const Morph morph(device, from, to, monitor);
  if (from.frame.up && to.frame.up && *from.frame.up != *to.frame.up) {
    session.console.warn(fmt::format(
        "{} is up in '{}' and {} in '{}', so that one of them lies on its side",
        to_string(*from.frame.up), arguments.from, to_string(*to.frame.up), arguments.to));
  }
  base::make_folder(arguments.output);
  warn_of_further_steps(arguments, session);
  const int steps = arguments.options.steps;
  const auto write = [&](Map map, int step) {
    add_job(map, session.job());
    write_map(map, step_file(arguments.output, step));
    session.written_so_far =
        fmt::format("{} of {} maps are in '{}'", step, steps, arguments.output);
  };
  const Flicker flicker = make_steps(device, morph, arguments.options, write, monitor);
  session.report_kernels(device);
  const MorphPairs& pairs = morph.pairs();
  std::string text = fmt::format("{} maps, {:.1f} s", steps, session.seconds());
  if (pairs.matched > 0) {
    text += fmt::format("\n{} factors move, {} appear, {} vanish", pairs.matched, pairs.appearing,
                        pairs.vanishing);
  }
  if (arguments.options.flicker_cells > 0) text += "\n" + flicker_text(flicker);
  const std::string first = step_file(arguments.output, 1).string();
  session.console.summary(fmt::format("{}\nmaps: {} and on", text, first),
                          {{"folder", arguments.output},
                           {"steps", steps},
                           {"factors",
                            {{"matched", pairs.matched},
                             {"appearing", pairs.appearing},
                             {"vanishing", pairs.vanishing}}},
                           {"flicker", to_json(flicker)},
                           {"seconds", session.seconds()}});
  return kDone;
}

void describe_morph(Command command, MorphArguments& a) {
  command.input("FROM", a.from, "Map of the first step, of 'qjulia fit' or 'qjulia shape'")
      .offers_files(readable({base::FileContent::map}));
  command.input("TO", a.to, "Map of the last step's shape, made by the same command")
      .offers_files(readable({base::FileContent::map}));
  command.output(a.output, "FOLDER", "Folder to write step_0001.qjulia.json and on into")
      .offers_folders();
  add_settings(command, morph_settings(), a.options);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_morph(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"morph", "Make the maps between two maps", R"(Examples:
  qjulia morph bunny.qjulia.json spot.qjulia.json -o morph
  qjulia morph bunny.qjulia.json spot.qjulia.json -o morph --steps 120
Shape, detail and grooves go from the first map to the second without a jump. Factors of fitted maps
are paired so that little is moved, and exponents are fitted to the potential in between; exact maps
blend their distances. The maps stay in the first one's order of factors, so that the last one has
the second one's shape with other grooves. Give both maps about the same detail, unless detail is to
change too.)",
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_morph, plan_morph, run_morph);
}

}  // namespace qjulia::tools

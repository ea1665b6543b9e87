/// qjulia film sheet: a script in, small pictures of the whole film on one sheet out.

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "commands/film_commands.hpp"
#include "commands/film_script.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "jobs/picture_series.hpp"
#include "jobs/picture_sweep.hpp"

namespace qjulia::tools {
namespace {

struct SheetArguments {
  std::string script;
  OutputName output;
  TrustedDevice device;
  double seconds = 0;
  int pictures = 12;
};

ScriptPlan plan_sheet(const SheetArguments& arguments) {
  return script_plan(arguments.script, arguments.seconds,
                     output_named("--output", arguments.output, {".png"}));
}

int run_sheet(const SheetArguments& arguments, const ScriptPlan& plan, Session& session) {
  constexpr int kWidest = 320;  // pixels
  const Device device = session.open_device(arguments.device);
  const FilmScript script = with_maps(plan.script, device, session);
  View base = script.base();
  const int reduction = (base.picture.width + kWidest - 1) / kWidest;
  base.picture.width = std::max(1, base.picture.width / reduction);
  base.picture.height = std::max(1, base.picture.height / reduction);
  const std::vector<View> all = script.views(base);
  const std::size_t count =
      std::min(script.pictures(), static_cast<std::size_t>(arguments.pictures));
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < count; ++i) {
    numbers.push_back(count == 1 ? 0 : i * (all.size() - 1) / (count - 1));
  }
  Scene scene = read_scene(script.input, session);
  PictureSeries series(device, std::move(scene), script.input, all, session.job(), session);
  std::vector<Image> images;
  for (const std::size_t number : numbers) {
    const auto made =
        series.picture(number, base, false, part_monitor(session, images.size(), count));
    images.push_back(
        captioned(made.image, fmt::format("{:.2f} s", static_cast<double>(number) / script.rate)));
  }
  const int columns = sheet_columns(static_cast<int>(count));
  write_picture(contact_sheet(images, columns), arguments.output.path, made_with(session.job()));
  session.report_kernels(device);
  session.console.summary(fmt::format("{} of {} pictures, {:.1f} s\nsheet: {}", count,
                                      script.pictures(), session.seconds(), arguments.output.path),
                          {{"sheet", arguments.output.path},
                           {"pictures", count},
                           {"film_pictures", script.pictures()},
                           {"seconds", session.seconds()}});
  return kDone;
}

void describe_sheet(Command command, SheetArguments& a) {
  add_script(command, a.script);
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.script, ".sheet.png"); }, "SHEET",
          "Sheet to write: .png." + named_text("script", ".sheet.png"))
      .offers_files({".png"});
  add_seconds(command, a.seconds);
  command.add("--pictures", &a.pictures, "N", "How many pictures, evenly over the film")
      .range(1, 100);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_film_sheet(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"film sheet", "Look at all of a film on one sheet of small pictures", R"(Example:
  qjulia film sheet dive.toml -o dive.png
The pictures have the places, colours and light of the film's.)",
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_sheet, plan_sheet, run_sheet);
}

}  // namespace qjulia::tools

/// qjulia film: knobs and cameras that move.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "commands/film_commands.hpp"
#include "commands/film_templates.hpp"

namespace qjulia::tools {
namespace {

struct TemplateArguments {
  std::string name, output;
};

Plan plan_template(const TemplateArguments& arguments) {
  static_cast<void>(film_template(arguments.name));
  if (arguments.output.empty()) return {};
  return {{}, {{"--output", arguments.output, {".toml"}, false, true}}};
}

int run_template(const TemplateArguments& arguments, const Plan& /*plan*/, Session& session) {
  const std::string text = film_template(arguments.name);
  if (arguments.output.empty()) {
    session.console.result(text.substr(0, text.size() - 1), {{"script", text}});
    return kDone;
  }
  base::write_file(arguments.output, text);
  session.console.summary(fmt::format("script: {0}\nnext: qjulia film sheet {0}", arguments.output),
                          {{"script", arguments.output}});
  return kDone;
}

void describe_template(Command command, TemplateArguments& a) {
  command.input("NAME", a.name, fmt::format("One of {}", fmt::join(film_template_names(), ", ")))
      .offers(film_template_names());
  command
      .file("-o,--output", a.output, "SCRIPT",
            "Script to write, a new .toml file. Default: it is printed")
      .names_output()
      .offers_files({".toml"});
}

}  // namespace

void add_script(Command command, std::string& file) {
  command.input("SCRIPT", file, "What happens: a TOML file, as 'qjulia film template' writes it")
      .offers_files({".toml"});
}

void add_seconds(Command command, double& seconds) {
  command
      .add("--seconds", &seconds, "SECONDS",
           "The film's length in place of the script's: all keys are stretched. 0: the script's")
      .range(0.0, 86400.0);
}

void add_film_template(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"film template", "Write a commented script to begin with", R"(Example:
  qjulia film template dive -o dive.toml
The script names a map, bunny.qjulia.json, to be replaced by yours.)",
               /*can_trace=*/false},
              describe_template, plan_template, run_template);
}

void add_film(CommandLine& program, ChosenCommand& chosen) {
  program.add_group({"film",
                     "Make a film: knobs and cameras that move",
                     R"(Examples:
  qjulia film template turntable -o turntable.toml
  qjulia film sheet turntable.toml                  a look at all of it, within a minute
  qjulia film turntable.toml -o turntable.mp4       the same as 'film make'
See docs/guide/films.md.)",
                     "make",
                     {},
                     ".toml"});
  for (const auto add : {add_film_make, add_film_sheet, add_film_scene, add_film_template})
    add(program, chosen);
}

}  // namespace qjulia::tools

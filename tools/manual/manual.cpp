/// Writes what other programs read of the command line: manual pages, completions of shells, the
/// pages of commands and of the environment, and the options of all commands as JSON.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/output_file.hpp"
#include "commands/commands.hpp"
#include "pages.hpp"

namespace qjulia::manual {

std::string brief(const std::string& description) {
  std::string text = description.substr(0, description.find_first_of(":;"));
  text = text.substr(0, text.find(". "));
  if (const auto bracket = text.find(" ("); bracket != std::string::npos) text.resize(bracket);
  return text;
}

bool is_member(const CommandUsage& command) { return command.name.find(' ') != std::string::npos; }

const CommandUsage& usual_of(const ProgramUsage& program, const CommandUsage& command) {
  const std::string name = fmt::format("{} {}", command.name, command.usual);
  const auto found = std::ranges::find(program.commands, name, &CommandUsage::name);
  return found == program.commands.end() ? command : *found;
}

namespace {

ProgramUsage usage() {
  tools::CommandLine program(tools::kProgramDescription, "qjulia");
  tools::ChosenCommand chosen;
  tools::describe(program, chosen);
  return program.usage();
}

/// @param folder of the build, which need not exist.
void write(const std::filesystem::path& folder, const std::string& date) {
  const ProgramUsage program = usage();
  std::filesystem::create_directories(folder);
  base::write_file(folder / "qjulia.1", program_page(program, date));
  for (const CommandUsage& command : program.commands) {
    base::write_file(folder / (page_name(command) + ".1"), command_page(program, command, date));
  }
  base::write_file(folder / "qjulia.bash", bash_completion(program));
  base::write_file(folder / "_qjulia", zsh_completion(program));
  base::write_file(folder / "qjulia.fish", fish_completion(program));
}

/// Names, letters, values and, of settings, an example of every command's options and arguments.
nlohmann::ordered_json options_json(const ProgramUsage& program) {
  nlohmann::ordered_json all;
  for (const CommandUsage& command : program.commands) {
    if (command.is_group()) continue;
    for (const OptionUsage& option : command.options) {
      all[command.name].push_back({{"name", option.name},
                                   {"letter", option.letter},
                                   {"values", option.values},
                                   {"is_positional", option.is_positional}});
      if (option.example) all[command.name].back()["example"] = *option.example;
    }
  }
  return all;
}

}  // namespace
}  // namespace qjulia::manual

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "";
  try {
    if (what == "environment" && argc == 2) {
      fmt::print("{}", qjulia::manual::environment_page());
      return 0;
    }
    if (what == "commands" && argc == 2) {
      fmt::print("{}", qjulia::manual::commands_page(qjulia::manual::usage()));
      return 0;
    }
    if (what == "options" && argc == 2) {
      fmt::print("{}\n", qjulia::manual::options_json(qjulia::manual::usage()).dump(1));
      return 0;
    }
    if (what == "write" && argc == 4) {
      qjulia::manual::write(argv[2], argv[3]);
      return 0;
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "qjulia_manual: {}\n", error.what());
    return 1;
  }
  fmt::print(stderr, "usage: qjulia_manual environment | commands | options | write FOLDER DATE\n");
  return 2;
}

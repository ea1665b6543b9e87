#include <fmt/format.h>
#include <fmt/ranges.h>

#include "console/failure.hpp"
#include "pages.hpp"

namespace qjulia::manual {
namespace {

/// Text of a cell: on one line, and without the character that parts cells.
std::string cell(const std::string& text) {
  std::string result;
  for (const char character : text) {
    if (character == '|' || character == '<' || character == '*' || character == '_')
      result += '\\';
    result += character == '\n' ? ' ' : character;
  }
  return result;
}

/// "`-o`, `--output MAP`"
std::string spelling(const OptionUsage& option) {
  std::string text = option.name;
  if (!option.values.empty() && !option.is_positional) {
    // A table parts its cells at this character, in code as well.
    for (const std::string& value : option.values) {
      text += ' ';
      for (const char character : value)
        text += character == '|' ? "\\|" : std::string(1, character);
    }
  }
  if (option.letter.empty()) return fmt::format("`{}`", text);
  return fmt::format("`{}`, `{}`", option.letter, text);
}

std::string option_rows(const std::vector<OptionUsage>& options) {
  std::string text;
  const std::string* group = nullptr;
  for (const OptionUsage& option : options) {
    if (!group || *group != option.group) {
      group = &option.group;
      text += fmt::format("\n**{}**\n\n| option | what it does | default |\n|---|---|---|\n",
                          group->empty() ? "Options" : *group);
    }
    text += fmt::format("| {} | {} | {} |\n", spelling(option), cell(option.description),
                        cell(option.default_text));
  }
  return text;
}

std::string footer_block(const CommandUsage& command) {
  std::string footer = command.footer;
  while (footer.ends_with('\n')) footer.pop_back();
  return footer.empty() ? "" : fmt::format("\n```text\n{}\n```\n", footer);
}

std::string section(const std::string& title, const CommandUsage& command) {
  return fmt::format("\n## {}\n\n{}\n", title, cell(command.description)) +
         option_rows(command.options) + footer_block(command);
}

std::string exit_code_table() {
  std::string text = "\n## Exit codes\n\n| code | meaning | when |\n|---|---|---|\n";
  for (const tools::ExitStatus& status : tools::exit_statuses()) {
    text += fmt::format("| {} | {} | {} |\n", static_cast<int>(status.code), status.meaning,
                        cell(status.details));
  }
  return text;
}

}  // namespace

std::string commands_page(const ProgramUsage& program) {
  std::string text =
      "# Command line\n\nEvery command with every option, as `qjulia COMMAND --help-all` and the "
      "manual pages "
      "have them. `cmake --build --preset release --target reference` makes this page from the "
      "program's own "
      "description.\n";
  text += section("qjulia", program.root);
  text += exit_code_table();
  for (const CommandUsage& command : program.commands) {
    if (command.is_group()) {
      text += fmt::format("\n## qjulia {}\n\n{}: one of the commands `{}`.\n", command.name,
                          cell(command.description), fmt::join(command.members, "`, `"));
      text += footer_block(command);
      continue;
    }
    text += section("qjulia " + command.name, command);
  }
  return text;
}

}  // namespace qjulia::manual

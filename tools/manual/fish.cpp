#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pages.hpp"

namespace qjulia::manual {
namespace {

std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    if (c == '\'' || c == '\\') out += '\\';
    out += c;
  }
  return out + "'";
}

/// " -xa ..." for a value of these; " -x" for one that nothing is offered for.
std::string fish_values(const Completion& completion) {
  std::vector<std::string> sources;
  if (completion.takes_files) {
    sources.push_back(fmt::format("(__qjulia_files {})", fmt::join(completion.extensions, " ")));
  }
  if (completion.takes_folders) sources.emplace_back("(__fish_complete_directories)");
  sources.insert(sources.end(), completion.words.begin(), completion.words.end());
  return sources.empty()
             ? " -x"
             : fmt::format(" -xa {}", quoted(fmt::format("{}", fmt::join(sources, " "))));
}

std::string fish_line(const std::string& condition, const OptionUsage& option) {
  std::string text = fmt::format("complete -c qjulia -n {}", quoted(condition));
  if (!option.is_positional) {
    text += " -l " + option.name.substr(2);
    if (!option.letter.empty()) text += " -s " + option.letter.substr(1);
  }
  if (option.is_positional || !option.values.empty()) text += fish_values(option.completion);
  return text + " -d " + quoted(option.is_positional ? option.name : brief(option.description)) +
         '\n';
}

}  // namespace

std::string fish_completion(const ProgramUsage& program) {
  std::string text = R"(# Completion of qjulia for fish. Generated; do not edit.

# Folders, and files that end in one of the arguments.
function __qjulia_files
    set -l pattern (string escape --style=regex -- $argv | string join '|')
    __fish_complete_path (commandline -ct | string replace -r -- '^--[a-z-]+=' '') |
        string match -r -- ".*(?:/|$pattern)(?:\t.*)?\$"
end

# Whether this is the command among the words so far.
function __qjulia_runs
    set -l words (commandline -opc)
    test "$words[2]" = $argv[1]
end

complete -c qjulia -f
)";
  const std::string none = "__fish_use_subcommand";
  for (const OptionUsage& option : program.root.options) text += fish_line(none, option);
  text += fmt::format("complete -c qjulia -n '{}' -a help -d 'Explain a command'\n", none);
  for (const CommandUsage& command : program.commands) {
    text += fmt::format("complete -c qjulia -n '{}' -a {} -d {}\n", none, command.name,
                        quoted(command.description));
    text += fmt::format("complete -c qjulia -n '__fish_seen_subcommand_from help' -a {} -d {}\n",
                        command.name, quoted(command.description));
  }
  for (const CommandUsage& command : program.commands) {
    const std::string condition = fmt::format("__qjulia_runs {}", command.name);
    for (const OptionUsage& option : command.options) text += fish_line(condition, option);
  }
  return text;
}

}  // namespace qjulia::manual

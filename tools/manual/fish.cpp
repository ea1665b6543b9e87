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

# Whether the words so far begin with those of this command.
function __qjulia_runs
    set -l words (commandline -opc)
    set -l last (math (count $argv) + 1)
    test (count $words) -ge $last; and test "$words[2..$last]" = "$argv"
end

# Whether the words so far name this group, and none of its commands.
function __qjulia_names_group
    set -l words (commandline -opc)
    test "$words[2]" = $argv[1]; and not string match -qr '^[^-]' -- "$words[3]"
end

complete -c qjulia -f
)";
  const std::string none = "__fish_use_subcommand";
  for (const OptionUsage& option : program.root.options) text += fish_line(none, option);
  text += fmt::format("complete -c qjulia -n '{}' -a help -d 'Explain a command'\n", none);
  const auto offer = [&](const std::string& condition, const CommandUsage& command) {
    const std::string word = command.name.substr(command.name.rfind(' ') + 1);
    text += fmt::format("complete -c qjulia -n '{}' -a {} -d {}\n", condition, word,
                        quoted(command.description));
  };
  for (const CommandUsage& command : program.commands) {
    if (is_member(command)) {
      const std::string group = command.name.substr(0, command.name.find(' '));
      offer("__qjulia_names_group " + group, command);
      offer("__qjulia_runs help " + group, command);
    } else {
      offer(none, command);
      offer("test (count (commandline -opc)) = 2; and __qjulia_runs help", command);
    }
  }
  for (const CommandUsage& command : program.commands) {
    const std::string condition = fmt::format(
        "{} {}", command.is_group() ? "__qjulia_names_group" : "__qjulia_runs", command.name);
    for (const OptionUsage& option : usual_of(program, command).options) {
      text += fish_line(condition, option);
    }
  }
  return text;
}

}  // namespace qjulia::manual

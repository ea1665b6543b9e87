#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <stdexcept>

#include "pages.hpp"

namespace qjulia::manual {
namespace {

/// What walks the words before the cursor, with the number of values of every option.
constexpr const char* kWalk = R"(
# Folders, and files that end in one of the arguments; all files where there are none.
_qjulia_files() {
  local extension
  compopt -o filenames 2>/dev/null
  mapfile -t COMPREPLY < <(
    compgen -d -- "$cur"
    (($# > 0)) || compgen -f -- "$cur"
    for extension; do compgen -f -X "!*$extension" -- "$cur"; done
  )
}

_qjulia_words() { mapfile -t -O "${#COMPREPLY[@]}" COMPREPLY < <(compgen -W "$*" -- "$cur"); }

_qjulia() {
  local cur=${COMP_WORDS[COMP_CWORD]} word option= command= members= left=0 position=0 i
  COMPREPLY=()
  # Where '=' parts words, --up=x is three of them.
  [[ $cur != = ]] || cur=
  for ((i = 1; i < COMP_CWORD; i++)); do
    word=${COMP_WORDS[i]}
    if [[ $word == = ]]; then
      :
    elif ((left > 0)); then
      ((left--)) || :
    elif [[ $word == -* ]]; then
      option=$word
      _qjulia_values "$word"
    elif _qjulia_members "$command"; [[ $members ]]; then
      command=${command:+$command }$word
    else
      ((position++)) || :
    fi
  done
  _qjulia_members "$command"
  if ((left > 0)); then
    _qjulia_value "$command:$option"
  elif [[ $cur == -* ]]; then
    _qjulia_options "$command"
  elif [[ $members ]]; then
    _qjulia_words "$members"
  else
    _qjulia_argument "$command:$position"
  fi
} && complete -F _qjulia qjulia
)";

/// The shell's words that offer what completes a value; ":" for nothing.
std::string bash_action(const Completion& completion) {
  std::string text;
  if (completion.takes_files)
    text = fmt::format("_qjulia_files {}", fmt::join(completion.extensions, " "));
  if (completion.takes_folders)
    text = "compopt -o filenames 2>/dev/null; mapfile -t COMPREPLY < <(compgen -d -- \"$cur\")";
  if (!completion.words.empty()) {
    text += fmt::format("{}_qjulia_words {}", text.empty() ? "" : "; ",
                        fmt::join(completion.words, " "));
  }
  return text.empty() ? ":" : text;
}

/// A function that acts by its argument.
std::string choice(const std::string& name, const std::map<std::string, std::string>& patterns_of,
                   const std::string& otherwise = {}) {
  std::string text = fmt::format("\n{}() {{\n  case $1 in\n", name);
  for (const auto& [act, patterns] : patterns_of) {
    text += fmt::format("    {}) {} ;;\n", patterns, act);
  }
  if (!otherwise.empty()) text += fmt::format("    *) {} ;;\n", otherwise);
  return text + "  esac\n}\n";
}

/// A pattern that stands for these words.
std::string pattern_of(const std::string& words) {
  std::string text;
  for (const char c : words) text += c == ' ' ? "\\ " : std::string(1, c);
  return text;
}

class Patterns {
 public:
  void add(const std::string& act, const std::string& pattern) {
    if (act == ":") return;
    std::string& all = patterns_[act];
    all += (all.empty() ? "" : "|") + pattern;
  }
  const std::map<std::string, std::string>& all() const { return patterns_; }

 private:
  std::map<std::string, std::string> patterns_;
};

std::vector<std::string> names_of(const OptionUsage& option) {
  return option.letter.empty() ? std::vector{option.name} : std::vector{option.letter, option.name};
}

/// How many values each option takes, whatever the command. @throws std::logic_error where two
/// commands do not agree.
std::string counts(const ProgramUsage& program) {
  std::map<std::string, std::size_t> count_of;
  for (const CommandUsage& command : program.commands) {
    for (const OptionUsage& option : command.options) {
      if (option.is_positional) continue;
      for (const std::string& name : names_of(option)) {
        const auto [known, added] = count_of.try_emplace(name, option.values.size());
        if (!added && known->second != option.values.size()) {
          throw std::logic_error(name + " takes more values in one command than in another");
        }
      }
    }
  }
  Patterns patterns;
  for (const auto& [name, count] : count_of) {
    if (count > 0) patterns.add(fmt::format("left={}", count), name);
  }
  return choice("_qjulia_values", patterns.all());
}

}  // namespace

std::string bash_completion(const ProgramUsage& program) {
  Patterns options, values, arguments, members;
  std::vector<std::string> commands{"help"};
  const auto add_options = [&](const CommandUsage& command, const std::string& name) {
    std::vector<std::string> names;
    for (const OptionUsage& option : command.options) {
      if (!option.is_positional) names.push_back(option.name);
    }
    options.add(fmt::format("_qjulia_words {}", fmt::join(names, " ")), name);
  };
  const auto add_command = [&](const CommandUsage& command, const std::string& name) {
    add_options(command, name);
    int position = 0;
    for (const OptionUsage& option : command.options) {
      const std::string act = bash_action(option.completion);
      if (option.is_positional) {
        arguments.add(act, fmt::format("{}:{}", name, position++));
        continue;
      }
      for (const std::string& spelt : names_of(option)) {
        values.add(act, fmt::format("{}:{}", name, spelt));
      }
    }
  };
  add_options(program.root, "''");
  for (const CommandUsage& command : program.commands) {
    if (!is_member(command)) commands.push_back(command.name);
    if (command.is_group()) {
      members.add(fmt::format("members='{}'", fmt::join(command.members, " ")),
                  fmt::format("{0}|help\\ {0}", command.name));
    }
    add_command(usual_of(program, command), pattern_of(command.name));
  }
  members.add(fmt::format("members='{}'", fmt::join(commands, " ")), "''|help");
  return "# Completion of qjulia for bash. Generated; do not edit.\n" + counts(program) +
         choice("_qjulia_members", members.all(), "members=") +
         choice("_qjulia_options", options.all()) + choice("_qjulia_value", values.all()) +
         choice("_qjulia_argument", arguments.all()) + kWalk;
}

}  // namespace qjulia::manual

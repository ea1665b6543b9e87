#include <fmt/format.h>
#include <fmt/ranges.h>

#include "pages.hpp"

namespace qjulia::manual {
namespace {

/// For a place within single quotes where colons and brackets have a meaning.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\'') {
      out += "'\\''";
    } else {
      if (c == ':' || c == '[' || c == ']' || c == '\\') out += '\\';
      out += c;
    }
  }
  return out;
}

std::string files_action(const std::vector<std::string>& extensions) {
  if (extensions.empty()) return "_files";
  std::string globs;
  for (const std::string& extension : extensions) globs += (globs.empty() ? "*" : " *") + extension;
  return fmt::format("_files -g \"{}\"", globs);
}

std::string zsh_action(const Completion& completion) {
  const std::string files = completion.takes_folders ? "_files -/"
                            : completion.takes_files ? files_action(completion.extensions)
                                                     : "";
  if (completion.words.empty()) return files.empty() ? " " : files;
  std::vector<std::string> words;
  for (const std::string& word : completion.words) words.push_back(escaped(word));
  return files.empty() ? fmt::format("({})", fmt::join(words, " "))
                       : fmt::format("{{compadd -- {}; {}}}", fmt::join(words, " "), files);
}

/// What _arguments takes for one option.
std::string specification(const OptionUsage& option) {
  const std::string act = zsh_action(option.completion);
  if (option.is_positional) {
    return fmt::format("'{}:{}:{}'", option.is_required ? "" : ":", escaped(option.name), act);
  }
  std::string values;
  for (const std::string& value : option.values)
    values += fmt::format(":{}:{}", escaped(value), act);
  const std::string text = fmt::format("[{}]{}", escaped(brief(option.description)), values);
  const char* assigned = option.values.size() == 1 ? "=" : "";
  if (option.letter.empty()) {
    return fmt::format("'{}{}{}{}'", option.is_repeated ? "*" : "", option.name, assigned, text);
  }
  return fmt::format("'({0} {1})'{{{0},{1}{2}}}'{3}'", option.letter, option.name, assigned, text);
}

std::string arguments(const CommandUsage& command, const std::string& indent) {
  std::string text = "_arguments -S";
  for (const OptionUsage& option : command.options) {
    text += " \\\n" + indent + specification(option);
  }
  return text;
}

/// The last word of a command's name.
std::string last_word(const CommandUsage& command) {
  return command.name.substr(command.name.rfind(' ') + 1);
}

/// An entry of an array for _describe.
std::string described(const CommandUsage& command, const std::string& indent) {
  return fmt::format("{}'{}:{}'\n", indent, last_word(command), escaped(command.description));
}

std::string branch(const CommandUsage& command, const std::string& indent) {
  return fmt::format("{0}{1})\n{0}  {2} ;;\n", indent, last_word(command),
                     arguments(command, indent + "    "));
}

/// Offers the commands of a group, or what follows one of them.
std::string group_branch(const ProgramUsage& program, const CommandUsage& group) {
  std::string names, cases;
  for (const CommandUsage& command : program.commands) {
    if (!command.name.starts_with(group.name + ' ')) continue;
    names += described(command, "            ");
    cases += branch(command, "            ");
  }
  const std::string usual =
      group.usual.empty() ? ""
                          : "            *)\n              " +
                                arguments(usual_of(program, group), "                ") + " ;;\n";
  return fmt::format(R"(        {})
          commands=(
{}          )
          if ((CURRENT == 2)) && [[ $words[2] != -* ]]; then
            _describe -t commands command commands
            return
          fi
          [[ $words[2] == -* ]] || {{ shift words; ((CURRENT--)) }}
          case $words[1] in
{}{}          esac ;;
)",
                     group.name, names, cases, usual);
}

}  // namespace

std::string zsh_completion(const ProgramUsage& program) {
  std::string names = "    'help:Explain a command'\n", cases;
  for (const CommandUsage& command : program.commands) {
    if (is_member(command)) continue;
    names += described(command, "    ");
    cases += command.is_group() ? group_branch(program, command) : branch(command, "        ");
  }
  return fmt::format(R"(#compdef qjulia
# Completion of qjulia for zsh. Generated; do not edit.

_qjulia() {{
  local curcontext="$curcontext" state line
  typeset -A opt_args
  local -a commands
  commands=(
{}  )
  {} \
    '1: :->command' \
    '*:: :->argument' && return
  case $state in
    command) _describe -t commands command commands ;;
    argument)
      case $words[1] in
        help) _describe -t commands command commands ;;
{}      esac ;;
  esac
}}

_qjulia "$@"
)",
                     names, "_arguments -C" + arguments(program.root, "    ").substr(13), cases);
}

}  // namespace qjulia::manual

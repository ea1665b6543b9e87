#include <fmt/format.h>

#include <algorithm>

#include "base/text.hpp"
#include "console/failure.hpp"
#include "environment.hpp"
#include "pages.hpp"
#include "qjulia/base/version.hpp"
#include "roff.hpp"

namespace qjulia::manual {
namespace {

constexpr const char* kFirstGroup = "Options";

/// The help's text below its options, parted: what it explains, and its examples.
struct Footer {
  std::string explanation;  ///< roff
  std::string examples;     ///< roff; empty: none
};

bool announces_examples(const std::string& line) {
  return line == "Example:" || line == "Examples:" || line == "First steps:";
}

/// Joins lines of prose to paragraphs, and keeps indented ones as they stand.
class FooterReader {
 public:
  void read(const std::string& line) {
    if (line.starts_with("  ")) {
      finish_prose();
      block_ += (block_.empty() ? "" : "\n") + line.substr(2);
    } else if (announces_examples(line)) {
      finish();
      are_examples_ = true;
    } else {
      finish_block();
      // A line that leads to a block stands alone, and so does the line of the codes.
      prose_ += (prose_.empty() ? "" : " ") + line;
      if (line.empty() || line.ends_with(':')) finish_prose();
    }
  }
  Footer result() {
    finish();
    return footer_;
  }

 private:
  void finish() {
    finish_prose();
    finish_block();
  }
  void finish_prose() {
    if (!prose_.empty()) footer_.explanation += ".PP\n" + roff_paragraph(prose_);
    prose_.clear();
  }
  void finish_block() {
    if (!block_.empty()) {
      (are_examples_ ? footer_.examples : footer_.explanation) += roff_block(block_);
    }
    block_.clear();
    are_examples_ = false;
  }

  Footer footer_;
  std::string prose_, block_;
  bool are_examples_ = false;
};

/// Without the line of exit codes, which has a section of its own.
Footer parted(const std::string& text) {
  FooterReader reader;
  for (const std::string& line : base::split(text, '\n')) {
    if (!line.starts_with("Exit codes: ")) reader.read(line);
  }
  return reader.result();
}

std::string section(const std::string& title, const std::string& text) {
  return text.empty() ? "" : ".SH " + title + '\n' + text;
}

std::string beginning(const std::string& name, const std::string& date) {
  std::string title = name;
  std::ranges::transform(title, title.begin(),
                         [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return fmt::format(
      ".\\\" Generated; do not edit.\n.TH {} 1 \"{}\" \"qjulia {}\" \"User Commands\"\n",
      roff(title), date, version());
}

std::string values_of(const OptionUsage& option) {
  std::string text;
  for (const std::string& value : option.values) text += ' ' + italic(value);
  return text;
}

std::string entry(const OptionUsage& option) {
  std::string tag = option.letter.empty() ? "" : bold(option.letter) + ", ";
  tag += option.is_positional ? italic(option.name) : bold(option.name) + values_of(option);
  std::string text = option.description;
  if (!text.ends_with('.')) text += '.';
  if (!option.default_text.empty()) text += fmt::format(" Default: {}.", option.default_text);
  if (option.is_required && !option.is_positional) text += " It must be given.";
  return ".TP\n" + tag + '\n' + roff_paragraph(text);
}

/// Positional arguments, then options in the groups of the help.
std::string options_of(const CommandUsage& command) {
  std::string positional, first, rest;
  std::vector<std::string> groups;
  for (const OptionUsage& option : command.options) {
    if (option.is_positional) {
      positional += entry(option);
    } else if (option.group == kFirstGroup) {
      first += entry(option);
    } else if (std::ranges::find(groups, option.group) == groups.end()) {
      groups.push_back(option.group);
    }
  }
  for (const std::string& group : groups) {
    rest += ".SS " + roff(group) + '\n';
    for (const OptionUsage& option : command.options) {
      if (!option.is_positional && option.group == group) rest += entry(option);
    }
  }
  return positional + first + rest;
}

std::string synopsis(const CommandUsage& command) {
  std::string text = bold("qjulia " + command.name);
  if (command.is_group()) {
    text += command.usual.empty() ? ' ' + italic("command") : " [" + italic("command") + ']';
  }
  for (const OptionUsage& option : command.options) {
    if (!option.is_positional) continue;
    text += option.is_required ? ' ' + italic(option.name) : " [" + italic(option.name) + ']';
  }
  for (const OptionUsage& option : command.options) {
    if (option.is_positional || !option.is_required) continue;
    text += ' ' + bold(option.letter.empty() ? option.name : option.letter) + values_of(option);
  }
  return text + " [" + italic("options") + "]\n";
}

std::string exit_status() {
  std::string text;
  for (const tools::ExitStatus& status : tools::exit_statuses()) {
    text += fmt::format(".TP\n{}\n{}", bold(std::to_string(status.code)),
                        roff_paragraph(fmt::format("{}. {}", status.meaning, status.details)));
  }
  return text;
}

/// @param command empty: those about any.
std::string entries(std::span<const Entry> all, const CommandUsage* command) {
  std::string text;
  for (const Entry& entry : all) {
    if (command != nullptr && !is_about(entry, *command)) continue;
    text += ".TP\n" + bold(entry.name) + '\n' + roff_paragraph(entry.text);
  }
  return text;
}

std::string see_also(const std::vector<std::string>& pages) {
  std::string text;
  for (const std::string& page : pages) {
    text += fmt::format(".BR {} (1){}\n", roff(page), &page == &pages.back() ? "" : ",");
  }
  return text;
}

/// The commands of the program or of a group, as entries.
std::string commands_of(const ProgramUsage& program, const std::string& group) {
  std::string text;
  for (const CommandUsage& command : program.commands) {
    const bool is_listed =
        group.empty() ? !is_member(command) : command.name.starts_with(group + ' ');
    if (!is_listed) continue;
    text += ".TP\n" + bold(command.name) + '\n' +
            roff_paragraph(fmt::format("{}; see {}(1).", command.description, page_name(command)));
  }
  return text;
}

}  // namespace

std::string page_name(const CommandUsage& command) {
  std::string name = "qjulia-" + command.name;
  std::ranges::replace(name, ' ', '-');
  return name;
}

std::string program_page(const ProgramUsage& program, const std::string& date) {
  const Footer footer = parted(program.root.footer);
  std::vector<std::string> pages;
  for (const CommandUsage& command : program.commands) pages.push_back(page_name(command));
  std::string description = program.root.description;
  std::ranges::replace(description, '\n', ' ');
  return beginning("qjulia", date) +
         section("NAME", "qjulia \\- fits iterated quaternion rational maps to shapes\n") +
         section("SYNOPSIS", bold("qjulia") + ' ' + italic("command") + " [" + italic("options") +
                                 "]\n.br\n" + bold("qjulia help") + " [" + italic("command") +
                                 "]\n") +
         section("DESCRIPTION", roff_paragraph(description) + footer.explanation) +
         section("COMMANDS", commands_of(program, "")) +
         section("OPTIONS", options_of(program.root)) + section("EXAMPLES", footer.examples) +
         section("ENVIRONMENT", entries(environment(), nullptr)) +
         section("EXIT STATUS", exit_status()) + section("FILES", entries(files(), nullptr)) +
         section("SEE ALSO", see_also(pages));
}

std::string command_page(const ProgramUsage& program, const CommandUsage& command,
                         const std::string& date) {
  const Footer footer = parted(command.footer);
  std::vector<std::string> pages{"qjulia"};
  for (const CommandUsage& other : program.commands) {
    if (other.name != command.name) pages.push_back(page_name(other));
  }
  std::string what = command.description;
  what[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(what[0])));
  return beginning(page_name(command), date) +
         section("NAME", roff(page_name(command)) + " \\- " + roff(what) + '\n') +
         section("SYNOPSIS", synopsis(command)) +
         section("DESCRIPTION", roff_paragraph(command.description + '.') + footer.explanation) +
         (command.is_group() ? section("COMMANDS", commands_of(program, command.name)) : "") +
         section("OPTIONS", options_of(command)) + section("EXAMPLES", footer.examples) +
         section("ENVIRONMENT", entries(environment(), &command)) +
         section("EXIT STATUS", exit_status()) + section("FILES", entries(files(), &command)) +
         section("SEE ALSO", see_also(pages));
}

}  // namespace qjulia::manual

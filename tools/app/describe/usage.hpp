#pragma once
/// What a command line takes, as data: help, manual pages and shells' completions say the same.

#include <optional>
#include <string>
#include <vector>

namespace qjulia::tools {

/// What a shell offers for a value.
struct Completion {
  std::vector<std::string> words{};       ///< of which one is given, or may be
  std::vector<std::string> extensions{};  ///< of files, as in ".obj"
  bool takes_files = false;               ///< of any name where there are no extensions
  bool takes_folders = false;

  bool operator==(const Completion&) const = default;
};

/// An option or a positional argument.
struct OptionUsage {
  std::string letter;               ///< "-o"; empty: none
  std::string name;                 ///< "--output"; of a positional argument "MESH"
  std::vector<std::string> values;  ///< what the help calls them; empty for a flag
  std::string description;
  std::string default_text;            ///< empty: none that the description does not say
  std::optional<std::string> example;  ///< words that may be given, of settings
  std::string group;                   ///< its title in the help
  bool is_positional = false;
  bool is_required = false;
  bool is_repeated = false;
  bool takes_numbers = false;  ///< and nothing else
  bool is_in_job = true;       ///< it says what is made, not how the command runs
  bool is_output = false;      ///< it names the file that is made
  Completion completion;
};

/// A command, or a group of commands, which does nothing itself.
struct CommandUsage {
  std::string name;  ///< its words, such as "profile compare"
  std::string description;
  std::string footer;
  std::vector<OptionUsage> options;       ///< in the help's order
  std::vector<std::string> members = {};  ///< of a group: the last words of its commands
  std::string usual = {};  ///< of a group: the member that is meant where none is named

  bool is_group() const { return !members.empty(); }

  /// "--device": whether it is one of the options.
  bool has(const std::string& option) const;
};

struct ProgramUsage {
  CommandUsage root;
  std::vector<CommandUsage> commands;  ///< a group stands before its commands
};

}  // namespace qjulia::tools

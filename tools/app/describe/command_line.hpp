#pragma once
/// Commands, their options and their help. CLI11 reads the words; values are read here, strictly: a
/// number that is empty, not finite or too large for its type is refused, never replaced.

#include <concepts>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "describe/job.hpp"
#include "describe/usage.hpp"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace qjulia::tools {

/// @throws InputError for what is not a finite number.
double finite_number(const std::string& word);
int whole_number(const std::string& word);

/// Where a value goes. An optional one stays empty unless the option is given; the others show
/// their value as the default.
using Target = std::variant<std::string*, int*, std::uint64_t*, double*, std::optional<int>*,
                            std::optional<std::uint64_t>*, std::optional<double>*>;
/// @throws InputError for a word that is no such value.
void read_value(const std::string& word, const Target& target);

/// A group of commands, such as "profile", whose commands have two words.
struct CommandGroup {
  std::string name;
  std::string description;
  std::string footer;
  std::string usual = {};  ///< the command that is meant where none is named; empty: none is
  /// Options that were commands' forerunners, with what stands in their place: {"--tune", "tune"}.
  std::map<std::string, std::string> replaced = {};
  /// Where it is not empty, a word that ends so stands for the usual command's input.
  std::string usual_input = {};
};

/// What CLI11 has no place for.
struct CommandNotes {
  std::map<const CLI::App*, CommandGroup> groups;

  std::map<const CLI::Option*, std::string> examples;
  std::map<const CLI::Option*, Completion> completions;
  std::set<const CLI::Option*> numbers, repeated, not_in_jobs, outputs;
  /// What happens to a command that was typed, before it is run.
  std::map<const CLI::App*, std::vector<std::function<void()>>> once_chosen;
};

/// The file that a command writes.
struct OutputName {
  std::string path;
  bool must_be_new = false;  ///< nobody named it: it is named after an input
};

/// One option or positional argument of a command. A handle: copies are the same option.
class Option {
 public:
  /// Values outside are refused.
  Option range(double low, double high) const;
  /// Its place in the help; empty: it is not shown, since only the program itself gives it.
  Option group(const std::string& title) const;
  Option excludes(std::initializer_list<Option> others) const;
  /// Without `other` it would do nothing, and is refused.
  Option needs(const Option& other) const;
  /// It must be given.
  Option required() const;
  /// The value that holds without it, as the help shows it.
  Option default_text(const std::string& text) const;

  /// Words that may be given, for tests.
  Option example(const std::string& words) const;

  /// It says how a command runs, not what it makes: it is no part of a job.
  Option not_in_job() const;
  /// It names the file that the command makes.
  Option names_output() const;

  /// What shells offer for its value: these words, files that end so (or any file), folders.
  Option offers(const std::vector<std::string>& words) const;
  Option offers_files(const std::vector<std::string>& extensions = {}) const;
  Option offers_folders() const;

  /// "--detail".
  std::string name() const;
  bool given() const;

 private:
  friend class Command;
  Option(CLI::Option* option, CommandNotes* notes) : option_(option), notes_(notes) {}
  CLI::Option* option_;
  CommandNotes* notes_;
};

/// A command to describe. A handle: copies are the same command. Targets must outlive the parsing.
/// @param names such as "-o,--output"; without dashes it is positional.
/// @param type the words for its values in the help; empty: none.
class Command {
 public:
  Option add(const std::string& names, Target target, const std::string& type,
             const std::string& description) const;
  /// The name of a file or folder: not empty.
  Option file(const std::string& names, std::string& target, const std::string& type,
              const std::string& description) const;
  /// A file that is always given, by its place: mostly the one that a command reads.
  Option input(const std::string& name, std::string& target, const std::string& description) const;
  /// -o, the file that it writes: always given.
  Option output(std::string& target, const std::string& type, const std::string& description) const;
  /// -o where it may be left out. @param named says what the file is called then, once all
  /// options are read; such a file must be new.
  Option output(const std::string& names, OutputName& target, std::function<std::string()> named,
                const std::string& type, const std::string& description) const;
  /// Given, it makes `target` what it was not.
  Option flag(const std::string& names, bool& target, const std::string& description) const;
  /// A word that `take` reads. @param take throws InputError saying what is wrong with it.
  Option word(const std::string& names, const std::string& type,
              std::function<void(const std::string&)> take, const std::string& description) const;
  /// The same for any number of words, one after the other.
  Option words(const std::string& names, std::function<void(const std::string&)> take,
               const std::string& description) const;
  /// An option of as many finite numbers as `type` has words. @param take as above.
  Option numbers(const std::string& names, const std::string& type,
                 std::function<void(const std::vector<double>&)> take,
                 const std::string& description) const;
  /// The same as often as the option is given, `most` times at most.
  Option repeated_numbers(const std::string& names, const std::string& type, int most,
                          std::function<void(const std::vector<double>&)> take,
                          const std::string& description) const;
  /// An option of one word that may be given up to `most` times. @param take gets all of them.
  Option repeated_word(const std::string& names, const std::string& type, int most,
                       std::function<void(const std::vector<std::string>&)> take,
                       const std::string& description) const;
  /// What stands below the options in the help.
  void footer(const std::string& text) const;
  /// Called when this is the command that was typed, after its options are read.
  void on_chosen(std::function<void()> call) const;
  /// What was typed, as data.
  Job job() const;

 private:
  friend class CommandLine;
  Command(CLI::App* app, CommandNotes* notes) : app_(app), notes_(notes) {}
  CLI::App* app_;
  CommandNotes* notes_;
};

/// A program with its commands, or options alone.
class CommandLine {
 public:
  explicit CommandLine(const std::string& description = {}, const std::string& name = {});
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  /// The program's own options.
  Command root() const;
  void add_group(const CommandGroup& group);
  /// @param name one word, or those of a group and of one of its commands.
  Command add_command(const std::string& name, const std::string& description);
  /// Adds --version. @param text is asked for only where the option is given: it may load
  /// libraries.
  void version(std::function<std::string()> text);
  std::string help() const;
  /// All of it as data.
  ProgramUsage usage() const;

  /// Reads the program's arguments. @return an exit code when all is said (help, version) or
  /// nothing can be done (bad usage). @throws InputError naming an option whose value is no use.
  std::optional<int> parse(int argc, const char* const* argv);
  /// Reads the words of a file that spells options without their dashes. @throws InputError
  void parse(const std::vector<std::string>& words);

  bool has_option(const std::string& name) const;
  /// Whether this option, which it has, takes no value.
  bool is_flag(const std::string& name) const;
  /// Without their dashes, in order.
  std::vector<std::string> option_names() const;

 private:
  /// Adds the usual command of a group where none is named. @return the exit code of a group
  /// alone. @throws InputError where there is no such command or option, suggesting one.
  std::optional<int> find_command(std::vector<std::string>& words) const;

  std::unique_ptr<CLI::App> app_;
  std::unique_ptr<CommandNotes> notes_;
};

}  // namespace qjulia::tools

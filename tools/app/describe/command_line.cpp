#include "describe/command_line.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <numeric>
#include <sstream>

#include "base/text.hpp"
#include "console/console.hpp"
#include "console/failure.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

/// The words in lines of at most `columns` columns, each line beginning with `indent`.
std::string wrapped(const std::vector<std::string>& words, std::size_t columns,
                    const std::string& indent) {
  std::string text, line;
  for (const std::string& word : words) {
    if (!line.empty() && line.size() + 1 + word.size() > columns) {
      text += line + '\n';
      line.clear();
    }
    line += (line.empty() ? indent : " ") + word;
  }
  return text + line;
}

/// CLI11's help with descriptions broken into lines and examples first. --help lists options of
/// further groups by name alone; --help-all explains them.
class HelpFormat : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    return make_description(app) + make_usage(app, std::move(name)) + '\n' + make_footer(app) +
           make_positionals(app) + groups(app, mode) +
           make_subcommands(app, CLI::AppFormatMode::Normal);
  }

  std::string make_option_desc(const CLI::Option* option) const override {
    std::istringstream stream(CLI::Formatter::make_option_desc(option));
    stream.exceptions(std::ios::badbit);
    return wrapped({std::istream_iterator<std::string>(stream), {}}, 64, "");
  }

 private:
  static constexpr const char* kFirstGroup = "Options";

  std::string groups(const CLI::App* app, CLI::AppFormatMode mode) const {
    std::string text;
    for (const std::string& group : app->get_groups()) {
      const auto options = app->get_options([&](const CLI::Option* option) {
        return option->get_group() == group && option->nonpositional();
      });
      if (group.empty() || options.empty()) continue;
      text += mode == CLI::AppFormatMode::All || group == kFirstGroup
                  ? make_group(group, false, options)
                  : names_of(group, options);
    }
    return text;
  }

  static std::string names_of(const std::string& group,
                              const std::vector<const CLI::Option*>& all) {
    std::vector<std::string> names;
    names.reserve(all.size());
    for (const CLI::Option* option : all) names.push_back(option->get_name());
    return fmt::format("\n{} (--help-all explains them):\n{}\n", group, wrapped(names, 92, "  "));
  }
};

/// Letters to insert, leave out or replace to make one word of the other.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

/// "did you mean 'detail'? ", with the name nearest to the word; empty where none is near.
std::string guess_of(std::string_view word, const std::vector<std::string>& names) {
  const std::string* nearest = nullptr;
  // More letters than that are no typing error.
  std::size_t least = std::min<std::size_t>(3, word.size() / 2 + 1);
  for (const std::string& name : names) {
    const std::size_t distance = edit_distance(word, name);
    if (distance < least) nearest = &name;
    least = std::min(least, distance);
  }
  return nearest != nullptr ? fmt::format("did you mean '{}'? ", *nearest) : std::string();
}

/// A command's words without the program's name: "profile compare".
std::string words_of(const CLI::App& command) {
  const CLI::App* const parent = command.get_parent();
  if (parent == nullptr) return {};
  const std::string group = words_of(*parent);
  return (group.empty() ? "" : group + ' ') + command.get_name();
}

std::vector<std::string> names_in(const CLI::App& group) {
  std::vector<std::string> names;
  for (const CLI::App* command : group.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

/// Null where there is none.
const CLI::App* find_command_in(const CLI::App& group, const std::string& word) {
  for (const CLI::App* command : group.get_subcommands({})) {
    if (command->get_name() == word) return command;
  }
  return nullptr;
}

/// @throws InputError that suggests the nearest command
const CLI::App& command_named(const CLI::App& program, const std::string& word) {
  if (const CLI::App* const found = find_command_in(program, word)) return *found;
  throw InputError(fmt::format("there is no command '{}'; {}'qjulia --help' lists the commands",
                               word, guess_of(word, names_in(program))));
}

bool is_help(const std::string& word) {
  return word == "-h" || word == "--help" || word == "--help-all";
}

/// @throws InputError where a command has replaced the option.
void refuse_replaced(const CommandGroup& group, const std::string& word) {
  const std::string option = word.substr(0, word.find('='));
  const auto found = group.replaced.find(option);
  if (found == group.replaced.end()) return;
  throw InputError(
      fmt::format("'qjulia {0} {1}' is 'qjulia {0} {2}' now", group.name, option, found->second));
}

/// @param word that stands after the group's, and is none of its commands.
/// @throws InputError saying what should stand there
[[noreturn]] void refuse_in_group(const CLI::App& group, const CommandGroup& notes,
                                  const std::string& word) {
  const std::vector<std::string> names = names_in(group);
  std::string guess = guess_of(word, names);
  if (guess.empty()) guess = fmt::format("its commands are {}; ", fmt::join(names, ", "));
  throw InputError(
      fmt::format("'qjulia {0}' needs one of its commands before '{1}'; {2}'qjulia {0} "
                  "--help' explains them",
                  notes.name, word, guess));
}

/// @param name with its dashes. CLI11's own search is noexcept, and yet allocates.
const CLI::Option* find_option(const CLI::App& command, const std::string& name) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->check_name(name)) return option;
  }
  return nullptr;
}

/// @param words a command line. @param first what follows the command in it.
/// @throws InputError that suggests the nearest option
void check_options(const CLI::App& command, const std::vector<std::string>& words,
                   std::size_t first) {
  for (std::size_t i = first; i < words.size() && words[i] != "--"; ++i) {
    const std::string word = words[i].substr(0, words[i].find('='));
    if (!word.starts_with("--")) continue;
    if (const CLI::Option* const option = find_option(command, word); option != nullptr) {
      if (option->get_items_expected_max() > 0 || word == words[i]) continue;
      throw InputError(
          fmt::format("{} takes no value; leave out '{}'", word, words[i].substr(word.size())));
    }
    std::vector<std::string> names;
    for (const CLI::Option* option : command.get_options()) names.push_back(option->get_name());
    throw InputError(
        fmt::format("there is no option '{}'; {}'qjulia {} --help-all' lists the options", word,
                    guess_of(word, names), words_of(command)));
  }
}

/// An option was given a value that it cannot use.
struct BadValue {
  std::string option;  ///< "--seed"
  std::string problem;
};

/// Calls `read`, whose InputErrors are about the option.
template <class Read>
bool read_for(const std::string& option, const Read& read) {
  try {
    read();
    return true;
  } catch (const InputError& error) {
    throw BadValue{option, error.what()};
  }
}

template <class Number>
Number read_number(const std::string& word) {
  // from_chars takes no plus sign.
  const char* const begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* const end = word.data() + word.size();
  Number value{};
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error == std::errc::result_out_of_range) {
    throw InputError(fmt::format("{} is out of range; give {} to {}", word,
                                 std::numeric_limits<Number>::lowest(),
                                 std::numeric_limits<Number>::max()));
  }
  if (std::unsigned_integral<Number> && word.starts_with('-')) {
    throw InputError(fmt::format("{} is out of range; give 0 or more", word));
  }
  if (error != std::errc() || stop != end) {
    throw InputError(
        fmt::format("'{}' is not a {}number", word, std::integral<Number> ? "whole " : ""));
  }
  if constexpr (std::floating_point<Number>) {
    if (!std::isfinite(value)) {
      throw InputError(fmt::format("'{}' is not a finite number", word));
    }
  }
  return value;
}

void read(const std::string& word, std::string& target) { target = word; }
template <class Number>
void read(const std::string& word, Number& target) {
  target = read_number<Number>(word);
}
template <class Number>
void read(const std::string& word, std::optional<Number>& target) {
  target = read_number<Number>(word);
}

template <class Value>
std::string shown(const Value& value) {
  return fmt::format("{}", value);
}
template <class Value>
std::string shown(const std::optional<Value>&) {
  return {};
}

/// "-o,--output": "--output".
std::string longest_name(const std::string& names) {
  const auto comma = names.rfind(',');
  return comma == std::string::npos ? names : names.substr(comma + 1);
}

/// Reads numbers, and calls `take` with every `count` of them.
auto number_reader(const std::string& names, int count,
                   std::function<void(const std::vector<double>&)> take) {
  return
      [option = longest_name(names), count, take = std::move(take)](const CLI::results_t& words) {
        return read_for(option, [&] {
          std::vector<double> values;
          for (const std::string& word : words) {
            values.push_back(read_number<double>(word));
            if (std::ssize(values) < count) continue;
            take(values);
            values.clear();
          }
        });
      };
}

int count_words(const std::string& text) {
  return 1 + static_cast<int>(std::ranges::count(text, ' '));
}

/// ".5" is a number and "-.5" is one too, which CLI11 takes for an option named ".".
std::string with_zero(const std::string& word) {
  const bool needs_zero = word.starts_with("-.") && base::number_in<double>(word);
  return needs_zero ? "-0" + word.substr(1) : word;
}

OptionUsage usage_of(const CLI::Option& option, const CommandNotes& notes) {
  OptionUsage usage;
  usage.is_positional = option.get_positional();
  usage.name = option.get_single_name();
  if (!option.get_snames().empty()) usage.letter = "-" + option.get_snames().front();
  if (!usage.is_positional) usage.name = "--" + usage.name;
  if (option.get_items_expected_max() > 0 && !usage.is_positional) {
    const std::string type = option.get_type_name();
    const bool has_many = option.get_type_size() > 1 || option.get_expected_max() > 1;
    usage.values = has_many ? base::split(type, ' ') : std::vector{type};
  }
  usage.description = option.get_description();
  usage.default_text = option.get_default_str();
  usage.group = option.get_group();
  usage.is_required = option.get_required();
  usage.is_repeated = option.get_type_size() > 1 || notes.repeated.contains(&option);
  if (const auto found = notes.completions.find(&option); found != notes.completions.end()) {
    usage.completion = found->second;
  }
  usage.takes_numbers = notes.numbers.contains(&option);
  usage.is_in_job = !notes.not_in_jobs.contains(&option);
  usage.is_output = notes.outputs.contains(&option);
  if (const auto found = notes.examples.find(&option); found != notes.examples.end()) {
    usage.example = found->second;
  }
  return usage;
}

CommandUsage usage_of(const CLI::App& app, const CommandNotes& notes) {
  CommandUsage usage{words_of(app), app.get_description(), app.get_footer(), {}};
  if (const auto found = notes.groups.find(&app); found != notes.groups.end()) {
    usage.members = names_in(app);
    usage.usual = found->second.usual;
  }
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_group().empty()) continue;  // for the program's own use
    usage.options.push_back(usage_of(*option, notes));
    if (option == app.get_help_ptr() || option == app.get_help_all_ptr()) {
      usage.options.back().is_in_job = false;
    }
  }
  return usage;
}

bool is_direction(std::string_view word) { return word == "-x" || word == "-y" || word == "-z"; }

/// The arguments as CLI11 reads them rightly.
std::vector<std::string> as_parsed(const std::vector<std::string>& given) {
  std::vector<std::string> words;
  for (const std::string& word : given) {
    // "--up -z": no option has such a name.
    if (!words.empty() && words.back().starts_with("--") && is_direction(word)) {
      words.back() += '=' + word;
    } else {
      words.push_back(with_zero(word));
    }
  }
  return words;
}

}  // namespace

double finite_number(const std::string& word) { return read_number<double>(word); }

int whole_number(const std::string& word) { return read_number<int>(word); }

void read_value(const std::string& word, const Target& target) {
  std::visit([&](auto* value) { read(word, *value); }, target);
}

Option Option::range(double low, double high) const {
  option_->check(CLI::Validator(
      [option = name(), low, high](const std::string& word) -> std::string {
        read_for(option, [&] {
          const auto value = read_number<double>(word);
          if (value >= low && value <= high) return;
          throw InputError(fmt::format("{} is out of range; give {} to {}", word, low, high));
        });
        return {};
      },
      ""));
  return *this;
}

Option Option::group(const std::string& title) const {
  option_->group(title);
  return *this;
}

Option Option::excludes(std::initializer_list<Option> others) const {
  for (const Option& other : others) option_->excludes(other.option_);
  return *this;
}

Option Option::needs(const Option& other) const {
  option_->needs(other.option_);
  return *this;
}

Option Option::required() const {
  option_->required();
  return *this;
}

Option Option::default_text(const std::string& text) const {
  option_->default_str(text);
  return *this;
}

Option Option::example(const std::string& words) const {
  notes_->examples[option_] = words;
  return *this;
}

Option Option::not_in_job() const {
  notes_->not_in_jobs.insert(option_);
  return *this;
}

Option Option::names_output() const {
  notes_->outputs.insert(option_);
  return not_in_job();
}

Option Option::offers(const std::vector<std::string>& words) const {
  notes_->completions[option_].words = words;
  return *this;
}

Option Option::offers_files(const std::vector<std::string>& extensions) const {
  Completion& completion = notes_->completions[option_];
  completion.takes_files = true;
  completion.extensions = extensions;
  return *this;
}

Option Option::offers_folders() const {
  notes_->completions[option_].takes_folders = true;
  return *this;
}

std::string Option::name() const { return option_->get_name(); }

bool Option::given() const { return option_->count() > 0; }

Option Command::word(const std::string& names, const std::string& type,
                     std::function<void(const std::string&)> take,
                     const std::string& description) const {
  const auto read = [option = longest_name(names),
                     take = std::move(take)](const CLI::results_t& words) {
    return read_for(option, [&] { take(words.front()); });
  };
  return {app_->add_option(names, read, description)->type_name(type), notes_};
}

Option Command::words(const std::string& names, std::function<void(const std::string&)> take,
                      const std::string& description) const {
  constexpr int kMostWords = 1000;
  const auto read = [option = longest_name(names),
                     take = std::move(take)](const CLI::results_t& words) {
    return read_for(option, [&] { std::ranges::for_each(words, take); });
  };
  return {app_->add_option(names, read, description)
              ->type_name("")
              ->expected(1, kMostWords)
              ->allow_extra_args(),
          notes_};
}

Option Command::add(const std::string& names, Target target, const std::string& type,
                    const std::string& description) const {
  const auto take = [target](const std::string& word) { read_value(word, target); };
  const Option added = word(names, type, take, description);
  if (!std::holds_alternative<std::string*>(target)) notes_->numbers.insert(added.option_);
  return added.default_text(std::visit([](const auto* value) { return shown(*value); }, target));
}

Option Command::file(const std::string& names, std::string& target, const std::string& type,
                     const std::string& description) const {
  const auto take = [&target](const std::string& name) {
    if (name.empty()) throw InputError("the name is empty; give a file or folder");
    target = name;
  };
  return word(names, type, take, description);
}

Option Command::input(const std::string& name, std::string& target,
                      const std::string& description) const {
  return file(name, target, "", description).required();
}

Option Command::output(std::string& target, const std::string& type,
                       const std::string& description) const {
  return file("-o,--output", target, type, description).required().names_output();
}

Option Command::output(const std::string& names, OutputName& target,
                       std::function<std::string()> named, const std::string& type,
                       const std::string& description) const {
  notes_->once_chosen[app_].emplace_back([&target, named = std::move(named)] {
    if (!target.path.empty()) return;
    target = {named(), true};
  });
  return file(names, target.path, type, description).names_output();
}

Option Command::flag(const std::string& names, bool& target, const std::string& description) const {
  const auto take = [&target, given = !target](std::int64_t) { target = given; };
  return {app_->add_flag_function(names, take, description), notes_};
}

Option Command::numbers(const std::string& names, const std::string& type,
                        std::function<void(const std::vector<double>&)> take,
                        const std::string& description) const {
  const int count = count_words(type);
  CLI::Option* const added =
      app_->add_option(names, number_reader(names, count, std::move(take)), description)
          ->expected(count)
          ->type_name(type);
  notes_->numbers.insert(added);
  return {added, notes_};
}

Option Command::repeated_numbers(const std::string& names, const std::string& type, int most,
                                 std::function<void(const std::vector<double>&)> take,
                                 const std::string& description) const {
  const int count = count_words(type);
  CLI::Option* const added =
      app_->add_option(names, number_reader(names, count, std::move(take)), description)
          ->type_name(type)
          ->type_size(count)
          ->expected(1, most)
          ->allow_extra_args(false);
  notes_->numbers.insert(added);
  return {added, notes_};
}

Option Command::repeated_word(const std::string& names, const std::string& type, int most,
                              std::function<void(const std::vector<std::string>&)> take,
                              const std::string& description) const {
  const auto read = [option = longest_name(names), most,
                     take = std::move(take)](const CLI::results_t& words) {
    return read_for(option, [&] {
      if (words.size() > static_cast<std::size_t>(most)) {
        throw InputError(
            fmt::format("it is given {} times; give it {} times at most", words.size(), most));
      }
      take(words);
    });
  };
  CLI::Option* const added = app_->add_option(names, read, description)
                                 ->type_name(type)
                                 ->expected(1)
                                 ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  notes_->repeated.insert(added);
  return {added, notes_};
}

void Command::footer(const std::string& text) const { app_->footer(text); }

void Command::on_chosen(std::function<void()> call) const {
  app_->callback([app = app_, notes = notes_, call = std::move(call)] {
    for (const auto& before : notes->once_chosen[app]) before();
    call();
  });
}

Job Command::job() const {
  Job job{.command = words_of(*app_)};
  for (const CLI::Option* option : std::as_const(*app_).get_options()) {
    const OptionUsage usage = usage_of(*option, *notes_);
    if (option->count() == 0 || !usage.is_in_job) continue;
    const std::string name = job_name(usage.name);
    const CLI::results_t& words = option->results();
    nlohmann::json& value = job.options[name];
    if (usage.values.empty() && !usage.is_positional) {
      value = true;
    } else if (usage.is_repeated && words.size() > 1) {
      const auto count = static_cast<std::ptrdiff_t>(usage.values.size());
      value = nlohmann::json::array();
      for (auto word = words.begin(); word != words.end(); word += count) {
        const nlohmann::json each = job_value({word, word + count}, usage.takes_numbers);
        value.push_back(each.is_array() ? each : nlohmann::json::array({each}));
      }
    } else if (usage.completion.takes_files) {
      std::error_code ignored;
      const std::filesystem::path path = words.front();
      const bool is_file = usage.is_positional || std::filesystem::exists(path, ignored);
      value = is_file ? base::to_utf8(path.filename().string()) : words.front();
      if (is_file) job.inputs[name].path = path;
    } else {
      value = job_value(words, usage.takes_numbers);
    }
  }
  return job;
}

CommandLine::CommandLine(const std::string& description, const std::string& name)
    : app_(std::make_unique<CLI::App>(description, name)),
      notes_(std::make_unique<CommandNotes>()) {
  app_->formatter(std::make_shared<HelpFormat>());  // subcommands inherit it
  app_->require_subcommand(0, 1);
  if (name.empty()) app_->set_help_flag();  // no program, no help
}

CommandLine::~CommandLine() = default;

Command CommandLine::root() const { return {app_.get(), notes_.get()}; }

void CommandLine::add_group(const CommandGroup& group) {
  CLI::App* const added = app_->add_subcommand(group.name, group.description);
  added->footer(group.footer);
  added->require_subcommand(1);
  added->set_help_all_flag("--help-all", "Print this help");
  notes_->groups[added] = group;
}

Command CommandLine::add_command(const std::string& name, const std::string& description) {
  const std::size_t space = name.find(' ');
  const bool is_member = space != std::string::npos;
  CLI::App* const group = is_member ? app_->get_subcommand(name.substr(0, space)) : app_.get();
  CLI::App* const command =
      group->add_subcommand(is_member ? name.substr(space + 1) : name, description);
  command->set_help_all_flag("--help-all", "Print this help with the options of all groups");
  return {command, notes_.get()};
}

void CommandLine::version(std::function<std::string()> text) {
  app_->set_version_flag("--version", std::move(text));
}

std::string CommandLine::help() const { return app_->help(); }

bool CommandUsage::has(const std::string& option) const {
  return std::ranges::find(options, option, &OptionUsage::name) != options.end();
}

ProgramUsage CommandLine::usage() const {
  ProgramUsage program{usage_of(*app_, *notes_), {}};
  for (const CLI::App* command : std::as_const(*app_).get_subcommands({})) {
    program.commands.push_back(usage_of(*command, *notes_));
    for (const CLI::App* member : command->get_subcommands({})) {
      program.commands.push_back(usage_of(*member, *notes_));
    }
  }
  return program;
}

std::optional<int> CommandLine::find_command(std::vector<std::string>& words) const {
  if (words.empty() || words.front().starts_with('-')) return std::nullopt;
  const CLI::App* command = &command_named(*app_, words.front());
  std::size_t first = 1;
  if (const auto group = notes_->groups.find(command); group != notes_->groups.end()) {
    const std::string& usual = group->second.usual;
    if (words.size() == 1 && usual.empty()) {
      print_error(command->help(app_->get_name()));
      return kBadInput;
    }
    if (words.size() > 1 && is_help(words[1])) return std::nullopt;
    for (const std::string& word : words) refuse_replaced(group->second, word);
    const std::string& input = group->second.usual_input;
    const bool is_usual = words.size() == 1 || words[1].starts_with('-') ||
                          (!input.empty() && words[1].ends_with(input));
    if (!usual.empty() && is_usual) {
      words.insert(words.begin() + 1, usual);
    }
    const CLI::App* const member = find_command_in(*command, words[1]);
    if (member == nullptr) refuse_in_group(*command, group->second, words[1]);
    command = member;
    first = 2;
  }
  check_options(*command, words, first);
  return std::nullopt;
}

std::optional<int> CommandLine::parse(int argc, const char* const* argv) {
  std::vector<std::string> words = as_parsed({argv + std::min(argc, 1), argv + argc});
  if (!words.empty() && words.front() == "help") {  // help COMMAND: COMMAND --help-all
    words.erase(words.begin());
    const bool is_group =
        words.size() == 1 && notes_->groups.contains(find_command_in(*app_, words.front()));
    words.emplace_back(words.empty() || is_group ? "--help" : "--help-all");
  }
  if (const auto code = find_command(words)) return code;
  std::ranges::reverse(words);  // as CLI11 takes them
  try {
    app_->parse(std::move(words));
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    std::ostringstream help, problem;
    const bool is_help = app_->exit(error, help, problem) == 0;
    print_error(problem.str());
    if (!is_help) return kBadInput;
    std::string text = help.str();
    if (text.ends_with('\n')) text.pop_back();
    return print_result(text) ? kDone : kFailed;
  } catch (const BadValue& bad) {
    throw InputError(bad.option + ": " + bad.problem);
  }
}

void CommandLine::parse(const std::vector<std::string>& given) {
  std::vector<std::string> words = as_parsed(given);
  std::ranges::reverse(words);  // as CLI11 takes them
  try {
    app_->parse(std::move(words));
  } catch (const CLI::ParseError& error) {
    throw InputError(error.what());
  } catch (const BadValue& bad) {
    throw InputError(bad.option.substr(2) + ": " + bad.problem);
  }
}

bool CommandLine::has_option(const std::string& name) const {
  return find_option(*app_, "--" + name) != nullptr;
}

bool CommandLine::is_flag(const std::string& name) const {
  const CLI::Option* const option = find_option(*app_, "--" + name);
  return option != nullptr && option->get_items_expected_max() == 0;
}

std::vector<std::string> CommandLine::option_names() const {
  std::vector<std::string> names;
  for (const CLI::Option* option : std::as_const(*app_).get_options()) {
    names.push_back(option->get_single_name());
  }
  return names;
}

}  // namespace qjulia::tools

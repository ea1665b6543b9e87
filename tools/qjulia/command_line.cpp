#include "command_line.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include "exit_code.hpp"
#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

/// CLI11's help with descriptions broken into lines.
class HelpFormat : public CLI::Formatter {
 public:
  std::string make_option_desc(const CLI::Option* option) const override {
    constexpr std::size_t kColumns = 64;
    std::istringstream words(CLI::Formatter::make_option_desc(option));
    std::string text;
    std::string line;
    for (std::string word; words >> word;) {
      if (!line.empty() && line.size() + 1 + word.size() > kColumns) {
        text += line + '\n';
        line.clear();
      }
      line += (line.empty() ? "" : " ") + word;
    }
    return text + line;
  }
};

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

const char* type_word(const Target& target) {
  struct Word {
    const char* operator()(const std::string*) const { return "TEXT"; }
    const char* operator()(const int*) const { return "INT"; }
    const char* operator()(const std::optional<int>*) const { return "INT"; }
    const char* operator()(const std::uint64_t*) const { return "INT"; }
    const char* operator()(const std::optional<std::uint64_t>*) const { return "INT"; }
    const char* operator()(const double*) const { return "NUMBER"; }
    const char* operator()(const std::optional<double>*) const { return "NUMBER"; }
  };
  return std::visit(Word{}, target);
}

/// "-o,--output": "--output".
std::string longest_name(const std::string& names) {
  const auto comma = names.rfind(',');
  return comma == std::string::npos ? names : names.substr(comma + 1);
}

/// ".5" is a number and "-.5" is one too, which CLI11 takes for an option named ".".
std::string with_zero(const std::string& word) {
  if (!word.starts_with("-.")) return word;
  double value = 0;
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  const bool number = error == std::errc() && stop == word.data() + word.size();
  return number ? "-0" + word.substr(1) : word;
}

}  // namespace

Option Option::type(const std::string& word) const {
  option_->type_name(word);
  return *this;
}

Option Option::required() const {
  option_->required();
  return *this;
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

Option Option::excludes(Option other) const {
  option_->excludes(other.option_);
  return *this;
}

Option Option::default_text(const std::string& text) const {
  option_->default_str(text);
  return *this;
}

std::string Option::name() const { return option_->get_name(); }

bool Option::given() const { return option_->count() > 0; }

Option Command::word(const std::string& names, std::function<void(const std::string&)> take,
                     const std::string& description) const {
  const auto read = [option = longest_name(names),
                     take = std::move(take)](const CLI::results_t& words) {
    return read_for(option, [&] { take(words.front()); });
  };
  return Option(app_->add_option(names, read, description)).type("TEXT");
}

Option Command::add(const std::string& names, Target target, const std::string& description) const {
  const auto take = [target](const std::string& word) {
    std::visit([&](auto* value) { read(word, *value); }, target);
  };
  return word(names, take, description)
      .type(type_word(target))
      .default_text(std::visit([](const auto* value) { return shown(*value); }, target));
}

Option Command::file(const std::string& names, std::string& target,
                     const std::string& description) const {
  const auto take = [&target](const std::string& name) {
    if (name.empty()) throw InputError("the name is empty; give a file or folder");
    target = name;
  };
  return word(names, take, description);
}

Option Command::flag(const std::string& names, bool& target, const std::string& description) const {
  return Option(app_->add_flag(names, target, description));
}

Option Command::numbers(const std::string& names, int count,
                        std::function<void(const std::vector<double>&)> take,
                        const std::string& description) const {
  const auto read = [option = longest_name(names),
                     take = std::move(take)](const CLI::results_t& words) {
    return read_for(option, [&] {
      std::vector<double> values;
      for (const std::string& word : words) values.push_back(read_number<double>(word));
      take(values);
    });
  };
  return Option(app_->add_option(names, read, description)->expected(count));
}

Option Command::one_of(const std::string& names, const std::vector<std::string>& words,
                       std::function<void(std::size_t)> take,
                       const std::string& description) const {
  const auto find = [words, take = std::move(take)](const std::string& word) {
    const auto found = std::ranges::find(words, word);
    if (found == words.end()) {
      throw InputError(
          fmt::format("'{}' is not known; give one of: {}", word, fmt::join(words, ", ")));
    }
    take(static_cast<std::size_t>(found - words.begin()));
  };
  return word(names, find, description).type(fmt::format("{}", fmt::join(words, "|")));
}

void Command::footer(const std::string& text) const { app_->footer(text); }

void Command::on_chosen(std::function<void()> call) const { app_->callback(std::move(call)); }

CommandLine::CommandLine(const std::string& description, const std::string& name)
    : app_(std::make_unique<CLI::App>(description, name)) {
  app_->formatter(std::make_shared<HelpFormat>());  // of subcommands too
  app_->require_subcommand(0, 1);
  if (name.empty()) app_->set_help_flag();  // no program, no help
}

CommandLine::~CommandLine() = default;

Command CommandLine::root() const { return Command(app_.get()); }

Command CommandLine::add_command(const std::string& name, const std::string& description) {
  return Command(app_->add_subcommand(name, description));
}

void CommandLine::version(const std::string& text) { app_->set_version_flag("--version", text); }

std::string CommandLine::help() const { return app_->help(); }

std::optional<int> CommandLine::parse(int argc, const char* const* argv) {
  std::vector<std::string> words;
  for (int i = argc - 1; i > 0; --i) words.push_back(with_zero(argv[i]));  // last one first
  try {
    app_->parse(std::move(words));
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    return app_->exit(error) == 0 ? kDone : kBadInput;
  } catch (const BadValue& bad) {
    throw InputError(bad.option + ": " + bad.problem);
  }
}

void CommandLine::parse(std::vector<std::string> words) {
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
  return app_->get_option_no_throw("--" + name) != nullptr;
}

std::vector<std::string> CommandLine::option_names() const {
  std::vector<std::string> names;
  for (const CLI::Option* option : std::as_const(*app_).get_options()) {
    names.push_back(option->get_single_name());
  }
  return names;
}

}  // namespace qjulia::tools

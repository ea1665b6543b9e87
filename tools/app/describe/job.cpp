#include "describe/job.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "base/file_types.hpp"
#include "base/text.hpp"
#include "describe/command_line.hpp"
#include "describe/files.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"

namespace qjulia::tools {
namespace {

/// A number as JSON writes it, or the text.
std::string word_of(const nlohmann::json& value) {
  return value.is_string() ? value.get<std::string>() : value.dump();
}

nlohmann::json value_of(const std::string& word, bool is_number) {
  nlohmann::json number = nlohmann::json::parse(word, nullptr, false);
  if (number.is_number() && (is_number || number.dump() == word)) return number;
  if (!is_number) return word;
  // Such as ".5" or "+3", which JSON would not read.
  const double value = finite_number(word);
  constexpr double kMostExact = 9e15;
  const bool is_whole = value == std::floor(value) && std::abs(value) < kMostExact;
  return is_whole ? nlohmann::json(static_cast<std::int64_t>(value)) : nlohmann::json(value);
}

bool is_word(const nlohmann::json& value) { return value.is_string() || value.is_number(); }

bool are_words(const nlohmann::json& value) {
  return value.is_array() && !value.empty() && std::ranges::all_of(value, is_word);
}

/// The words in a value, whose lists may be nested: a box is a list of its two corners.
std::vector<std::string> all_words(const nlohmann::json& value) {
  if (is_word(value)) return {word_of(value)};
  std::vector<std::string> made;
  for (const nlohmann::json& part : value) {
    for (std::string& word : all_words(part)) made.push_back(std::move(word));
  }
  return made;
}

/// Every time that an option is given, its words.
std::vector<std::vector<std::string>> occurrences(const nlohmann::json& value,
                                                  const OptionUsage& option) {
  std::vector<std::vector<std::string>> all;
  if (option.is_repeated && value.is_array() && !are_words(value)) {
    for (const nlohmann::json& each : value) all.push_back(all_words(each));
  } else {
    all.push_back(all_words(value));
  }
  for (std::vector<std::string>& words : all) {
    if (option.values.size() == 1) words = {fmt::format("{}", fmt::join(words, ","))};
  }
  return all;
}

bool is_option_value(const nlohmann::json& value) {
  return value.is_boolean() || is_word(value) || are_words(value) ||
         (value.is_array() && !value.empty() && std::ranges::all_of(value, are_words));
}

/// @throws InputError
void expect_option_value(const std::string& name, const nlohmann::json& value) {
  if (is_option_value(value)) return;
  throw InputError(
      fmt::format("'{}' must be a number, text, true, false, a list of numbers or "
                  "texts, or a list of such lists",
                  name));
}

const nlohmann::json& member(const nlohmann::json& object, const char* name,
                             nlohmann::json::value_t type, const std::string& source) {
  if (!object.contains(name)) {
    throw InputError(fmt::format("the job in '{}' has no '{}'", source, name));
  }
  const nlohmann::json& found = object.at(name);
  if (found.type() != type) {
    throw InputError(fmt::format("the job in '{}': '{}' must be {}", source, name,
                                 type == nlohmann::json::value_t::object ? "a table" : "text"));
  }
  return found;
}

}  // namespace

void Job::hash_inputs() {
  for (auto& [name, input] : inputs) {
    std::error_code ignored;
    // What comes through a pipe is gone once it is read.
    if (input.hash.empty() && std::filesystem::is_regular_file(input.path, ignored)) {
      input.hash = file_hash(input.path);
    }
  }
}

std::string job_name(const std::string& option) {
  std::string name = option.substr(option.find_first_not_of('-'));
  for (char& c : name) {
    if (c == '-') c = '_';
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return name;
}

void set_changes(nlohmann::json& options, const nlohmann::json& was, const nlohmann::json& is) {
  for (const auto& [name, value] : is.items()) {
    const nlohmann::json& before = was.at(name);
    if (value == before) continue;
    if (before.is_boolean()) {
      options[before.get<bool>() ? "no_" + name : name] = true;
    } else if (value.is_null()) {
      options.erase(name);
    } else {
      options[name] = value;
    }
  }
}

void find_files(nlohmann::json& options, const CommandUsage& usage,
                const std::filesystem::path& folder) {
  for (auto& [name, value] : options.items()) {
    const OptionUsage& option = option_named(usage, name);
    const std::vector<std::string>& types = option.completion.extensions;
    if (!option.completion.takes_files || !value.is_string()) continue;
    const std::filesystem::path named = value.get<std::string>();
    if (std::ranges::count(types, base::extension_of(named)) == 0)
      continue;  // such as a look's name
    const std::filesystem::path path = std::filesystem::absolute(folder / named);
    std::error_code ignored;
    if (!std::filesystem::exists(path, ignored)) {
      throw InputError(fmt::format("{}: there is no file '{}'", name, path.string()));
    }
    value = path.string();
  }
}

nlohmann::json job_value(const std::vector<std::string>& words, bool are_numbers) {
  if (words.size() == 1) return value_of(words.front(), are_numbers);
  nlohmann::json list = nlohmann::json::array();
  for (const std::string& word : words) list.push_back(value_of(word, are_numbers));
  return list;
}

nlohmann::json to_json(const Job& job) {
  nlohmann::json made = {{"command", job.command},
                         {"options", job.options},
                         {"version", job.version.empty() ? version() : job.version}};
  for (const auto& [name, input] : job.inputs) {
    if (!input.hash.empty()) made["fnv1a64"][name] = input.hash;
  }
  if (!job.device.is_null()) made["device"] = job.device;
  return made;
}

Job job_from_json(const nlohmann::json& object, const std::string& source) {
  if (!object.is_object()) {
    throw InputError(
        fmt::format("'{}' holds no job: a table with 'command' and 'options'", source));
  }
  Job job;
  job.command =
      member(object, "command", nlohmann::json::value_t::string, source).get<std::string>();
  job.options = member(object, "options", nlohmann::json::value_t::object, source);
  for (const auto& [name, value] : object.items()) {
    if (name == "command" || name == "options") continue;
    if (name == "device") {
      job.device = value;
    } else if (name == "version") {
      job.version =
          member(object, "version", nlohmann::json::value_t::string, source).get<std::string>();
    } else if (name == "fnv1a64") {
      for (const auto& [option, hash] :
           member(object, "fnv1a64", nlohmann::json::value_t::object, source).items()) {
        if (!hash.is_string()) {
          throw InputError(fmt::format("the job in '{}': fnv1a64.{} must be text", source, option));
        }
        job.inputs[option].hash = hash.get<std::string>();
      }
    } else {
      throw InputError(
          fmt::format("the job in '{}' has '{}', which is not known: a job has "
                      "'command', 'options', 'fnv1a64', 'version' and 'device'",
                      source, name));
    }
  }
  for (const auto& [name, value] : job.options.items()) {
    try {
      expect_option_value(name, value);
    } catch (const InputError& error) {
      throw InputError(fmt::format("the job in '{}': {}", source, error.what()));
    }
  }
  return job;
}

const OptionUsage& option_named(const CommandUsage& usage, const std::string& name) {
  std::vector<std::string> names;
  for (const OptionUsage& option : usage.options) {
    if (!option.is_in_job) continue;
    if (job_name(option.name) == name) return option;
    names.push_back(job_name(option.name));
  }
  throw InputError(fmt::format("'{}' has no option '{}'; its options are {}", usage.name, name,
                               fmt::join(names, ", ")));
}

const OptionUsage* output_of(const CommandUsage& usage) {
  const auto found = std::ranges::find_if(usage.options, &OptionUsage::is_output);
  return found == usage.options.end() ? nullptr : &*found;
}

std::vector<std::string> words_of(const Job& job, const CommandUsage& usage,
                                  const std::string& output) {
  std::vector<std::string> words = base::split(job.command, ' ');
  for (const OptionUsage& option : usage.options) {
    if (option.is_output && !output.empty()) {
      if (!option.is_positional) words.push_back(option.name);
      words.push_back(output);
    }
    if (!option.is_positional || !job.options.contains(job_name(option.name))) continue;
    const nlohmann::json& value = job.options.at(job_name(option.name));
    for (const nlohmann::json& one : value.is_array() ? value : nlohmann::json::array({value})) {
      const std::string word = word_of(one);
      words.push_back(word.starts_with('-') ? "./" + word : word);
    }
  }
  for (const auto& [name, value] : job.options.items()) {
    const OptionUsage& option = option_named(usage, name);
    expect_option_value(name, value);
    if (option.is_positional) continue;
    if (option.values.empty() != value.is_boolean()) {
      throw InputError(fmt::format(
          "{}: {}", name,
          option.values.empty() ? "give true or false" : "it takes a value, not true or false"));
    }
    if (value.is_boolean()) {
      if (value.get<bool>()) words.push_back(option.name);
      continue;
    }
    for (const std::vector<std::string>& given : occurrences(value, option)) {
      words.push_back(option.name);
      words.insert(words.end(), given.begin(), given.end());
    }
  }
  return words;
}

std::string command_text(const Job& job, const CommandUsage& usage) {
  const std::string text = "qjulia " + shell_words(words_of(job, usage));
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7F; };
  return std::ranges::any_of(text, is_control) ? std::string() : text;
}

void add_job(Map& map, const Job& job) {
  const nlohmann::json& provenance = map.provenance.json();
  nlohmann::json jobs = provenance.is_object() ? provenance.value("jobs", nlohmann::json::array())
                                               : nlohmann::json::array();
  if (!jobs.is_array()) jobs = nlohmann::json::array();
  const nlohmann::json made = to_json(job);
  // A page or picture that is made again from the map in it has the job already.
  if (jobs.empty() || jobs.back() != made) jobs.push_back(made);
  map.provenance.set("jobs", jobs);
}

nlohmann::json last_job(const Map& map, const std::string& file) {
  const nlohmann::json& provenance = map.provenance.json();
  if (provenance.is_object() && provenance.contains("jobs")) {
    if (const nlohmann::json& jobs = provenance.at("jobs"); jobs.is_array() && !jobs.empty()) {
      return jobs.back();
    }
  }
  throw InputError(fmt::format("'{}' does not say which command made it", file));
}

}  // namespace qjulia::tools

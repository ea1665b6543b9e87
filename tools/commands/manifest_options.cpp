#include "commands/manifest_options.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "describe/command_line.hpp"
#include "describe/fit_options.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

/// The option's name as manifests spell it.
std::string spelled(std::string name) {
  std::ranges::replace(name, '-', '_');
  return name;
}

std::string option_names(const CommandLine& command) {
  std::string names = fmt::format("{}", fmt::join(batch::manifest_keys(), ", "));
  for (const std::string& name : command.option_names()) names += ", " + spelled(name);
  return names;
}

}  // namespace

FitOptions fit_options(const std::vector<batch::ManifestOption>& options) {
  CommandLine command;
  FitOptions read;
  add_fit_options(command.root(), read);
  std::vector<std::string> words;
  for (const auto& [name, values, line] : options) {
    if (!command.has_option(name)) {
      throw InputError(fmt::format("'{}' is not known; the options of a fit are: {}", spelled(name),
                                   option_names(command)));
    }
    if (command.is_flag(name) != values.empty()) {
      throw InputError(
          fmt::format("'{}' must be {}", spelled(name),
                      values.empty() ? "a number or a string, not true" : "true or false"));
    }
    if (!values.empty() && values.front().empty()) {
      throw InputError(fmt::format("'{}' is empty; give a value, or leave it out", spelled(name)));
    }
    words.push_back(values.empty() ? "--" + name : fmt::format("--{}={}", name, values.front()));
  }
  command.parse(words);
  read.validate();
  return read;
}

}  // namespace qjulia::tools

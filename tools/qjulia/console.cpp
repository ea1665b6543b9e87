#include "console.hpp"

#include <nlohmann/json.hpp>

#include "standard_streams.hpp"

namespace qjulia::tools {
namespace {

std::string dump(const nlohmann::json& object) {
  // File names need not be UTF-8.
  return object.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void Console::note(const std::string& text) {
  if (verbosity_.quiet) return;
  display_.clear();
  print_error(text + '\n');
}

void Console::detail(const std::string& text) {
  if (verbosity_.verbose) note(text);
}

void Console::warn(const std::string& text) {
  display_.clear();
  print_error("warning: " + text + '\n');
}

void Console::result(const std::string& text, const nlohmann::json& object) {
  display_.clear();
  print(verbosity_.json ? dump(object) : text);
}

void Console::summary(const std::string& text, const nlohmann::json& object) {
  note(text);
  if (verbosity_.json) print(dump(object));
}

void Console::print(const std::string& text) {
  if (print_result(text)) return;
  is_result_lost_ = true;
  print_error("qjulia: cannot write to standard output\n");
}

void Console::progress(const Progress& progress) {
  if (!verbosity_.quiet) display_.show(progress);
}

}  // namespace qjulia::tools

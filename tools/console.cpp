#include "console.hpp"

#include <fmt/format.h>

#include <cstdio>

#include "qjulia/error.hpp"

namespace qjulia::tools {
namespace {

void print_result(const std::string& text) {
  fmt::print("{}\n", text);
  if (std::fflush(stdout) != 0) throw OutputError("cannot write to standard output");
}

std::string dump(const nlohmann::json& object) {
  // File names need not be UTF-8.
  return object.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

void Console::note(const std::string& text) {
  if (verbosity_.quiet) return;
  display_.clear();
  fmt::print(stderr, "{}\n", text);
}

void Console::detail(const std::string& text) {
  if (verbosity_.verbose) note(text);
}

void Console::warn(const std::string& text) {
  display_.clear();
  fmt::print(stderr, "warning: {}\n", text);
}

void Console::result(const std::string& text, const nlohmann::json& object) {
  display_.clear();
  print_result(verbosity_.json ? dump(object) : text);
}

void Console::summary(const std::string& text, const nlohmann::json& object) {
  note(text);
  if (verbosity_.json) print_result(dump(object));
}

void Console::progress(const Progress& progress) {
  if (!verbosity_.quiet) display_.show(progress);
}

}  // namespace qjulia::tools

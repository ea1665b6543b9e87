#include "device/program_source.hpp"

#include <fmt/format.h>

#include <set>
#include <sstream>

#include "qjulia/base/error.hpp"

namespace qjulia::device {
namespace {

std::string find_path(const std::string& name) {
  std::string path = "kernels/" + name;
  if (embedded_kernels().contains(path)) return path;
  throw KernelBuildError(fmt::format("no kernel file named '{}' is part of this build", name));
}

class Expansion {
 public:
  explicit Expansion(std::map<std::string, std::string> files) : files_(std::move(files)) {}

  void append(const std::string& path) {
    if (seen_.insert(path).second) append(path, embedded_kernels().find(path)->second);
  }

  void append(const std::string& path, std::string_view text) {
    text_ += fmt::format("#line 1 \"{}\"\n", path);
    std::istringstream lines{std::string(text)};
    lines.exceptions(std::ios::badbit);  // else a lack of memory is the end of the file
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
      ++number;
      std::istringstream words(line);
      words.exceptions(std::ios::badbit);
      std::string directive, name, file;
      words >> directive >> name >> file;
      if (directive == "#include") {
        append(find_path(named(name)));
        text_ += fmt::format("#line {} \"{}\"\n", number + 1, path);
        continue;
      }
      if (directive == "#define" && is_quoted(file)) files_.emplace(name, unquoted(file));
      text_ += (line == "#pragma once" ? "" : line) + '\n';
    }
  }

  const std::string& text() const { return text_; }

 private:
  static bool is_quoted(const std::string& word) { return word.starts_with('"'); }
  static std::string unquoted(const std::string& word) { return word.substr(1, word.size() - 2); }

  /// The name of the file that the word after #include refers to.
  std::string named(const std::string& word) const {
    if (is_quoted(word)) return unquoted(word);
    const auto found = files_.find(word);
    return found == files_.end() ? word : found->second;
  }

  std::map<std::string, std::string> files_;
  std::set<std::string> seen_;
  std::string text_;
};

}  // namespace

std::string expand_kernel_source(const std::string& name,
                                 const std::map<std::string, std::string>& files) {
  Expansion expansion(files);
  expansion.append(find_path(name));
  return expansion.text();
}

std::string expand_kernel_text(const std::string& label, std::string_view text,
                               const std::map<std::string, std::string>& files) {
  Expansion expansion(files);
  expansion.append(label, text);
  return expansion.text();
}

}  // namespace qjulia::device

#include "commands/film_key_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "base/input_file.hpp"
#include "base/text.hpp"
#include "describe/command_line.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

constexpr std::uint64_t kLargestScript = std::uint64_t{16} << 20;

/// Without the blanks at both ends.
std::string trimmed(const std::string& text) {
  constexpr const char* kBlank = " \t";
  const std::size_t begin = text.find_first_not_of(kBlank);
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(kBlank) + 1 - begin);
}

}  // namespace

std::string script_text(const std::filesystem::path& path, const char* what) {
  std::error_code ignored;
  const auto status = std::filesystem::status(path, ignored);
  if (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status)) {
    throw InputError(fmt::format("'{}' is no regular file, as a {} must be", path.string(), what));
  }
  return base::read_text_file(path, what, kLargestScript, {});
}
std::vector<KeyRow> rows_of(std::string_view text) {
  const std::size_t first = std::min(text.find_first_not_of(" \t,;\r\n"), text.size());
  const std::string_view head = text.substr(first, text.find('\n', first) - first);
  const char between = head.find('\t') != std::string_view::npos  ? '\t'
                       : head.find(';') != std::string_view::npos ? ';'
                                                                  : ',';
  std::vector<KeyRow> rows;
  std::size_t line = 1;
  bool is_quoted = false, is_new = true;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (is_new) rows.push_back({line, {""}});
    is_new = false;
    std::string& cell = rows.back().cells.back();
    if (c == '"' && is_quoted && text.substr(i + 1, 1) == "\"") {
      cell += text[++i];
    } else if (c == '"' && (is_quoted || trimmed(cell).empty())) {
      is_quoted = !is_quoted;
    } else if (c == between && !is_quoted) {
      rows.back().cells.emplace_back();
    } else if (c == '\n' && !is_quoted) {
      is_new = true;
    } else if (c != '\r') {
      cell += c;
    }
    if (c == '\n') ++line;
  }
  if (is_quoted) throw InputError(fmt::format("{}: a quote has no end", rows.back().line));
  for (KeyRow& row : rows) {
    std::ranges::transform(row.cells, row.cells.begin(), trimmed);
    while (!row.cells.empty() && row.cells.back().empty()) row.cells.pop_back();
  }
  std::erase_if(rows, [](const KeyRow& row) { return row.cells.empty(); });
  return rows;
}

double number_of_cell(const std::string& word) {
  if (word.find(',') != std::string::npos) {
    std::string pointed = word;
    std::ranges::replace(pointed, ',', '.');
    throw InputError(fmt::format("'{}': numbers have a point, not a comma: {}", word, pointed));
  }
  return finite_number(word);
}

}  // namespace qjulia::tools

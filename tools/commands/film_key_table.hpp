#pragma once
/// Keys of a film in a table, as spreadsheets write them.

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace qjulia::tools {

/// The text of a script or of its table of keys. @throws InputError for what is no regular file: a
/// pipe would be waited for
std::string script_text(const std::filesystem::path& path, const char* what);

struct KeyRow {
  std::size_t line = 0;  ///< that it begins in
  std::vector<std::string> cells;
};

/// The rows of a table of comma-separated values (RFC 4180), or with semicolons or tabs in place of
/// commas: cells may stand in quotes, with a quote doubled and any separator inside. Rows without
/// anything are left out, and so are empty cells at the ends of rows.
/// @throws InputError that begins with the line
std::vector<KeyRow> rows_of(std::string_view text);

/// @throws InputError
double number_of_cell(const std::string& word);

}  // namespace qjulia::tools

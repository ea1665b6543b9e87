#include "base/toml.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/text.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::base {
namespace {

/// `text` in ASCII, with characters in double quotes escaped and those of comments left out: what
/// toml++ 3.3 does at characters in unexpected places is undefined, and it takes some for spaces.
std::string in_ascii(std::string_view text, const std::string& name) {
  std::string ascii;
  int line = 1;
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (static_cast<unsigned char>(c) >= 0x80) {
      const auto [length, code] = first_character(text.substr(i));
      if (length == 0 || quote != '"') {
        throw InputError(fmt::format("{}:{}: not TOML: {}", name, line,
                                     length == 0 ? "a character is not UTF-8"
                                                 : "a character outside double quotes and comments "
                                                   "is not ASCII"));
      }
      ascii += fmt::format("\\U{:08X}", code);
      i += length - 1;
      continue;
    }
    if (c == '#' && quote == 0) {
      i = std::min(text.find('\n', i), text.size()) - 1;
      continue;
    }
    ascii += c;
    if (c == '\n') {
      ++line;
      quote = 0;
    } else if (c == quote) {
      quote = 0;
    } else if (quote == 0 && (c == '"' || c == '\'')) {
      quote = c;
    } else if (quote == '"' && c == '\\') {
      const std::string_view next = text.substr(i + 1, 1);
      if (next != "\"" && next != "\\") continue;
      ascii += text[++i];
    }
  }
  return ascii;
}

}  // namespace

toml::table parse_toml(std::string_view text, const std::string& name) {
  const std::string ascii = in_ascii(without_byte_order_mark(text), name);
  try {
    return toml::parse(ascii, name);
  } catch (const toml::parse_error& error) {
    throw InputError(
        fmt::format("{}:{}: not TOML: {}", name, error.source().begin.line, error.description()));
  }
}

}  // namespace qjulia::base

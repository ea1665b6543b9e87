#include "base/toml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "qjulia/error.hpp"

namespace qjulia::base {
namespace {

/// The UTF-8 character at text[i], which is not ASCII, as TOML's escape; i moves to its last byte.
/// Empty when it is damaged.
std::string escaped(std::string_view text, std::size_t& i) {
  const auto lead = static_cast<unsigned char>(text[i]);
  const int bytes = std::countl_one(lead);
  if (bytes < 2 || bytes > 4) return {};
  std::uint32_t code = lead & (0xFFU >> (bytes + 1));
  for (int k = 1; k < bytes; ++k) {
    if (++i == text.size()) return {};
    const auto next = static_cast<unsigned char>(text[i]);
    if (next >> 6 != 2) return {};
    code = code << 6 | (next & 0x3FU);
  }
  return fmt::format("\\U{:08X}", code);
}

/// `text` in ASCII, with characters in double quotes escaped and those of comments left out: what
/// toml++ 3.3 does at characters in unexpected places is undefined, and it takes some for spaces.
std::string in_ascii(std::string_view text, const std::string& name) {
  std::string ascii;
  int line = 1;
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (static_cast<unsigned char>(c) >= 0x80) {
      const std::string escape = escaped(text, i);
      if (escape.empty() || quote != '"') {
        throw InputError(fmt::format("{}:{}: not TOML: {}", name, line,
                                     escape.empty() ? "a character is not UTF-8"
                                                    : "a character outside double quotes and "
                                                      "comments is not ASCII"));
      }
      ascii += escape;
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
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  const std::string ascii = in_ascii(text, name);
  try {
    return toml::parse(ascii, name);
  } catch (const toml::parse_error& error) {
    throw InputError(
        fmt::format("{}:{}: not TOML: {}", name, error.source().begin.line, error.description()));
  }
}

}  // namespace qjulia::base

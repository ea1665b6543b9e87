#include "roff.hpp"

#include <fmt/format.h>

#include <cstdint>

#include "base/text.hpp"

namespace qjulia::manual {
namespace {

constexpr std::size_t kColumns = 78;

/// The character of UTF-8 text that begins at `at`, which moves behind it.
std::uint32_t next_character(std::string_view text, std::size_t& at) {
  const auto byte = [&] { return static_cast<unsigned char>(text[at++]); };
  const std::uint32_t first = byte();
  if (first < 0xC0U) return first;
  const int more = first < 0xE0U ? 1 : first < 0xF0U ? 2 : 3;
  std::uint32_t code = first & (0x3FU >> static_cast<unsigned>(more));
  for (int i = 0; i < more && at < text.size(); ++i) code = code << 6U | (byte() & 0x3FU);
  return code;
}

/// A line that begins with one of these would be a request.
std::string guarded(const std::string& line) {
  return line.starts_with('.') || line.starts_with('\'') ? "\\&" + line : line;
}

}  // namespace

std::string roff(std::string_view text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::uint32_t c = next_character(text, at);
    switch (c) {
      case '\\':
        out += "\\e";
        break;
      case '-':
        out += "\\-";
        break;
      case '\'':
        out += "\\(aq";
        break;
      case '`':
        out += "\\(ga";
        break;
      case '^':
        out += "\\(ha";
        break;
      case '~':
        out += "\\(ti";
        break;
      default:
        out += c < 0x80U ? std::string(1, static_cast<char>(c)) : fmt::format("\\[u{:04X}]", c);
    }
  }
  return out;
}

std::string roff_paragraph(std::string_view text) {
  std::string out, line;
  for (const std::string& word : base::split(text, ' ')) {
    if (word.empty()) continue;
    const std::string piece = roff(word);
    if (!line.empty() && line.size() + 1 + piece.size() > kColumns) {
      out += guarded(line) + '\n';
      line.clear();
    }
    line += (line.empty() ? "" : " ") + piece;
  }
  return line.empty() ? out : out + guarded(line) + '\n';
}

std::string roff_block(std::string_view lines) {
  std::string out = ".RS 4\n.nf\n";
  for (const std::string& line : base::split(lines, '\n')) out += guarded(roff(line)) + '\n';
  return out + ".fi\n.RE\n";
}

std::string bold(std::string_view text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(std::string_view text) { return "\\fI" + roff(text) + "\\fR"; }

}  // namespace qjulia::manual

#pragma once
/// Encodings of texts, their parts and numbers, and errors in words.

#include <charconv>
#include <cstdint>
#include <exception>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace qjulia::base {

/// A character of UTF-8 (RFC 3629), and how many bytes it has.
struct Character {
  std::size_t length = 0;  ///< 0: the bytes are no UTF-8
  std::uint32_t code = 0;
};

/// What `text`, which is not empty, begins with.
Character first_character(std::string_view text);

/// The text without a UTF-8 byte order mark.
std::string_view without_byte_order_mark(std::string_view text);

/// "UTF-16" or "UTF-32" when the text begins with one's byte order mark; empty otherwise.
std::string_view wide_encoding(std::string_view text);

/// The text as valid UTF-8, for JSON and messages: bytes that are not are written as \xFF. File
/// names may hold any bytes.
std::string to_utf8(std::string_view text);

/// For a web address: every byte but letters, digits, `-._~` and those in `plain` as %XX.
std::string percent_encoded(std::string_view text, std::string_view plain = {});

/// What stands between separators: one part more than there are of them.
std::vector<std::string> split(std::string_view text, char separator);

/// The number that is all of `text`; none where it is not one, or too large for its type.
template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value{};
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

/// Whether arrays and objects of a JSON text are nested deeper than in any file of this program: to
/// be asked before it is parsed, since copying and writing values recurse.
bool is_json_too_deep(std::string_view json);

/// "look-at" of "look_at": the name of an option without its dashes.
std::string dashed(std::string name);

/// With ASCII's letters in lower case, whatever the locale.
std::string lower_case(std::string text);

/// What went wrong, in words that help a user even where those of the C++ library do not.
std::string message_of(const std::exception& error);

}  // namespace qjulia::base

#pragma once
/// Encodings of texts, and errors in words.

#include <exception>
#include <string>
#include <string_view>

namespace qjulia::base {

/// The text without a UTF-8 byte order mark.
std::string_view without_byte_order_mark(std::string_view text);

/// "UTF-16" or "UTF-32" when the text begins with one's byte order mark; empty otherwise.
std::string_view wide_encoding(std::string_view text);

/// The text as valid UTF-8, for JSON and messages: bytes that are not are written as \xFF. File
/// names may hold any bytes.
std::string to_utf8(std::string_view text);

/// What went wrong, also where the library of C++ says it in words that tell a user nothing.
std::string message_of(const std::exception& error);

}  // namespace qjulia::base

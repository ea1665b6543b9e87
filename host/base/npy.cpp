#include "base/npy.hpp"

#include <algorithm>
#include <charconv>

namespace qjulia::base {
namespace {

/// What follows a key of the header's dictionary, without blanks before it; empty: it has no such
/// key.
std::string_view after_key(std::string_view text, std::string_view key) {
  const std::size_t at = text.find(fmt::format("'{}'", key));
  if (at == std::string_view::npos) return {};
  text.remove_prefix(at + key.size() + 2);
  const std::size_t value = text.find_first_not_of(" \t:");
  return value == std::string_view::npos ? std::string_view() : text.substr(value);
}

/// "(4, 3)" or "(4,)"; none for anything else.
std::optional<std::vector<std::size_t>> sizes_in(std::string_view text) {
  if (!text.starts_with('(')) return std::nullopt;
  text = text.substr(1, text.find(')') - 1);
  std::vector<std::size_t> sizes;
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(" ,"), text.size()));
    if (text.empty()) return sizes;
    std::size_t size = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), size);
    if (error != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    sizes.push_back(size);
  }
}

}  // namespace

std::optional<NpyHeader> read_npy_header(std::string_view bytes) {
  constexpr std::size_t kMagic = 6, kVersion = 2;
  if (!bytes.starts_with("\x93NUMPY") || bytes.size() < kMagic + kVersion) return std::nullopt;
  const int version = static_cast<unsigned char>(bytes[kMagic]);
  if (version < 1 || version > 3) return std::nullopt;
  const std::size_t length_bytes = version == 1 ? 2 : 4;
  const std::size_t before = kMagic + kVersion + length_bytes;
  if (bytes.size() < before) return std::nullopt;
  std::size_t length = 0;
  for (std::size_t i = before; i > kMagic + kVersion; --i) {
    length = length << 8U | static_cast<unsigned char>(bytes[i - 1]);
  }
  if (length > bytes.size() - before) return std::nullopt;
  const std::string_view text = bytes.substr(before, length);
  NpyHeader header;
  header.bytes = before + length;
  const std::string_view type = after_key(text, "descr");
  if (type.starts_with('\'')) header.type = type.substr(1, type.find('\'', 1) - 1);
  header.is_fortran = after_key(text, "fortran_order").starts_with("True");
  const auto shape = sizes_in(after_key(text, "shape"));
  if (!shape) return std::nullopt;
  header.shape = *shape;
  return header;
}

}  // namespace qjulia::base

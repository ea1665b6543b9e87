#include "map/packed_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "base/deflate.hpp"
#include "base/file_types.hpp"
#include "base/input_file.hpp"
#include "base/map_chunk.hpp"
#include "map/map_parts.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::map {
namespace {

constexpr std::size_t kWord = 4;  // bytes
constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";
constexpr const char* kCutOff = "it is cut off; copy or download it again";

enum class ByteOrder { highest_first, lowest_first };

std::size_t word(std::string_view bytes, std::size_t at, ByteOrder order) {
  std::size_t value = 0;
  for (std::size_t i = 0; i < kWord; ++i) {
    const std::size_t place = order == ByteOrder::highest_first ? i : kWord - 1 - i;
    value = value << 8U | static_cast<unsigned char>(bytes[at + place]);
  }
  return value;
}

std::string word_bytes(std::size_t value) {
  std::string bytes;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    bytes.push_back(static_cast<char>((value >> shift) & 0xFFU));
  }
  return bytes;
}

/// The next `count` bytes, or fewer where the file ends.
std::string next(base::InputFile& file, std::size_t count) {
  std::string bytes;
  file.read(bytes, count);
  return bytes;
}

/// Adds the data of a chunk of a map.
void add_chunk(base::InputFile& file, std::size_t length, std::string& packed) {
  if (length > kLargestMapText - packed.size()) {
    file.refuse(fmt::format("its map takes more than {}", base::size_text(kLargestMapText)));
  }
  const std::string data = next(file, length);
  if (data.size() < length) file.refuse(kCutOff);
  packed += data;
}

/// PNG specification, 5.3: chunks of length, type, data and CRC.
std::optional<std::string> packed_in_png(base::InputFile& file) {
  if (next(file, kPngSignature.size()) != kPngSignature) file.refuse("it is not a PNG picture");
  std::string packed;
  while (true) {
    const std::string head = next(file, 2 * kWord);
    if (head.size() < 2 * kWord) file.refuse(kCutOff);
    const std::size_t length = word(head, 0, ByteOrder::highest_first);
    const std::string_view type = std::string_view(head).substr(kWord);
    if (type == base::kPngMapChunk) {
      add_chunk(file, length, packed);
      file.skip(kWord);
      continue;
    }
    // Pixels need not be read where the map came before them.
    if (type == "IEND" || (type == "IDAT" && !packed.empty())) break;
    file.skip(length + kWord);
  }
  if (packed.empty()) return {};
  return packed;
}

/// glTF 2.0, 4.4: a header of three words, then chunks of length, type and data.
std::optional<std::string> packed_in_glb(base::InputFile& file) {
  constexpr std::size_t kHeader = 3 * kWord;
  const std::string header = next(file, kHeader);
  if (header.size() < kHeader || !header.starts_with("glTF")) file.refuse("it is not a .glb scene");
  const std::size_t whole = word(header, 2 * kWord, ByteOrder::lowest_first);
  for (std::size_t at = kHeader; at < whole;) {
    const std::string head = next(file, 2 * kWord);
    if (head.size() < 2 * kWord) file.refuse(kCutOff);
    const std::size_t length = word(head, 0, ByteOrder::lowest_first);
    if (std::string_view(head).substr(kWord) == base::kGlbMapChunk) {
      std::string packed;
      add_chunk(file, length, packed);
      return packed;
    }
    file.skip(length);
    at += 2 * kWord + length;
  }
  return {};
}

}  // namespace

std::string packed_text(std::string_view text) {
  const std::string deflated = base::deflated(text);
  return word_bytes(text.size()) + word_bytes(deflated.size()) + deflated;
}

bool is_map_carrier(const std::filesystem::path& path) {
  const std::string extension = base::extension_of(path);
  return extension == ".png" || extension == ".glb";
}

std::optional<std::string> packed_text_in(const std::filesystem::path& path,
                                          const std::stop_token& stop) {
  const bool is_picture = base::extension_of(path) == ".png";
  base::InputFile file(path, is_picture ? "picture" : "scene",
                       std::numeric_limits<std::uint64_t>::max(), stop);
  return is_picture ? packed_in_png(file) : packed_in_glb(file);
}

std::string unpacked_text(std::string_view packed, const std::string& source) {
  constexpr std::size_t kHeader = 2 * kWord;
  if (packed.size() >= kHeader) {
    const std::size_t size = word(packed, 0, ByteOrder::highest_first);
    const std::size_t length = word(packed, kWord, ByteOrder::highest_first);
    if (size > kLargestMapText) {
      fail(source, fmt::format("its map would take {}; a map may have {} at most",
                               base::size_text(size), base::size_text(kLargestMapText)));
    }
    // A chunk of a .glb is filled up to a multiple of four bytes.
    const std::size_t filled = kHeader + length;
    if (packed.size() >= filled && packed.size() < filled + kWord) {
      if (auto text = base::inflated(packed.substr(kHeader, length), size)) return *std::move(text);
    }
  }
  fail(source, "its map is damaged; take the file as qjulia wrote it");
}

}  // namespace qjulia::map

#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <vector>

#include "files/atomic_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/picture.hpp"

namespace qjulia {
namespace {

/// The signature and the header chunk, after which text may stand.
constexpr std::size_t kHeaderBytes = 8 + 25;

void append_number(std::vector<char>& bytes, std::size_t number) {
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    bytes.push_back(static_cast<char>((number >> shift) & 0xFFU));
  }
}

/// A tEXt chunk (PNG specification, 11.3.4.3): length, type, keyword, zero, text, CRC of all but
/// the length.
std::vector<char> text_chunk(const std::string& keyword, const std::string& text) {
  std::vector<char> chunk;
  append_number(chunk, keyword.size() + 1 + text.size());
  const std::string body = "tEXt" + keyword + '\0' + text;
  std::ranges::copy(body, std::back_inserter(chunk));
  append_number(chunk, crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size()));
  return chunk;
}

}  // namespace

std::string png_bytes(const Image& image, const PictureText& text) {
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() !=
          3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
    throw InputError("a picture without pixels cannot be written");
  }
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = static_cast<png_uint_32>(image.width);
  png.height = static_cast<png_uint_32>(image.height);
  png.format = PNG_FORMAT_RGB;
  std::vector<char> encoded(PNG_IMAGE_PNG_SIZE_MAX(png));
  png_alloc_size_t size = encoded.size();
  if (png_image_write_to_memory(&png, encoded.data(), &size, 0, image.pixels.data(), 0, nullptr) ==
      0) {
    throw OutputError(std::string("cannot encode a picture as PNG: ") + png.message);
  }
  std::string bytes(encoded.data(), kHeaderBytes);
  for (const auto& [keyword, value] : text) {
    const std::vector<char> chunk = text_chunk(keyword, value);
    bytes.append(chunk.begin(), chunk.end());
  }
  return bytes.append(encoded.data() + kHeaderBytes, size - kHeaderBytes);
}

void write_png(const Image& image, const std::filesystem::path& path, const PictureText& text) {
  write_file(path, png_bytes(image, text));
}

}  // namespace qjulia

#include "base/deflate.hpp"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <stdexcept>

namespace qjulia::base {
namespace {

const Bytef* bytes_of(std::string_view text) {
  return reinterpret_cast<const Bytef*>(text.data());  // NOLINT: as zlib takes them
}
Bytef* bytes_of(std::string& text) {
  return reinterpret_cast<Bytef*>(text.data());  // NOLINT: as zlib takes them
}

}  // namespace

std::string deflated(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string made(size, '\0');
  constexpr int kLevel = 6;
  if (compress2(bytes_of(made), &size, bytes_of(bytes), bytes.size(), kLevel) != Z_OK) {
    throw std::runtime_error("zlib has no memory");
  }
  made.resize(size);
  return made;
}

std::optional<std::string> inflated(std::string_view bytes, std::size_t size) {
  constexpr std::size_t kFirst = std::size_t{1} << 16;
  if (std::max(bytes.size(), size) > std::numeric_limits<uInt>::max()) return {};
  z_stream stream{};
  if (inflateInit(&stream) != Z_OK) throw std::runtime_error("zlib has no memory");
  stream.next_in = const_cast<Bytef*>(bytes_of(bytes));  // NOLINT: zlib does not write there
  stream.avail_in = static_cast<uInt>(bytes.size());
  std::string found;
  int code = Z_OK;
  while (code == Z_OK && found.size() <= size) {
    // One byte more than there should be shows that there is more.
    const std::size_t begin = found.size();
    found.resize(std::min(size + 1, std::max(kFirst, 2 * begin)));
    stream.next_out = bytes_of(found) + begin;
    stream.avail_out = static_cast<uInt>(found.size() - begin);
    code = inflate(&stream, Z_NO_FLUSH);
    found.resize(found.size() - stream.avail_out);
    if (stream.avail_out > 0 && code == Z_OK) break;  // the input has ended too soon
  }
  const bool is_whole = code == Z_STREAM_END && stream.avail_in == 0 && found.size() == size;
  inflateEnd(&stream);
  if (!is_whole) return {};
  return found;
}

bool inflate_bare(std::string_view bytes, const std::function<bool(std::string_view part)>& take) {
  constexpr std::size_t kPart = std::size_t{1} << 16;
  constexpr std::size_t kMostInput = std::size_t{1} << 30;  // zlib counts in 32 bits
  z_stream stream{};
  if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::runtime_error("zlib has no memory");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> end(&stream, inflateEnd);
  std::string part(kPart, '\0');
  int code = Z_OK;
  while (code == Z_OK) {
    if (stream.avail_in == 0) {
      stream.next_in = const_cast<Bytef*>(bytes_of(bytes));  // NOLINT: zlib does not write there
      stream.avail_in = static_cast<uInt>(std::min(bytes.size(), kMostInput));
      bytes.remove_prefix(stream.avail_in);
    }
    stream.next_out = bytes_of(part);
    stream.avail_out = static_cast<uInt>(part.size());
    code = inflate(&stream, Z_NO_FLUSH);  // which is an error where the input ends too soon
    const std::string_view made(part.data(), part.size() - stream.avail_out);
    if (!made.empty() && !take(made)) return false;
  }
  return code == Z_STREAM_END && stream.avail_in == 0 && bytes.empty();
}

std::uint32_t crc_32(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes_of(bytes), bytes.size()));
}

}  // namespace qjulia::base

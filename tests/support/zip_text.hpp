#pragma once
/// What is in a ZIP archive, by way of its directory.

#include <zlib.h>

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>

namespace qjulia::test {

/// `count` bytes, the lowest first.
inline std::uint64_t number_at(std::string_view bytes, std::size_t at, int count) {
  std::uint64_t value = 0;
  for (int i = count - 1; i >= 0; --i) {
    value = value << 8 | static_cast<unsigned char>(bytes.at(at + static_cast<std::size_t>(i)));
  }
  return value;
}

/// What raw deflate was given. @throws std::runtime_error unless it is `size` bytes.
inline std::string raw_inflated(std::string_view packed, std::size_t size) {
  std::string found(size, '\0');
  z_stream stream{};
  inflateInit2(&stream, -15);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(found.data());
  stream.avail_out = static_cast<uInt>(size);
  const int code = inflate(&stream, Z_FINISH);
  inflateEnd(&stream);
  if (code != Z_STREAM_END || stream.avail_out > 0 || stream.avail_in > 0) {
    throw std::runtime_error("the entry does not have its length");
  }
  return found;
}

/// Contents by name. Sizes and checksums of local headers and of the directory have to agree.
inline std::map<std::string, std::string> zip_entries(const std::string& zip) {
  const auto expect = [](bool holds, const char* what) {
    if (!holds) throw std::runtime_error(what);
  };
  const std::size_t end = zip.rfind("PK\x05\x06");
  expect(end != std::string::npos, "no end of the directory");
  std::size_t at = number_at(zip, end + 16, 4);
  std::map<std::string, std::string> entries;
  for (std::size_t i = 0; i < number_at(zip, end + 10, 2); ++i) {
    expect(zip.substr(at, 4) == "PK\x01\x02", "no entry of the directory");
    const std::size_t packed = number_at(zip, at + 20, 4), size = number_at(zip, at + 24, 4);
    const std::size_t name_size = number_at(zip, at + 28, 2);
    const std::string name = zip.substr(at + 46, name_size);
    const std::size_t local = number_at(zip, at + 42, 4);
    expect(zip.substr(local, 4) == "PK\x03\x04", "no local header");
    expect(zip.substr(local + 30, name_size) == name, "names differ");
    const std::size_t extra = number_at(zip, local + 28, 2), data = local + 30 + name_size;
    if (extra > 0) {
      expect(number_at(zip, local + 18, 4) == 0xffffffff, "ZIP64 is not marked");
      expect(number_at(zip, data + 4, 8) == size && number_at(zip, data + 12, 8) == packed,
             "ZIP64's sizes differ");
    } else {
      expect(number_at(zip, local + 18, 4) == packed && number_at(zip, local + 22, 4) == size,
             "sizes differ");
    }
    const std::string contents =
        raw_inflated(std::string_view(zip).substr(data + extra, packed), size);
    const std::uint64_t checksum =
        crc32(0, reinterpret_cast<const Bytef*>(contents.data()), static_cast<uInt>(size));
    expect(number_at(zip, local + 14, 4) == checksum && number_at(zip, at + 16, 4) == checksum,
           "checksums differ");
    entries[name] = contents;
    at += 46 + name_size + number_at(zip, at + 30, 2) + number_at(zip, at + 32, 2);
  }
  return entries;
}

}  // namespace qjulia::test

#pragma once
/// Bytes and text for a stream, handed over a mebibyte at a time: a stream's own formatting is
/// slow.

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstddef>
#include <iterator>
#include <ostream>
#include <string>

namespace qjulia::shape {

static_assert(std::endian::native == std::endian::little, "binary mesh files are little-endian");

class RecordStream {
 public:
  explicit RecordStream(std::ostream& out) : out_(out) {}
  ~RecordStream() { flush(); }
  RecordStream(const RecordStream&) = delete;
  RecordStream& operator=(const RecordStream&) = delete;

  /// The value's bytes as they lie in memory.
  template <class T>
  void add(const T& value) {
    const auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    chunk_.append(bytes.data(), bytes.size());
    flush_if_full();
  }
  template <class... Values>
  void print(fmt::format_string<const Values&...> form, const Values&... values) {
    fmt::format_to(std::back_inserter(chunk_), form, values...);
    flush_if_full();
  }

 private:
  void flush_if_full() {
    constexpr std::size_t kFull = std::size_t{1} << 20;
    if (chunk_.size() >= kFull) flush();
  }
  void flush() {
    out_.write(chunk_.data(), static_cast<std::streamsize>(chunk_.size()));
    chunk_.clear();
  }

  std::ostream& out_;
  std::string chunk_;
};

}  // namespace qjulia::shape

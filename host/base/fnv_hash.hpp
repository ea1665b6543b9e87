#pragma once
/// FNV-1a, 64 bits: shows whether two things are the same, and does not protect against somebody
/// who wants them to seem so. http://www.isthe.com/chongo/tech/comp/fnv

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>

namespace qjulia::base {

class FnvHash {
 public:
  void add(std::string_view bytes) {
    for (const char byte : bytes) add_byte(static_cast<unsigned char>(byte));
  }
  void add(double value) { add(std::bit_cast<std::uint64_t>(value)); }
  template <class T>
  requires std::is_integral_v<T>
  void add(T value) {
    for (const unsigned char byte : std::bit_cast<std::array<unsigned char, sizeof(T)>>(value)) {
      add_byte(byte);
    }
  }
  /// 16 hexadecimal digits.
  std::string text() const { return fmt::format("{:016x}", value_); }

 private:
  void add_byte(unsigned char byte) { value_ = (value_ ^ byte) * 0x100000001b3U; }
  std::uint64_t value_ = 0xcbf29ce484222325U;
};

}  // namespace qjulia::base

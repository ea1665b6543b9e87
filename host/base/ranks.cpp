#include "qjulia/fit/ranks.hpp"

#include <fmt/format.h>

#include <limits>

#include "qjulia/base/error.hpp"

namespace qjulia {

Ranks::Numbers Ranks::numbers_of(const std::string& bytes) {
  Numbers numbers;
  numbers.reserve(bytes.size());
  for (const char byte : bytes) numbers.push_back(static_cast<unsigned char>(byte));
  return numbers;
}

std::string Ranks::bytes_of(const Numbers& numbers) {
  std::string bytes;
  bytes.reserve(numbers.size());
  for (const double number : numbers) {
    if (!(number >= 0 && number <= std::numeric_limits<unsigned char>::max())) {
      throw InputError(fmt::format("a rank has sent {} where a byte was expected", number));
    }
    bytes += static_cast<char>(static_cast<unsigned char>(number));
  }
  return bytes;
}

}  // namespace qjulia

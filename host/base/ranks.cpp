#include "qjulia/ranks.hpp"

#include <fmt/format.h>

#include <limits>

#include "qjulia/error.hpp"

namespace qjulia {

std::string Ranks::bytes_of(const Numbers& numbers) {
  using Limits = std::numeric_limits<char>;
  std::string bytes;
  bytes.reserve(numbers.size());
  for (const double number : numbers) {
    if (!(number >= Limits::min() && number <= Limits::max())) {
      throw InputError(fmt::format("a rank has sent {} where a byte was expected", number));
    }
    bytes += static_cast<char>(number);
  }
  return bytes;
}

}  // namespace qjulia

#pragma once
/// How a palette is spread over what a material shows.

#include <cstddef>
#include <string>
#include <vector>

namespace qjulia {

/// The values of a material that the palette goes through.
struct MaterialRange {
  static constexpr std::size_t kMostValues = 64;
  double low = 0, high = 1;  ///< where it begins and ends
  /// Rising values between these, which together with them divide the palette into equal parts: one
  /// value stands at its middle, three stand at its quarters. Without any, the palette is spread
  /// evenly.
  std::vector<double> between{};

  std::vector<double> values() const;  ///< all of them, rising
  void validate() const;               ///< @throws OptionError naming `range`
  friend bool operator==(const MaterialRange&, const MaterialRange&) = default;
};

/// The range of all its values, rising. @throws InputError where there are less than two
MaterialRange range_of(const std::vector<double>& values);
/// "0,0.2,0.5,1". @throws InputError
MaterialRange range_from(const std::string& text);

}  // namespace qjulia

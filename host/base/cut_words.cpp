#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <string>
#include <vector>

#include "base/range_check.hpp"
#include "base/text.hpp"
#include "qjulia/base/cut.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {

void Cut::validate() const {
  base::expect_finite("cut", at);
  if (axis < 'x' || axis > 'z') {
    throw OptionError("cut", fmt::format("'{}' is not an axis; give x, y or z", axis));
  }
}

double place_of(const Cut& cut, const std::optional<Box>& box) {
  cut.validate();
  if (!cut.is_percent) return cut.at;
  if (!box) throw OptionError("cut", "the map keeps no box of its shape; give a coordinate");
  const auto axis = static_cast<Eigen::Index>(cut.axis - 'x');
  return std::lerp(box->low[axis], box->high[axis], cut.at / 100);
}

std::vector<Cut> cuts_from(const std::string& text) {
  std::vector<Cut> cuts;
  if (text.empty()) return cuts;
  for (const std::string& word : base::split(text, ',')) {
    const bool is_percent = word.ends_with('%');
    const bool has_axis = word.size() >= 3 && word[0] >= 'x' && word[0] <= 'z' && word[1] == '=';
    const auto at =
        has_axis ? base::number_in<double>(word.substr(2, word.size() - 2 - (is_percent ? 1 : 0)))
                 : std::nullopt;
    if (!at || !std::isfinite(*at)) {
      throw InputError(fmt::format("'{}' is not AXIS=PLACE, such as z=50% or x=0.2", word));
    }
    cuts.push_back({word[0], *at, is_percent});
  }
  return cuts;
}

std::string to_string(const std::vector<Cut>& cuts) {
  std::vector<std::string> words;
  words.reserve(cuts.size());
  for (const Cut& cut : cuts) {
    words.push_back(fmt::format("{}={}{}", cut.axis, cut.at, cut.is_percent ? "%" : ""));
  }
  return fmt::format("{}", fmt::join(words, ","));
}

}  // namespace qjulia

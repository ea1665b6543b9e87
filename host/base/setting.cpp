#include "qjulia/setting.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "qjulia/error.hpp"

namespace qjulia {

const char* to_string(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::none:
      return "none";
    case Interpolation::linear:
      return "linear";
    case Interpolation::logarithmic:
      return "logarithmic";
    case Interpolation::rotation:
      return "rotation";
  }
  return "";
}

std::string Setting::option() const {
  std::string text = name;
  std::ranges::replace(text, '_', '-');
  return text;
}

std::string Setting::range_text() const {
  if (std::isfinite(most)) return fmt::format("{} to {}", least, most);
  if (!std::isfinite(least)) return "any number";
  return least == 0 ? "0 or more" : "more than 0";
}

void Setting::expect_in_range(double value) const {
  if (value >= least && value <= most) return;
  throw InputError(fmt::format("{} is out of range; give {}{}{}", value, range_text(),
                               unit.empty() ? "" : " ", unit));
}

}  // namespace qjulia

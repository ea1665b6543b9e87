#include "qjulia/setting.hpp"

#include <fmt/format.h>

#include <algorithm>

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

void Setting::expect_in_range(double value) const {
  if (value >= least && value <= most) return;
  throw InputError(fmt::format("{} is out of range; give {} to {}{}{}", value, least, most,
                               unit.empty() ? "" : " ", unit));
}

}  // namespace qjulia

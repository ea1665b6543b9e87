#include "batch/sweep.hpp"

#include <algorithm>
#include <limits>

namespace qjulia::batch {

std::string label_in_name(std::string text) {
  std::ranges::replace_if(
      text, [](unsigned char c) { return c == '/' || c == '*' || c < ' '; }, '_');
  return text;
}

std::size_t combination_count(const std::vector<SweepAxis>& axes) {
  constexpr std::size_t kMost = std::numeric_limits<std::size_t>::max();
  std::size_t count = 1;
  for (const SweepAxis& axis : axes) {
    if (axis.values.empty()) return 0;
  }
  for (const SweepAxis& axis : axes) {
    if (count > kMost / axis.values.size()) return kMost;
    count *= axis.values.size();
  }
  return count;
}

std::vector<Combination> combinations(std::vector<SweepAxis> axes) {
  std::ranges::sort(axes, {}, &SweepAxis::name);
  std::vector<Combination> all(1);
  for (const SweepAxis& axis : axes) {
    std::vector<Combination> longer;
    longer.reserve(all.size() * axis.values.size());
    for (const Combination& start : all) {
      for (const AxisValue& value : axis.values) {
        Combination next = start;
        next.suffix += '-' + axis.name + value.label;
        if (value.option) next.options.push_back(*value.option);
        longer.push_back(std::move(next));
      }
    }
    all = std::move(longer);
  }
  return all;
}

}  // namespace qjulia::batch

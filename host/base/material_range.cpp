#include "qjulia/base/material_range.hpp"

#include <fmt/format.h>

#include <vector>

#include "base/range_check.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {

std::vector<double> MaterialRange::values() const {
  std::vector<double> all{low};
  all.insert(all.end(), between.begin(), between.end());
  all.push_back(high);
  return all;
}

void MaterialRange::validate() const {
  const std::vector<double> all = values();
  if (all.size() > kMostValues) {
    throw OptionError("range", fmt::format("{} values; give {} at most", all.size(), kMostValues));
  }
  for (const double value : all) base::expect_finite("range", value);
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (all[i - 1] < all[i]) continue;
    throw OptionError("range", all.size() == 2
                                   ? "the palette's beginning is not below its end"
                                   : fmt::format("{} is not below {}: values rise from the "
                                                 "palette's beginning to its end",
                                                 all[i - 1], all[i]));
  }
}

MaterialRange range_of(const std::vector<double>& values) {
  if (values.size() < 2)
    throw InputError(
        "give LOW,HIGH with a comma between them; other values may stand between the two");
  return {values.front(), values.back(), {values.begin() + 1, values.end() - 1}};
}

MaterialRange range_from(const std::string& text) {
  std::vector<double> values;
  for (const std::string& word : base::split(text, ',')) {
    const auto value = base::number_in<double>(word);
    if (!value) throw InputError(fmt::format("'{}' is not a number; give LOW,...,HIGH", word));
    values.push_back(*value);
  }
  return range_of(values);
}

}  // namespace qjulia

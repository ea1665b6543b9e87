#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "qjulia/base/error.hpp"
#include "qjulia/picture/materials.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {
namespace {

/// Shares of the values that lie below the palette's beginning and above its end.
constexpr double kTail = 0.02;
/// Number of parts of a palette, each of which is seen about equally often.
constexpr int kParts = 8;
/// Each part covers at least this share of an even part, so that none is too narrow.
constexpr double kLeastPart = 0.25;
/// A palette is spread over at least this width of the orbits' numbers, which lie in 0 … 1, so that
/// it does not show differences of rounding.
constexpr double kLeastSpread = 1e-3;

/// The nearest values, in the sense of least squares, that rise by at least `gap` each. Equal
/// values are spread evenly about their common value.
std::vector<double> apart(const std::vector<double>& values, double gap) {
  // Less their gaps, the values need only not fall (isotonic regression): neighbours that fall are
  // replaced by their mean.
  struct Pool {
    double sum;
    int count;
    double mean() const { return sum / count; }
  };
  std::vector<Pool> pools;
  for (std::size_t i = 0; i < values.size(); ++i) {
    pools.push_back({values[i] - gap * static_cast<double>(i), 1});
    while (pools.size() > 1 && pools[pools.size() - 2].mean() > pools.back().mean()) {
      const Pool last = pools.back();
      pools.pop_back();
      pools.back().sum += last.sum;
      pools.back().count += last.count;
    }
  }
  std::vector<double> found;
  for (const Pool& pool : pools) {
    for (int k = 0; k < pool.count; ++k) {
      found.push_back(pool.mean() + gap * static_cast<double>(found.size()));
    }
  }
  return found;
}

}  // namespace

MaterialRange range_over(std::vector<float> values, Material material) {
  std::erase_if(values, [](float value) { return !std::isfinite(value); });
  if (values.empty()) return {};
  std::ranges::sort(values);
  const auto quantile = [&](double share) {
    const double place = share * static_cast<double>(values.size() - 1);
    return double{values[static_cast<std::size_t>(std::lround(place))]};
  };
  MaterialRange range{quantile(kTail), quantile(1 - kTail)};
  const double least = facts_of(material).is_length
                           ? 1e-6 * std::max({std::abs(range.low), std::abs(range.high), 1e-3})
                           : kLeastSpread;
  if (range.high - range.low < least) {
    const double middle = 0.5 * (range.low + range.high);
    return {middle - 0.5 * least, middle + 0.5 * least};
  }
  if (!facts_of(material).is_rank) return range;
  std::vector<double> ends;
  for (int part = 0; part <= kParts; ++part) {
    ends.push_back(quantile(std::lerp(kTail, 1 - kTail, static_cast<double>(part) / kParts)));
  }
  ends = apart(ends, kLeastPart * (range.high - range.low) / kParts);
  return {ends.front(), ends.back(), {ends.begin() + 1, ends.end() - 1}};
}

}  // namespace qjulia

#include "morph/matching.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "morph/assignment.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::morph {
namespace {

constexpr double kExponentReach = kMapSide / 6;  // ρ

/// Factors with their centres' W less the slice.
std::vector<Factor> off_slice(const Dynamics& map) {
  std::vector<Factor> factors = map.factors;
  for (Factor& factor : factors) factor.center.w -= map.slice;
  return factors;
}

double mean_exponent(const std::vector<Factor>& factors) {
  double sum = 0;
  for (const Factor& factor : factors) sum += std::abs(factor.exponent);
  return sum > 0 ? sum / static_cast<double>(factors.size()) : 1;
}

}  // namespace

Matching matched(const Dynamics& from, const Dynamics& to, const std::stop_token& stop) {
  const std::vector<Factor> first = off_slice(from), second = off_slice(to);
  const double unit_a = mean_exponent(first), unit_b = mean_exponent(second);
  const std::size_t count = std::max(first.size(), second.size());
  if (count > kMostMorphFactors) {
    throw InputError(fmt::format(
        "a map of the morph has {} factors, and {} is the most that can be paired; refit it "
        "with 'qjulia convert' and `factors_at_most`",
        count, kMostMorphFactors));
  }
  const auto pair_cost = [&](std::size_t i, std::size_t j) {
    const double a = i < first.size() ? first[i].exponent / unit_a : 0;
    const double b = j < second.size() ? second[j].exponent / unit_b : 0;
    const double change = kExponentReach * kExponentReach * (a - b) * (a - b);
    if (i >= first.size() || j >= second.size()) return change;
    const Quaternion way = second[j].center - first[i].center;
    return 0.5 * (std::abs(a) + std::abs(b)) * dot(way, way) + change;
  };
  const std::vector<std::size_t> pair_of = least_cost_pairs(count, pair_cost, stop);

  Matching result;
  std::vector<std::size_t> place(second.size());  // in the product, of the second map's factors
  std::vector<bool> is_placed(second.size());
  for (std::size_t i = 0; i < first.size(); ++i) {
    const std::size_t j = pair_of[i];
    if (j < second.size()) {
      place[j] = result.factors.size();
      is_placed[j] = true;
      ++result.pairs.matched;
      result.factors.push_back({first[i], second[j]});
    } else {
      ++result.pairs.vanishing;
      result.factors.push_back({first[i], {first[i].center, 0}});
    }
  }
  for (std::size_t j = 0; j < second.size(); ++j) {
    if (is_placed[j]) continue;
    const std::size_t at = j == 0 ? 0 : place[j - 1] + 1;
    for (std::size_t k = 0; k < second.size(); ++k) {
      if (is_placed[k] && place[k] >= at) ++place[k];
    }
    place[j] = at;
    is_placed[j] = true;
    ++result.pairs.appearing;
    result.factors.insert(result.factors.begin() + static_cast<std::ptrdiff_t>(at),
                          {{second[j].center, 0}, second[j]});
  }
  return result;
}

}  // namespace qjulia::morph

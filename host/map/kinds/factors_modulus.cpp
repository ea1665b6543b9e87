#include <algorithm>
#include <cmath>
#include <numeric>

#include "qjulia/map/map.hpp"

namespace qjulia {

double FactorsModulus::cost(const Dynamics& map) {
  return static_cast<double>(std::max<std::size_t>(1, map.factors.size()));
}

double FactorsVersor::cost(const Dynamics& map) { return 4 * FactorsModulus::cost(map); }

double FactorsModulus::degree(const Dynamics& map) {
  return std::accumulate(map.factors.begin(), map.factors.end(), 0.0,
                         [](double sum, const Factor& factor) { return sum + factor.exponent; });
}

/// With |q| = R > |c_k|, a root has ln |q − c| ≥ ln(R − |c|) and a pole ln |q − c| ≤ ln(R + |c|);
/// the sum of these bounds less ln R grows with R when Σ a_k > 1, so its zero is found by bisection
/// in ln R.
OuterBound FactorsModulus::outer_bound(const Dynamics& map) {
  double reach = 0;
  for (const Factor& factor : map.factors) reach = std::max(reach, norm(factor.center));
  const auto excess = [&](double log_radius) {
    double sum = map.log_scale - log_radius;
    for (const auto& [center, exponent] : map.factors) {
      const double c = exponent > 0 ? -norm(center) : norm(center);
      sum += exponent * (log_radius + std::log1p(c * std::exp(-log_radius)));
    }
    return sum;
  };
  constexpr double kLargestLog = 30;
  double low = std::log(std::max(reach, 1e-6)) + 1e-9;
  double high = low + 1;
  while (excess(high) <= 0 && high < kLargestLog) high += 1;
  for (int step = 0; step < 50; ++step) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0 ? high : low) = middle;
  }
  return {std::exp(high), false};
}

}  // namespace qjulia

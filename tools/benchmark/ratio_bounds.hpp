#pragma once
/// The ratio of two durations, estimated from a few runs of each.

#include <cstddef>
#include <optional>
#include <vector>

namespace qjulia::benchmark {

struct RatioBounds {
  double low = 0;
  double estimate = 0;  ///< median of the ratios of all pairs of runs (Hodges and Lehmann)
  double high = 0;
};

/// The chance that U, of Mann and Whitney, is at most `u` for two samples of one distribution: of
/// all pairs, as many or fewer have the first's value above the second's. Exact up to 2,500 pairs,
/// by the normal distribution beyond.
double mann_whitney_chance(std::size_t first, std::size_t second, std::size_t u);

/// Bounds of after / before. It is assumed only that runs are independent and that both have the
/// same distribution up to the ratio.
/// @param before, after seconds, positive and finite.
/// @param error the largest probability that the ratio lies below `low`, and likewise above `high`;
///   0 … ½.
/// @return nothing where there are too few runs for any bound.
/// O(k log k) for k pairs of runs, O(k min(before, after)) where the chance is exact.
std::optional<RatioBounds> ratio_bounds(const std::vector<double>& before,
                                        const std::vector<double>& after, double error);

}  // namespace qjulia::benchmark

#pragma once
/// What a few runs say about the figure around which they scatter.

#include <vector>

namespace qjulia::profiling {

struct Interval {
  double low = 0;
  double middle = 0;  ///< the median; of an even number of values, the geometric mean of two
  double high = 0;
};

/// Fewer runs allow no interval of `kIntervalConfidence`.
constexpr int kLeastRuns = 5;
/// The probability that the median of the distribution of the runs lies in an interval.
constexpr double kIntervalConfidence = 0.9;

/// The interval between the k-th lowest and the k-th highest value, with the largest k for which a
/// binomial variable of n and ½ is below k with a probability of at most 5 %. It is assumed only
/// that the runs are independent. With fewer than `kLeastRuns` values it is their whole range,
/// which has the probability 1 − 2^(1 − n).
/// @param values positive, at least one.
Interval interval_of_median(std::vector<double> values);

}  // namespace qjulia::profiling

#include "benchmark/ratio_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace qjulia::benchmark {
namespace {

constexpr std::size_t kMostExactPairs = 2500;

/// The share of all orders of two samples that has each U: coefficients of a Gaussian binomial,
/// divided by their sum.
std::vector<double> exact_chances(std::size_t first, std::size_t second) {
  const std::size_t pairs = first * second;
  const std::size_t few = std::min(first, second), many = std::max(first, second);
  std::vector<long double> ways(pairs + 1, 0);
  ways[0] = 1;
  // Times (1 - q^(many + i)) / (1 - q^i) for every i.
  for (std::size_t i = 1; i <= few; ++i) {
    for (std::size_t u = pairs + 1; u-- > many + i;) ways[u] -= ways[u - many - i];
    for (std::size_t u = i; u <= pairs; ++u) ways[u] += ways[u - i];
  }
  const long double all = std::accumulate(ways.begin(), ways.end(), 0.0L);
  std::vector<double> chances;
  chances.reserve(ways.size());
  for (const long double way : ways) chances.push_back(static_cast<double>(way / all));
  return chances;
}

double normal_chance(std::size_t first, std::size_t second, std::size_t u) {
  const auto m = static_cast<double>(first), n = static_cast<double>(second);
  const double deviation = std::sqrt(m * n * (m + n + 1) / 12);
  return 0.5 * std::erfc((m * n / 2 - static_cast<double>(u) - 0.5) / (deviation * std::sqrt(2.0)));
}

/// The largest k so that U < k has a chance of `error` at most.
std::size_t rank_of_bound(std::size_t first, std::size_t second, double error) {
  const std::size_t pairs = first * second;
  const bool is_exact = pairs <= kMostExactPairs;
  const std::vector<double> chances =
      is_exact ? exact_chances(first, second) : std::vector<double>();
  double below = 0;
  for (std::size_t u = 0; u < pairs / 2; ++u) {
    below = is_exact ? below + chances[u] : normal_chance(first, second, u);
    if (below > error) return u;
  }
  return pairs / 2;
}

}  // namespace

double mann_whitney_chance(std::size_t first, std::size_t second, std::size_t u) {
  if (u >= first * second) return 1;
  if (first * second > kMostExactPairs) return normal_chance(first, second, u);
  const auto chances = exact_chances(first, second);
  return std::accumulate(chances.begin(), chances.begin() + static_cast<std::ptrdiff_t>(u) + 1,
                         0.0);
}

std::optional<RatioBounds> ratio_bounds(const std::vector<double>& before,
                                        const std::vector<double>& after, double error) {
  if (before.empty() || after.empty()) return std::nullopt;
  const std::size_t rank = rank_of_bound(before.size(), after.size(), error);
  if (rank == 0) return std::nullopt;
  std::vector<double> ratios;
  ratios.reserve(before.size() * after.size());
  for (const double y : after) {
    for (const double x : before) ratios.push_back(y / x);
  }
  std::ranges::sort(ratios);
  const std::size_t half = ratios.size() / 2;
  const double middle =
      ratios.size() % 2 == 1 ? ratios[half] : std::sqrt(ratios[half - 1] * ratios[half]);
  return RatioBounds{ratios[rank - 1], middle, ratios[ratios.size() - rank]};
}

}  // namespace qjulia::benchmark

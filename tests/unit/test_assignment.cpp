// Pairs of least cost, against all permutations, and at the size of a large map.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <numeric>

#include "base/random.hpp"
#include "morph/assignment.hpp"

using namespace qjulia;

namespace {

double total(const std::vector<double>& costs, const std::vector<std::size_t>& column_of) {
  double sum = 0;
  for (std::size_t i = 0; i < column_of.size(); ++i) {
    sum += costs[i * column_of.size() + column_of[i]];
  }
  return sum;
}

std::vector<double> random_costs(std::size_t count, base::Random& random) {
  std::vector<double> costs(count * count);
  for (double& c : costs) c = random.uniform(-1, 3);
  return costs;
}

std::vector<std::size_t> pairs_of(const std::vector<double>& costs, std::size_t count) {
  return morph::least_cost_pairs(
      count, [&](std::size_t i, std::size_t j) { return costs[i * count + j]; });
}

}  // namespace

TEST_CASE("no permutation costs less than the pairs") {
  base::Random random(3);
  for (std::size_t count = 0; count <= 7; ++count) {
    for (int round = 0; round < 20; ++round) {
      CAPTURE(count, round);
      std::vector<double> costs = random_costs(count, random);
      if (round % 4 == 3) {  // equal costs
        for (double& c : costs) c = std::round(c);
      }
      std::vector<std::size_t> order(count);
      std::iota(order.begin(), order.end(), std::size_t{0});
      double least = total(costs, order);
      while (std::ranges::next_permutation(order).found) {
        least = std::min(least, total(costs, order));
      }
      std::vector<std::size_t> found = pairs_of(costs, count);
      CHECK(total(costs, found) == Catch::Approx(least).margin(1e-12));
      std::ranges::sort(found);
      std::iota(order.begin(), order.end(), std::size_t{0});
      CHECK(found == order);
    }
  }
}

TEST_CASE("992 pairs ask for each cost once") {
  base::Random random(4);
  const std::size_t count = 992;
  const std::vector<double> costs = random_costs(count, random);
  std::size_t calls = 0;
  const std::vector<std::size_t> found =
      morph::least_cost_pairs(count, [&](std::size_t i, std::size_t j) {
        ++calls;
        return costs[i * count + j];
      });
  CHECK(calls == count * count);
  // Random costs of −1 … 3: the sum is about −count + 4 · 1.6.
  CHECK(total(costs, found) < -0.97 * static_cast<double>(count));
}

// The power of balls at the points of a grid, against all pairs.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>

#include "base/random.hpp"
#include "measure/outline.hpp"

using namespace qjulia;

TEST_CASE("the power of balls is the least over all of them") {
  base::Random random(1);
  for (const Eigen::Vector3i& points : {Eigen::Vector3i{9, 7, 8}, {1, 12, 3}, {5, 1, 1}}) {
    const surface::Grid grid{{-1, 2, 0.5}, 0.25, points};
    std::vector<Eigen::Vector3d> places;
    std::vector<double> radius;
    for (int z = 0; z < points.z(); ++z) {
      for (int y = 0; y < points.y(); ++y) {
        for (int x = 0; x < points.x(); ++x) {
          places.push_back(grid.point({x, y, z}));
          radius.push_back(random.uniform(0, 1) < 0.05 ? random.uniform(0.1, 0.9) : 0);
        }
      }
    }
    const std::vector<double> power = surface::power_of_balls(grid, radius);
    REQUIRE(power.size() == places.size());
    double largest = 0;  // difference
    for (std::size_t i = 0; i < places.size(); ++i) {
      double least = std::numeric_limits<double>::infinity();
      for (std::size_t j = 0; j < places.size(); ++j) {
        if (radius[j] <= 0) continue;
        least = std::min(least, (places[i] - places[j]).squaredNorm() - radius[j] * radius[j]);
      }
      if (power[i] != least) largest = std::max(largest, std::abs(power[i] - least));
    }
    CHECK(largest < 1e-12);
  }
  const surface::Grid empty{{0, 0, 0}, 1, {2, 2, 2}};
  CHECK(surface::power_of_balls(empty, std::vector<double>(8)).front() ==
        std::numeric_limits<double>::infinity());
}

// Which points of a grid balls cover, against all pairs.

#include <catch2/catch_all.hpp>

#include "base/random.hpp"
#include "measure/outline.hpp"

using namespace qjulia;

TEST_CASE("balls cover the points that are no farther than their radii") {
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
    const std::vector<bool> covered = surface::covered_by_balls(grid, radius);
    REQUIRE(covered.size() == places.size());
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      bool is_covered = false;
      for (std::size_t j = 0; j < places.size(); ++j) {
        is_covered = is_covered || (radius[j] > 0 && (places[i] - places[j]).norm() <= radius[j]);
      }
      if (covered[i] != is_covered) ++wrong;
    }
    CHECK(wrong == 0);
  }
  const surface::Grid empty{{0, 0, 0}, 1, {2, 2, 2}};
  CHECK(surface::covered_by_balls(empty, std::vector<double>(8)) == std::vector<bool>(8));
}

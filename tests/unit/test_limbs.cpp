// Limbs of solids built by hand.

#include <catch2/catch_all.hpp>
#include <functional>
#include <vector>

#include "measure/limbs.hpp"

using namespace qjulia;
using namespace qjulia::surface;
using Eigen::Vector3d;

namespace {

const Grid kGrid{Vector3d::Constant(-2), 0.05, {81, 81, 81}};

/// A ball of radius 0.6 with arms along x and y as long as given, 0.2 thick, and a gap in them.
std::vector<bool> star(double left, double right, double up, double gap_at = 9) {
  std::vector<bool> is_inside;
  for (int k = 0; k < 81; ++k) {
    for (int j = 0; j < 81; ++j) {
      for (int i = 0; i < 81; ++i) {
        const Vector3d p = kGrid.at(Vector3d(i, j, k));
        const bool on_x = std::abs(p.y()) < 0.1 && std::abs(p.z()) < 0.1 && p.x() > -left &&
                          p.x() < right && std::abs(p.x() - gap_at) > 0.08;
        const bool on_y = std::abs(p.x()) < 0.1 && std::abs(p.z()) < 0.1 && p.y() > 0 && p.y() < up;
        is_inside.push_back(p.norm() < 0.6 || on_x || on_y);
      }
    }
  }
  return is_inside;
}

int limbs(const std::vector<bool>& is_inside) {
  return static_cast<int>(find_limbs(kGrid, is_inside, 0.3).size());
}

}  // namespace

TEST_CASE("each arm of a star is a limb, and a ball has none") {
  CHECK(limbs(star(0, 0, 0)) == 0);
  CHECK(limbs(star(1.7, 0, 0)) == 1);
  CHECK(limbs(star(1.7, 1.5, 0)) == 2);
  CHECK(limbs(star(1.7, 1.5, 1.2)) == 3);
  // Too short.
  CHECK(limbs(star(1.7, 0.8, 0)) == 1);
  CHECK(limbs(std::vector<bool>(81 * 81 * 81)) == 0);
}

TEST_CASE("limbs are kept where they reach nearly as far and hang on the body") {
  const auto whole = star(1.7, 1.7, 1.7);
  const auto found = find_limbs(kGrid, whole, 0.3);
  REQUIRE(found.size() == 3);
  const auto kept = [&](const std::vector<bool>& is_inside) {
    return limbs_kept(found, kGrid, is_inside);
  };
  CHECK(kept(whole) == 3);
  CHECK(kept(star(1.6, 1.6, 1.6)) == 3);
  CHECK(kept(star(1.6, 1.6, 1.1)) == 2);
  CHECK(kept(star(1.7, 1.7, 1.7, 1.0)) == 2);  // cut off
  CHECK(kept(star(0, 0, 0)) == 0);
  CHECK(kept(std::vector<bool>(81 * 81 * 81)) == 0);
}

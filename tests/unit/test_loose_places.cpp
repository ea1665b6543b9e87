// Loose pieces of sets built by hand.

#include <algorithm>
#include <bit>
#include <catch2/catch_all.hpp>
#include <functional>
#include <numbers>

#include "surface/loose_places.hpp"

using namespace qjulia;
using namespace qjulia::surface;
using Eigen::Vector3d;

namespace {

using Solid = std::function<bool(const Vector3d&)>;

Solid solid_ball(const Vector3d& center, double radius) {
  return [=](const Vector3d& p) { return (p - center).norm() < radius; };
}

/// A rod along x.
Solid rod(double from, double to, double y, double half) {
  return [=](const Vector3d& p) {
    return p.x() > from && p.x() < to && std::abs(p.y() - y) < half && std::abs(p.z()) < half;
  };
}

Solid together(std::vector<Solid> solids) {
  return [=](const Vector3d& p) {
    return std::ranges::any_of(solids, [&](const Solid& solid) { return solid(p); });
  };
}

/// -2 ... 2 along each axis, `cells` a side.
Grid grid_of(int cells) {
  return {Vector3d::Constant(-2), 4.0 / cells, {cells + 1, cells + 1, cells + 1}};
}

Insides insides_of(const Solid& solid) {
  return [=](const std::vector<Vector3d>& points) {
    std::vector<bool> found;
    for (const Vector3d& p : points) found.push_back(solid(p));
    return found;
  };
}

LoosePlaces found_in(const Solid& solid, int cells = 40, int divisions = 3) {
  const Grid grid = grid_of(cells);
  std::vector<bool> is_inside;
  for (int k = 0; k <= cells; ++k) {
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) is_inside.push_back(solid(grid.at(Vector3d(i, j, k))));
    }
  }
  const std::vector<bool> anywhere(is_inside.size(), true);
  return find_loose_places(grid, is_inside, anywhere, divisions, insides_of(solid));
}

/// How many points of a lattice of step 0.004 over a box are in this solid and in the places.
struct Held {
  int all = 0, held = 0;
};
Held held_of(const Solid& solid, const LoosePlaces& places, const Vector3d& low,
             const Vector3d& high) {
  Held found;
  const double step = 0.004;
  for_points(((high - low) / step).cast<int>(), [&](std::size_t, const Eigen::Vector3i& index) {
    // Off the planes that points of the grids lie in.
    const Vector3d p = low + step * (index.cast<double>() + Vector3d(0.31, 0.43, 0.57));
    if (!solid(p)) return;
    ++found.all;
    if (places.holds(p)) ++found.held;
  });
  return found;
}

bool everywhere(const Vector3d&, double) { return true; }

}  // namespace

TEST_CASE("a small ball beside a large one is loose, and nothing of the large one is") {
  const Vector3d aside(1.6, 0.3, -0.2);
  const Solid large = solid_ball({-0.3, 0, 0}, 1), small = solid_ball(aside, 0.2);
  const LoosePlaces places = found_in(together({large, small}));
  REQUIRE(places.pieces.count == 1);
  const double volume = 4.0 / 3 * std::numbers::pi * 0.008;
  CHECK(places.pieces.volume == Catch::Approx(volume).epsilon(0.05));
  CHECK(places.pieces.share == Catch::Approx(0.008 / 1.008).epsilon(0.05));
  const int cells = 160;
  const Grid fine = grid_of(cells);
  int missed = 0, taken = 0, held = 0;
  for (int k = 0; k <= cells; ++k) {
    for (int j = 0; j <= cells; ++j) {
      for (int i = 0; i <= cells; ++i) {
        const Vector3d p = fine.at(Vector3d(i, j, k));
        if (places.holds(p)) ++held;
        if (small(p) && !places.holds(p)) ++missed;
        if (large(p) && places.holds(p)) ++taken;
      }
    }
  }
  CHECK(missed == 0);
  CHECK(taken == 0);
  // A margin about the ball, no more.
  CHECK(held * std::pow(fine.step, 3) < 6 * volume);
  CHECK_FALSE(places.holds({50, 0, 0}));
}

TEST_CASE("what hangs on a body by less than a cell is kept") {
  const Solid large = solid_ball({-0.8, 0, 0}, 1), small = solid_ball({1.2, 0.05, 0}, 0.2);
  // Between two rows of the coarse grid's points, whose step is 0.1; the fine one's is a third.
  const Solid neck = rod(0, 1.2, 0.05, 0.03);
  CHECK(found_in(together({large, small})).pieces.count == 1);
  CHECK(found_in(together({large, small, neck})).pieces.count == 0);
  // Broken in the middle, both ends hang on what they hung on.
  const Solid broken = together({large, small, rod(0, 0.6, 0.05, 0.03), rod(0.7, 1.2, 0.05, 0.03)});
  const LoosePlaces places = found_in(broken);
  CHECK(places.pieces.count == 1);
  CHECK(places.holds({1.2, 0.05, 0}));
  CHECK(places.holds({0.8, 0.05, 0}));
  CHECK_FALSE(places.holds({0.5, 0.05, 0}));
}

TEST_CASE("bodies of a hundredth of the largest and more are kept, each of them") {
  const Solid large = solid_ball({-0.8, 0, 0}, 1);
  CHECK(found_in(together({large, solid_ball({1.2, 0, 0}, 0.24), solid_ball({1.2, 1.2, 0}, 0.3)}))
            .pieces.count == 0);
  CHECK(found_in(together({large, solid_ball({1.2, 0, 0}, 0.19), solid_ball({1.2, 1.2, 0}, 0.3)}))
            .pieces.count == 1);
}

TEST_CASE("crumbs between the points of the coarse grid are found") {
  const Solid crumb = solid_ball({1.25, 0.05, 0.05}, 0.04);
  const LoosePlaces places = found_in(together({solid_ball({-0.8, 0, 0}, 1), crumb}));
  CHECK(places.pieces.count == 1);
  CHECK(places.holds({1.25, 0.05, 0.05}));
}

TEST_CASE("where nothing is loose, or nothing is at all, there are no places") {
  for (const Solid& solid :
       {solid_ball({0, 0, 0}, 1), solid_ball({9, 0, 0}, 1), solid_ball({0, 0, 0}, 9)}) {
    const LoosePlaces places = found_in(solid, 20);
    CHECK(places.pieces.count == 0);
    CHECK(places.bits.empty());
    CHECK_FALSE(places.holds({0, 0, 0}));
  }
}

TEST_CASE("a piece at the end of the grid is found, and nothing beyond it is asked for") {
  const LoosePlaces places =
      found_in(together({solid_ball({0.5, 0, 0}, 1), solid_ball({-2, -2, -2}, 0.25)}));
  CHECK(places.pieces.count == 1);
  CHECK(places.holds({-1.9, -1.9, -1.9}));
}

TEST_CASE("a sheet of the body beside a loose piece is whole when looked at more finely") {
  // The sheet lies between two planes of the grid that pieces are found on, whose step is 1 / 30.
  const Solid sheet = [](const Vector3d& p) {
    return p.x() > 0 && p.x() < 1.5 && std::abs(p.y() - 0.05) < 0.012 && std::abs(p.z()) < 0.3;
  };
  const Solid flake = solid_ball({1.3, 0.16, 0}, 0.06);
  const Solid all = together({solid_ball({-0.3, 0, 0}, 1), sheet, flake});
  LoosePlaces places = found_in(all);
  REQUIRE(places.pieces.count == 1);
  const Vector3d low(1, -0.05, -0.2), high(1.5, 0.3, 0.2);
  CHECK(held_of(sheet, places, low, high).held > 500);
  look_finer(places, 8, everywhere, insides_of(all));
  CHECK(places.finer == 8);
  const Held of_sheet = held_of(sheet, places, low, high),
             of_flake = held_of(flake, places, low, high);
  CHECK(of_sheet.all > 5000);
  CHECK(of_sheet.held == 0);
  CHECK(of_flake.all > 5000);
  CHECK(of_flake.held == of_flake.all);
  // If nothing is in sight, the finer look finds nothing.
  look_finer(
      places, 8, [](const Vector3d&, double) { return false; }, insides_of(all));
  CHECK(held_of(sheet, places, low, high).held > 500);
}

TEST_CASE("a piece on a thread is loose until it is looked at as finely as the thread is thick") {
  // The thread is slanted, so that no edge of the finer grid runs along it.
  const Solid thread = [](const Vector3d& p) {
    const double y = 0.045 + 0.05 * (p.x() - 0.7), z = 0.02;
    return p.x() > 0 && p.x() < 1.3 && std::hypot(p.y() - y, p.z() - z) < 0.006;
  };
  const Solid flake = solid_ball({1.3, 0.07, 0}, 0.07);
  const Solid all = together({solid_ball({-0.3, 0, 0}, 1), thread, flake});
  LoosePlaces places = found_in(all);
  REQUIRE(places.pieces.count == 1);
  CHECK(places.holds({1.3, 0.07, 0}));
  look_finer(places, 2, everywhere, insides_of(all));
  CHECK(places.holds({1.3, 0.07, 0}));
  look_finer(places, 8, everywhere, insides_of(all));
  CHECK_FALSE(places.holds({1.3, 0.07, 0}));
}

TEST_CASE("what a finer look says of a piece does not depend on how much of it is in sight") {
  const Solid piece = rod(1, 1.9, 0.4, 0.05), other = solid_ball({0, 1.5, 0}, 0.1);
  const Solid all = together({solid_ball({-0.3, 0, 0}, 1), piece, other});
  LoosePlaces whole = found_in(all), end = whole;
  REQUIRE(whole.pieces.count == 2);
  look_finer(whole, 4, everywhere, insides_of(all));
  look_finer(
      end, 4, [](const Vector3d& p, double reach) { return p.x() > 1.9 - reach; }, insides_of(all));
  CHECK(end.finer_bits.size() < whole.finer_bits.size());
  int differ = 0, held = 0;
  for_points({300, 100, 100}, [&](std::size_t, const Eigen::Vector3i& index) {
    const Vector3d p = Vector3d(0.8, 0.2, -0.2) + 0.00402 * index.cast<double>();
    if (end.holds(p)) ++held;
    if (end.holds(p) != whole.holds(p)) ++differ;
  });
  CHECK(held > 10000);
  CHECK(differ == 0);
}

TEST_CASE("a finer look is less fine where it would take too many points") {
  // Slabs of a loose lattice that fill much of the grid beside a large ball.
  std::vector<Solid> solids{solid_ball({-0.6, 0, 0}, 1.2)};
  for (int i = 0; i < 40; ++i) {
    solids.push_back(solid_ball({1.8, -1.8 + 0.4 * (i % 10), -1.5 + (i / 10)}, 0.12));
  }
  const Solid all = together(solids);
  LoosePlaces places = found_in(all);
  REQUIRE(places.pieces.count == 40);
  look_finer(places, 16, everywhere, insides_of(all));
  CHECK(places.finer > 1);
  CHECK(places.finer < 16);
  CHECK(places.holds({1.8, -1.8, -1.5}));
}

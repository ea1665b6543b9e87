// The box in which a set is meshed, found on fields that are known.

#include <catch2/catch_all.hpp>
#include <stop_token>

#include "lattice/clear_box.hpp"
#include "qjulia/base/error.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

/// The signed distance to a ball, at every point of a block.
surface::GridField ball(const Vector3d& center, double radius) {
  return [=](const surface::Grid& grid, const surface::GridBlock& block) {
    std::vector<float> values;
    for (int k = 0; k < block.count[2]; ++k) {
      for (int j = 0; j < block.count[1]; ++j) {
        for (int i = 0; i < block.count[0]; ++i) {
          const Vector3d index(block.first[0] + i, block.first[1] + j, block.first[2] + k);
          values.push_back(static_cast<float>((grid.at(index) - center).norm() - radius));
        }
      }
    }
    return values;
  };
}

bool same(const Box& a, const Box& b) { return a.low == b.low && a.high == b.high; }

constexpr double kFar = 100;

}  // namespace

TEST_CASE("a grid covers its box, centred on it") {
  const Box box{{-1, 0, 2}, {2, 1.5, 3}};
  const surface::Grid grid = surface::grid_over(box, 30);
  CHECK(grid.step == Catch::Approx(0.1));
  // Sides of 30, 15 and 10 whole cells.
  CHECK(grid.points == Eigen::Vector3i(31, 16, 11));
  const surface::Grid coarse = surface::grid_over(box, 7);
  const Vector3d last =
      coarse.at(Vector3d(coarse.points[0] - 1, coarse.points[1] - 1, coarse.points[2] - 1));
  CHECK(((coarse.origin.array() <= box.low.array() + 1e-12).all()));
  CHECK(((last.array() >= box.high.array() - 1e-12).all()));
  CHECK((0.5 * (coarse.origin + last) - box.center()).norm() < 1e-12);
  CHECK((last - coarse.origin - box.size()).maxCoeff() < coarse.step);
}

TEST_CASE("a box that is clear of the set stays as it is") {
  const Box box{{-1.5, -1.2, -1.1}, {1.3, 1.1, 1.6}};
  const auto clear = surface::enlarged_until_clear(ball({0, 0, 0}, 1), 0, box, 40, kFar, {});
  CHECK(same(clear, box));
  // At a level above, the same set is larger, and touches.
  const auto larger = surface::enlarged_until_clear(ball({0, 0, 0}, 1), 0.3, box, 40, kFar, {});
  CHECK_FALSE(same(larger, box));
}

TEST_CASE("only the sides that the set touches move, until they are clear") {
  const Box box{{-1.5, -1.5, -1.5}, {0.45, 1.5, 0.9}};
  const auto clear = surface::enlarged_until_clear(ball({0, 0, 0}, 1), 0, box, 64, kFar, {});
  CHECK(clear.low == box.low);
  CHECK(clear.high.y() == box.high.y());
  // Beyond the ball, by no more than one step of growth: a tenth of the longest side.
  const double growth = 0.1 * clear.size().maxCoeff();
  for (const int axis : {0, 2}) {
    CHECK(clear.high[axis] > 1);
    CHECK(clear.high[axis] < 1 + growth);
  }
}

TEST_CASE("a set that reaches beyond the limit is refused") {
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  CHECK_THROWS_AS(surface::enlarged_until_clear(ball({0, 0, 0}, 50), 0, box, 16, 20, {}), Error);
  CHECK_NOTHROW(surface::enlarged_until_clear(ball({0, 0, 0}, 5), 0, box, 16, 20, {}));
}

TEST_CASE("a stop request ends the search for a clear box") {
  std::stop_source stop;
  int evaluations = 0;
  const auto counted = [&](const surface::Grid& grid, const surface::GridBlock& block) {
    if (++evaluations == 3) stop.request_stop();
    return ball({0, 0, 0}, 5)(grid, block);
  };
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  CHECK_THROWS_AS(surface::enlarged_until_clear(counted, 0, box, 16, kFar, {{}, stop.get_token()}),
                  Interrupted);
  CHECK(evaluations == 3);
}

TEST_CASE("a box shrinks to the set in it, with two cells of margin") {
  const Box box{{-4, -4, -4}, {4, 4, 4}};
  const Vector3d center(1.03, -0.46, 0.29);
  const Box shrunk = surface::shrunk_to_inside(ball(center, 1), 0, box);
  const double cell = 8.0 / 64;
  for (int axis = 0; axis < 3; ++axis) {
    // The outermost inside points lie within a cell of the ball's extent.
    CHECK(shrunk.low[axis] < center[axis] - 1 - cell);
    CHECK(shrunk.low[axis] > center[axis] - 1 - 2 * cell);
    CHECK(shrunk.high[axis] > center[axis] + 1 + cell);
    CHECK(shrunk.high[axis] < center[axis] + 1 + 2 * cell);
  }
  CHECK(same(surface::shrunk_to_inside(ball({9, 9, 9}, 1), 0, box), box));
}

#include <array>
#include <catch2/catch_all.hpp>

#include "base/larger_error.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/shape.hpp"
#include "shapes.hpp"

using namespace qjulia;

TEST_CASE("surface samples are uniform by area, on the surface, with outward normals") {
  // Sides of area 2, 3 and 6, twice each.
  const TriangleMesh mesh = shapes::box({0, 0, 0}, {3, 2, 1});
  constexpr std::size_t kCount = 44000;
  const auto points = sample_surface(mesh, kCount, 11);
  REQUIRE(points.size() == kCount);
  std::array<std::size_t, 6> on_side{};
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double worst = 0;
  for (const auto& [x, n] : points) {
    Eigen::Index axis = 0;
    worst = base::larger_error(worst, std::abs(n.cwiseAbs().maxCoeff(&axis) - 1));
    const bool high = n[axis] > 0;
    worst = base::larger_error(worst,
                               std::abs(x[axis] - (high ? mesh.box().high : mesh.box().low)[axis]));
    ++on_side[static_cast<std::size_t>(2 * axis) + (high ? 1 : 0)];
    sum += x;
  }
  CHECK(worst < 1e-12);
  constexpr std::array<double, 6> kShares = {2, 2, 3, 3, 6, 6};
  for (std::size_t side = 0; side < 6; ++side) {
    const double expected = kCount * kShares[side] / 22;
    CHECK(std::abs(static_cast<double>(on_side[side]) - expected) < 4 * std::sqrt(expected));
  }
  CHECK((sum / kCount - mesh.box().center()).cwiseAbs().maxCoeff() < 0.02);
}

TEST_CASE("within one triangle, surface samples are uniform") {
  const TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}};
  constexpr std::size_t kCount = 40000;
  std::array<std::size_t, 4> part{};  // the four half-size triangles
  for (const auto& [x, n] : sample_surface(mesh, kCount, 1)) {
    if (x.x() > 0.5)
      ++part[0];
    else if (x.y() > 0.5)
      ++part[1];
    else if (x.x() + x.y() < 0.5)
      ++part[2];
    else
      ++part[3];
  }
  for (const auto count : part) CHECK(std::abs(static_cast<double>(count) - 10000) < 400);
}

TEST_CASE("surface samples repeat with the seed and differ without") {
  const TriangleMesh mesh = shapes::torus();
  const auto a = sample_surface(mesh, 100, 5);
  const auto b = sample_surface(mesh, 100, 5);
  const auto c = sample_surface(mesh, 100, 6);
  std::size_t same = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    CHECK(a[i].position == b[i].position);
    if (a[i].position == c[i].position) ++same;
  }
  CHECK(same == 0);
  CHECK_THROWS_AS(sample_surface({}, 10, 1), InputError);
}

#include <catch2/catch_all.hpp>
#include <random>

#include "base/larger_error.hpp"
#include "distance_reference.hpp"
#include "qjulia/mesh/shape.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

/// Points all through 1.5 times the box, and as many close to the surface.
std::vector<Eigen::Vector3d> probes(const TriangleMesh& mesh, std::size_t count) {
  std::mt19937 random(7);
  const auto centred = [&] { return shapes::centred(random); };
  const Box box = mesh.box();
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = centred();
    const double y = centred();
    points.emplace_back(box.center() +
                        0.75 * box.size().cwiseProduct(Eigen::Vector3d(x, y, centred())));
  }
  for (const auto& [x, n] : sample_surface(mesh, count, 3)) {
    points.emplace_back(x + 0.02 * centred() * box.diagonal() * n);
  }
  return points;
}

struct Worst {
  double distance = 0;  ///< over the box's diagonal
  double winding = 0;
  std::size_t wrong_sides = 0;  ///< of the points where the winding number is clear of 1/2
};

Worst compare_with_brute_force(const Device& device, const TriangleMesh& mesh,
                               Precision precision = Precision::single) {
  const SignedDistance signed_distance(device, mesh, precision);
  const auto points = probes(mesh, test::sweep_size(512));
  const auto distances = signed_distance.at(points);
  const auto windings = signed_distance.winding_numbers(points);
  const double turn = signed_volume(mesh) < 0 ? -1 : 1;
  Worst worst;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double distance = reference::distance(mesh, points[i]);
    const double winding = turn * reference::winding_number(mesh, points[i]);
    worst.distance =
        base::larger_error(worst.distance, std::abs(std::abs(distances[i]) - distance));
    // Across the surface the winding number jumps, and rounding may cross it.
    if (distance > 1e-6 * mesh.box().diagonal()) {
      worst.winding = base::larger_error(worst.winding, std::abs(windings[i] - winding));
    }
    if (std::abs(winding - 0.5) > 0.1 && (winding > 0.5) != (distances[i] < 0)) ++worst.wrong_sides;
  }
  worst.distance /= mesh.box().diagonal();
  return worst;
}

void check_against_brute_force(const Device& device, const TriangleMesh& mesh) {
  const Worst worst = compare_with_brute_force(device, mesh);
  CHECK(worst.distance < 1e-6);
  CHECK(worst.winding < 0.1);
  CHECK(worst.wrong_sides == 0);
}

}  // namespace

TEST_CASE("signed distance agrees with brute force at every lane width") {
  const int width = GENERATE(from_range(test::lane_widths()));
  const Device device = test::shared_device().with_lane_width(width);
  CAPTURE(width);
  SECTION("sphere") { check_against_brute_force(device, shapes::sphere(3)); }
  SECTION("torus") { check_against_brute_force(device, shapes::torus()); }
  SECTION("box") { check_against_brute_force(device, shapes::box({0, 0, 0}, {3, 1, 0.2})); }
  SECTION("open box") { check_against_brute_force(device, shapes::open_box()); }
  SECTION("inside out") { check_against_brute_force(device, shapes::inside_out(shapes::torus())); }
  SECTION("holes") { check_against_brute_force(device, shapes::with_holes(shapes::sphere(3), 9)); }
  SECTION("soup") { check_against_brute_force(device, shapes::soup(shapes::torus(), 0.01)); }
  SECTION("one triangle") {
    check_against_brute_force(device, {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}});
  }
  SECTION("tiny and far away") {
    check_against_brute_force(device, shapes::moved(shapes::torus(), 1e-3, {1e3, -2e3, 5e2}));
  }
}

TEST_CASE("signed distance in double precision") {
  if (!test::can_check(test::shared_device(), Precision::dbl)) return;
  const Worst worst =
      compare_with_brute_force(test::shared_device(), shapes::torus(), Precision::dbl);
  CHECK(worst.distance < 1e-14);
  CHECK(worst.winding < 0.1);
}

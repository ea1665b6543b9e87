// Cameras that dive into portals.

#include <catch2/catch_all.hpp>

#include "film/dive.hpp"
#include "qjulia/base/error.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;
using Eigen::Vector3d;

namespace {

Map map_with(const Portal& portal) {
  Map map;
  map.dynamics.factors = {{{}, 12}};
  map.frame.shape_to_map = {1.5, {0.1, -0.2, 0.3}};
  map.layers.portals = {{{5, 5, 5}, 0.1, 2, {}, {0, 0, 0}, PortalMask::none}, portal};
  return map;
}

/// The eye of a camera about the y axis.
Vector3d eye_of(const Camera& camera) {
  constexpr double kDegree = 3.14159265358979 / 180;
  const double a = camera.azimuth * kDegree, e = camera.elevation * kDegree;
  return *camera.look_at + *camera.distance * Vector3d(std::cos(e) * std::sin(a), std::sin(e),
                                                       std::cos(e) * std::cos(a));
}

std::string refusal(const Portal& portal, std::size_t number = 2) {
  try {
    film::Dive(map_with(portal), number, UpAxis::y);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a portal brings the end of a dive to its beginning") {
  const Portal portal{{0.3, 2, 0.1}, 0.9, 4, {{0, 2, 0}, 50}, {0.2, 0.1, 0}, PortalMask::outside};
  const Map map = map_with(portal);
  const film::Dive dive(map, 2, UpAxis::y);
  CHECK(dive.scale() == 4);
  CHECK(dive.turn() == Catch::Approx(-50));
  const auto led = [&](const Vector3d& shape) {
    const ShapeToMap& to_map = map.frame.shape_to_map;
    return Vector3d(
        to_map.to_shape(portal.destination + portal.scale * portal.rotation.matrix() *
                                                 (to_map.to_map(shape) - portal.center)));
  };
  CHECK((led(dive.point()) - dive.point()).norm() < 1e-12);
  Camera camera{.azimuth = 20, .elevation = -7};
  camera = dive.placed(camera, 1.5);
  CHECK(dive.point().y() > camera.look_at->y());
  const Camera first = dive.moved(camera, 0), last = dive.moved(camera, 1);
  CHECK((eye_of(first) - eye_of(camera)).norm() < 1e-12);
  CHECK((led(eye_of(last)) - eye_of(first)).norm() < 1e-9);
  CHECK((led(*last.look_at) - *first.look_at).norm() < 1e-9);
  // Equal ratios: half of the way twice is all of it.
  const Camera half = dive.moved(dive.moved(camera, 0.5), 0.5);
  CHECK((eye_of(half) - eye_of(last)).norm() < 1e-9);
  // What a user says holds.
  camera.distance = 7;
  camera.look_at = Vector3d(1, 2, 3);
  CHECK(*dive.placed(camera, 1.5).distance == 7);
  CHECK(*dive.placed(camera, 1.5).look_at == Vector3d(1, 2, 3));
  camera.field_of_view = 0;
  CHECK_THROWS_WITH(dive.placed(camera, 1.5), ContainsSubstring("nothing comes nearer"));
}

TEST_CASE("portals that no camera can dive into are refused") {
  const Portal good{{0.3, 2, 0.1}, 0.9, 4, {}, {0, 0, 0}, PortalMask::none};
  CHECK(refusal(good).empty());
  CHECK_THAT(refusal(good, 3), ContainsSubstring("there is no portal 3; give 1 to 2"));
  Portal bad = good;
  bad.scale = 1;
  CHECK_THAT(refusal(bad), ContainsSubstring("its copy is not smaller"));
  bad = good;
  bad.rotation = {{1, 0, 0}, 10};
  CHECK_THAT(refusal(bad), ContainsSubstring("a camera cannot roll"));
  bad = good;
  bad.radius = 0.5;  // the copies shrink to a point 0.68 away
  CHECK_THAT(refusal(bad), ContainsSubstring("would be cut off"));
  CHECK_THROWS_WITH(film::Dive(Map{}, 1, UpAxis::y), ContainsSubstring("no portal"));
}

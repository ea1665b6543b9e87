#include <catch2/catch_all.hpp>
#include <cmath>

#include "picture/lights.hpp"
#include "picture/view.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/scene_pose.hpp"

using namespace qjulia;

namespace {

Camera standing_camera() {
  Camera camera;
  camera.azimuth = 40;
  camera.elevation = 25;
  camera.up = UpAxis::z;
  camera.look_at = Eigen::Vector3d(1, 2, 3);
  camera.distance = 5;
  return camera;
}

}  // namespace

TEST_CASE("a camera's pose is where its rays come from") {
  Camera camera = standing_camera();
  const CameraPose pose = pose_of(camera, 320, 180);
  CHECK((pose.axes.transpose() * pose.axes).isIdentity(1e-12));
  CHECK(pose.axes.determinant() == Catch::Approx(1));
  // Up is z: azimuth 0 looks against x, and 90 against y.
  const double a = 40 * picture::kDegree, e = 25 * picture::kDegree;
  const Eigen::Vector3d back(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  CHECK((pose.eye - (*camera.look_at + 5 * back)).norm() < 1e-12);
  CHECK((pose.axes.col(2) - back).norm() < 1e-12);
  CHECK(pose.axes.col(0).z() == Catch::Approx(0).margin(1e-12));
  CHECK(pose.field_of_view == Catch::Approx(30));
  camera.zoom = 4;
  const double narrowed = pose_of(camera, 320, 180).field_of_view;
  CHECK(4 * std::tan(narrowed / 2 * picture::kDegree) ==
        Catch::Approx(std::tan(15 * picture::kDegree)));
  camera.field_of_view = 0;
  CHECK_THROWS_AS(pose_of(camera, 320, 180), OptionError);
  camera.field_of_view = 30;
  camera.distance.reset();
  CHECK_THROWS_AS(pose_of(camera, 320, 180), OptionError);
}

TEST_CASE("lamps are where pictures have them") {
  const Camera camera = standing_camera();
  Lighting light{.rig = RigName::museum};
  for (const std::optional<double> turn : {std::optional<double>(), std::optional<double>(-70)}) {
    light.lamp_turn = turn;
    const auto poses = lamp_poses(light, camera);
    const auto lights = picture::lamp_lights(light.whole(), nullptr, turn.value_or(camera.azimuth),
                                             UpAxis::z, {{-1, -1, -1}, {1, 1, 1}}, 0.1);
    REQUIRE(poses.size() == lights.size());
    for (std::size_t i = 0; i < poses.size(); ++i) {
      CHECK((poses[i].towards - lights[i].towards).norm() < 1e-12);
      CHECK(poses[i].towards.norm() == Catch::Approx(1));
    }
  }
}

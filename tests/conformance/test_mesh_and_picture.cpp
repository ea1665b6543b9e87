// Compares a map's mesh with its picture, which shares no code with it beyond the iteration.

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "armed_ball.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/surface/surface.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

constexpr int kCells = 160;

/// A set with grooves and bumps that are larger than cells.
Map rough_map() {
  return calibrated(test::shared_device(), steepened(test::armed_ball_map(60), 6));
}

TriangleMesh mesh_of(const Map& map, std::optional<int> refine) {
  SurfaceOptions options;
  options.resolution = kCells;
  options.refine = refine;
  return extract_surface(test::shared_device(), map, options);
}

/// The share of area whose normal is within 3 degrees of an axis; 0.4 % if normals are spread
/// evenly.
double share_facing_axes(const TriangleMesh& mesh) {
  const double near = std::cos(3 * std::numbers::pi / 180);
  double facing = 0, all = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3d& origin = mesh.vertices[a];
    const Vector3d area = (mesh.vertices[b] - origin).cross(mesh.vertices[c] - origin);
    if (area.cwiseAbs().maxCoeff() > near * area.norm()) facing += area.norm();
    all += area.norm();
  }
  return facing / all;
}

double median(std::vector<double> values) {
  REQUIRE(values.size() > 100);
  std::ranges::nth_element(values, values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2));
  return values[values.size() / 2];
}

/// How a mesh differs from a picture whose pixels are about as large as cells.
struct Apart {
  double distance;  ///< median, cells
  double degrees;   ///< between normals, median
};
Apart apart(const TriangleMesh& mesh, const PictureLayers& layers) {
  const double cell = mesh.box().size().maxCoeff() / kCells;
  std::vector<double> distances, angles;
  constexpr std::size_t kEvery = 11;
  for (std::size_t pixel = 0; pixel < layers.depth.size(); pixel += kEvery) {
    if (std::isinf(layers.depth[pixel])) continue;
    const Vector3d position =
        Eigen::Map<const Eigen::Vector3f>(&layers.position[3 * pixel]).cast<double>();
    const Eigen::Map<const Eigen::Vector3f> normal(&layers.normal[3 * pixel]);
    std::size_t nearest = 0;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      if ((mesh.vertices[i] - position).squaredNorm() <
          (mesh.vertices[nearest] - position).squaredNorm()) {
        nearest = i;
      }
    }
    distances.push_back((mesh.vertices[nearest] - position).norm() / cell);
    const double cosine = double{mesh.normals[nearest].dot(normal)};
    angles.push_back(std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi);
  }
  return {median(distances), median(angles)};
}

}  // namespace

TEST_CASE("the ground lies at the height that was set") {
  PictureOptions options;
  options.width = 64;
  options.height = 48;
  options.samples = 1;
  options.camera.elevation = 20;
  options.camera.look_at = Vector3d(0, 0, 0);
  options.camera.distance = 6;
  options.camera.up = UpAxis::z;
  const TriangleMesh ball = shapes::sphere(4);
  const Box framed = ball.box();
  const auto drawn = [&](const TriangleMesh& mesh, std::optional<double> ground) {
    Studio studio(test::shared_device(), mesh, framed, options);
    studio.set_exposure(0);
    if (ground) studio.set_ground(*ground);
    return studio.picture(options.camera).pixels;
  };
  const auto under_it = drawn(ball, {});
  // The lowest point as a map of 256 texels sees it.
  const auto differ = [&](const auto& one, const auto& other) {
    double sum = 0;
    for (std::size_t i = 0; i < one.size(); ++i) sum += std::abs(int{one[i]} - int{other[i]});
    return sum / static_cast<double>(one.size());
  };
  CHECK(differ(under_it, drawn(ball, -1)) < 0.5);
  CHECK(differ(under_it, drawn(ball, -1.5)) > 2);
  // A body that is lifted leaves the ground where it was.
  const TriangleMesh lifted = shapes::moved(ball, 1, {0, 0, 0.5});
  CHECK(differ(drawn(lifted, {}), drawn(lifted, -1)) > 2);
}

TEST_CASE("meshes do not face the axes") {
  const Map map = rough_map();
  const double plain = share_facing_axes(mesh_of(map, 0));
  const double found = share_facing_axes(mesh_of(map, {}));
  CAPTURE(plain, found);
  CHECK(found < 0.025);
  CHECK(plain > 0.05);  // else the map is too smooth to tell
}

TEST_CASE("meshes have the normals of pictures") {
  const Map map = rough_map();
  PictureOptions options;
  options.width = options.height = 200;
  options.samples = 1;
  options.keep_loose = true;
  options.ground = false;
  const PictureLayers layers = layered_render(test::shared_device(), map, options).layers;
  const Apart plain = apart(mesh_of(map, 0), layers);
  const Apart found = apart(mesh_of(map, {}), layers);
  CAPTURE(plain.distance, plain.degrees, found.distance, found.degrees);
  CHECK(found.distance < 0.5);
  CHECK(found.degrees < 0.6 * plain.degrees);
}

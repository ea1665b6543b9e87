#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <numbers>

#include "qjulia/base/error.hpp"
#include "qjulia/mesh/moving_mesh.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

const test::TemporaryFolder moving_folder;

/// A large ball with a bubble in it, and five small ones about it.
TriangleMesh ball_and_crumbs() {
  TriangleMesh mesh = shapes::sphere(2);
  mesh = shapes::joined(mesh, shapes::inside_out(shapes::sphere(1, 0.3)));
  for (const Eigen::Vector3d& at :
       {Eigen::Vector3d(2, 0, 0), Eigen::Vector3d(-2, 0, 0), Eigen::Vector3d(0, 0, 2),
        Eigen::Vector3d(0, 0, -1.5), Eigen::Vector3d(0, 2, 0.5)}) {
    mesh = shapes::joined(mesh, shapes::moved(shapes::sphere(1, 0.1), 1, at));
  }
  return mesh;
}

Eigen::Vector3d end_of(const MovingBody& body) { return body.poses.back().place; }
Eigen::Vector3d start_of(const MovingBody& body) { return body.poses.front().place; }

}  // namespace

TEST_CASE("between two moments bodies move evenly, and they stay after the last") {
  const MovingMesh moving = scattered(ball_and_crumbs(), {.seconds = 1}, UpAxis::z);
  const auto equal = [](const TriangleMesh& one, const TriangleMesh& other) {
    double most = 0;
    for (std::size_t i = 0; i < one.vertices.size(); ++i) {
      most = std::max(most, (one.vertices[i] - other.vertices[i]).norm());
    }
    return most < 1e-12;
  };
  CHECK(equal(mesh_after(moving, 0), mesh_at(moving, 0)));
  CHECK(equal(mesh_after(moving, 12.0 / 24), mesh_at(moving, 12)));
  CHECK(equal(mesh_after(moving, 100), mesh_at(moving, 24)));
  // A third of the way: places by a third, and bodies keep their form.
  MovingMesh between = moving;
  between.moments = 1;
  for (MovingBody& body : between.bodies) {
    if (body.poses.size() == 1) continue;
    const BodyPose &from = body.poses[12], &to = body.poses[13];
    body.poses = {{from.place + (to.place - from.place) / 3, from.turn.slerp(1.0 / 3, to.turn)}};
  }
  CHECK(equal(mesh_after(moving, (12 + 1.0 / 3) / 24), mesh_at(between, 0)));
  CHECK_FALSE(equal(mesh_after(moving, (12 + 1.0 / 3) / 24), mesh_at(moving, 12)));
  CHECK_THROWS_WITH(mesh_after(moving, -1), ContainsSubstring("give 0 or more"));
  CHECK_THROWS_AS(mesh_after(moving, std::nan("")), InputError);
}

TEST_CASE("loose bodies fly, and the largest stays with its cavity") {
  const TriangleMesh mesh = ball_and_crumbs();
  const ScatterField field =
      GENERATE(ScatterField::outward, ScatterField::wind, ScatterField::gravity);
  const MovingMesh moving = scattered(mesh, {.field = field, .seconds = 3}, UpAxis::z);
  moving.validate();
  CHECK(moving.moments == 73);
  REQUIRE(moving.bodies.size() == 6);
  CHECK(moving.bodies[0].poses.size() == 1);
  CHECK(moving.bodies[0].mesh.triangles.size() ==
        shapes::sphere(2).triangles.size() + shapes::sphere(1).triangles.size());
  const TriangleMesh first = mesh_at(moving, 0);
  CHECK(signed_volume(first) == Catch::Approx(signed_volume(mesh)));
  CHECK((first.box().high - mesh.box().high).norm() < 1e-9);
  for (std::size_t i = 1; i < 6; ++i) {
    const MovingBody& body = moving.bodies[i];
    REQUIRE(body.poses.size() == 73);
    const Eigen::Vector3d way = end_of(body) - start_of(body);
    // Nothing jumps: no step is longer than a fifth of the mesh.
    for (std::size_t k = 1; k < 73; ++k) {
      CHECK((body.poses[k].place - body.poses[k - 1].place).norm() < 0.8);
    }
    switch (field) {
      case ScatterField::outward:
        CHECK(way.dot(start_of(body)) > 0.8 * way.norm() * start_of(body).norm());
        CHECK(way.norm() > 0.7 * 4 * 0.9);
        break;
      case ScatterField::wind:
        CHECK(way.x() > 2);
        CHECK(way.z() > 0);
        break;
      case ScatterField::gravity:
        CHECK(way.head<2>().norm() < 1e-9);
        // It lies on the floor, or has no room to fall.
        CHECK(end_of(body).z() == Catch::Approx(-1.6 + 0.1).margin(1e-9));
        break;
    }
  }
  // The last moment is another mesh of the same volume.
  const TriangleMesh last = mesh_at(moving, 72);
  CHECK(signed_volume(last) == Catch::Approx(signed_volume(mesh)));
  CHECK((last.box().high - mesh.box().high).norm() + (last.box().low - mesh.box().low).norm() > 1);
}

TEST_CASE("the same seed scatters alike, another one otherwise") {
  const TriangleMesh mesh = ball_and_crumbs();
  const auto ends = [&](std::uint64_t seed) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const MovingBody& body : scattered(mesh, {.seed = seed}).bodies) sum += end_of(body);
    return sum;
  };
  CHECK(ends(1) == ends(1));
  CHECK((ends(1) - ends(2)).norm() > 1e-3);
}

TEST_CASE("a .glb has a node and two channels for each body that moves") {
  TriangleMesh mesh = ball_and_crumbs();
  mesh.colors.assign(mesh.vertices.size(), {200, 100, 50});
  const MovingMesh moving = scattered(mesh, {.field = ScatterField::wind, .seconds = 1}, UpAxis::y);
  const auto path = moving_folder.path() / "dust.glb";
  write_moving_mesh(moving, path, {.note = "made", .up = UpAxis::y});
  const std::string bytes = test::read_text(path);
  std::uint32_t length = 0, total = 0;
  std::memcpy(&total, bytes.data() + 8, 4);
  std::memcpy(&length, bytes.data() + 12, 4);
  CHECK(total == bytes.size());
  const auto scene = nlohmann::json::parse(bytes.substr(20, length));
  const std::size_t binary = 28 + length;
  CHECK(scene["nodes"].size() == 7);
  CHECK(scene["nodes"][0]["children"].size() == 6);
  CHECK(scene["meshes"].size() == 6);
  CHECK(scene["buffers"][0]["byteLength"] == bytes.size() - binary);
  const auto& animation = scene["animations"][0];
  REQUIRE(animation["channels"].size() == 10);
  // What the file says is what was to be written, to single precision.
  for (const auto& channel : animation["channels"]) {
    const auto& sampler = animation["samplers"][channel["sampler"].get<std::size_t>()];
    const auto& values = scene["accessors"][sampler["output"].get<std::size_t>()];
    CHECK(values["count"] == 25);
    const auto& times = scene["accessors"][sampler["input"].get<std::size_t>()];
    CHECK(times["max"][0] == 1.0);
    const std::size_t at =
        binary + scene["bufferViews"][values["bufferView"].get<std::size_t>()]["byteOffset"]
                     .get<std::size_t>();
    const bool moves = channel["target"]["path"] == "translation";
    const std::size_t numbers = moves ? 3 : 4;
    const auto& body = moving.bodies[channel["target"]["node"].get<std::size_t>() - 1];
    for (std::size_t i = 0; i < 25; ++i) {
      for (std::size_t k = 0; k < numbers; ++k) {
        float value = 0;
        std::memcpy(&value, bytes.data() + at + 4 * (numbers * i + k), 4);
        const auto c = static_cast<Eigen::Index>(k);
        const double wanted = moves ? body.poses[i].place[c] : body.poses[i].turn.coeffs()[c];
        CHECK(value == Catch::Approx(wanted).margin(1e-6));
      }
    }
  }
  // Readers that know no animation show the first moment.
  const TriangleMesh read = read_mesh(path);
  CHECK(signed_volume(read) == Catch::Approx(signed_volume(mesh)).epsilon(1e-5));
}

TEST_CASE("a .usda has time samples") {
  const MovingMesh moving = scattered(ball_and_crumbs(), {.seconds = 0.5}, UpAxis::y);
  const auto path = moving_folder.path() / "dust.usda";
  write_moving_mesh(moving, path, {.up = UpAxis::y});
  const std::string text = test::read_text(path);
  CHECK_THAT(text, ContainsSubstring("endTimeCode = 12\n") &&
                       ContainsSubstring("timeCodesPerSecond = 24\n") &&
                       ContainsSubstring("def Xform \"body_0005\""));
  std::size_t samples = 0;
  for (auto at = text.find("timeSamples"); at != std::string::npos;
       at = text.find("timeSamples", at + 1)) {
    ++samples;
  }
  CHECK(samples == 5);
}

TEST_CASE("what cannot move is refused") {
  const TriangleMesh ball = shapes::sphere(1);
  CHECK(scattered({}, {}).bodies.empty());
  CHECK_THROWS_AS(scattered(ball, {.seconds = 0}), OptionError);
  CHECK_THROWS_AS(scattered(ball, {.distance = -1}), OptionError);
  MovingMesh moving = scattered(ball_and_crumbs(), {.seconds = 1});
  CHECK_THROWS_AS(mesh_at(moving, 25), InputError);
  CHECK_THROWS_AS(write_moving_mesh(moving, moving_folder.path() / "a.ply", {}), InputError);
  moving.bodies[2].poses.pop_back();
  CHECK_THROWS_WITH(moving.validate(), ContainsSubstring("body 2 has 24 poses for 25 moments"));
  moving.bodies[2].poses = {{Eigen::Vector3d::Zero(), Eigen::Quaterniond(2, 0, 0, 0)}};
  CHECK_THROWS_WITH(moving.validate(), ContainsSubstring("not of length 1"));
  moving = scattered(ball_and_crumbs(), {.seconds = 1});
  moving.bodies[1].mesh.colors.assign(moving.bodies[1].mesh.vertices.size(), {1, 2, 3});
  CHECK_THROWS_WITH(mesh_at(moving, 0), ContainsSubstring("body 1 has normals or colors"));
  moving.moments = 0;
  CHECK_THROWS_WITH(moving.validate(), ContainsSubstring("give it at least one"));
}

TEST_CASE("bodies that lie in a plane across the wind fly all the same") {
  TriangleMesh flat = shapes::joined(shapes::moved(shapes::sphere(1, 0.1), 1, {0, 0, 1}),
                                     shapes::moved(shapes::sphere(1, 0.2), 1, {0, 0, -1}));
  for (Eigen::Vector3d& x : flat.vertices) x.x() = 0;
  const MovingMesh moving = scattered(flat, {.field = ScatterField::wind, .seconds = 1});
  REQUIRE(moving.bodies.size() == 2);
  CHECK((end_of(moving.bodies[1]) - start_of(moving.bodies[1])).norm() > 0.1);
}

// What pages ask to have made.

#include <Eigen/Geometry>
#include <catch2/catch_all.hpp>

#include "explore/maker.hpp"
#include "explore/request.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"

using namespace qjulia;
using explore::read_make;

TEST_CASE("what is to be made is read with the knobs") {
  const auto mesh = read_make({{"make", "stl"},
                               {"resolution", "96"},
                               {"millimetres", "80.5"},
                               {"detail", "0.03"},
                               {"iterations", "4"}});
  CHECK(mesh.extension == ".stl");
  CHECK(!mesh.is_turntable);
  CHECK(mesh.surface.resolution == 96);
  CHECK(mesh.surface.iterations == 4);
  CHECK(*mesh.millimetres == 80.5);
  CHECK(*mesh.view.knobs.detail == 0.03);
  const auto turntable =
      read_make({{"make", "turntable"}, {"frames", "12"}, {"size", "64x48"}, {"samples", "2"}});
  CHECK(turntable.is_turntable);
  CHECK(turntable.frames == 12);
  CHECK(turntable.view.picture.width == 64);
}

TEST_CASE("drafts of all sizes have one studio, whole pictures one a size") {
  const auto text = [](const std::string& size, const std::string& azimuth, bool is_draft) {
    explore::Query query{{"size", size}, {"azimuth", azimuth}, {"detail", "0.03"}};
    if (is_draft) query.insert({"draft", "1"});
    return explore::read_view(query).studio_text;
  };
  CHECK(text("160x120", "0", true) == text("400x300", "10", true));
  CHECK(text("160x120", "0", false) == text("160x120", "10", false));
  CHECK(text("160x120", "0", false) != text("400x300", "0", false));
  CHECK(text("160x120", "0", false) != text("160x120", "0", true));
}

TEST_CASE("other settings of a request override its look, which is no file") {
  const auto picture =
      explore::read_view({{"look", "jade"}, {"lamp", "10,20,1;5,6,7,3200K"}, {"coat", "0.25"}})
          .picture;
  CHECK(picture.look == "jade");
  CHECK(picture.matter.wax > 0.5);
  CHECK(picture.matter.coat == 0.25);
  CHECK(picture.light.lamps == std::vector{lamp_from("10,20,1"), lamp_from("5,6,7,3200K")});
  CHECK_FALSE(explore::read_view({{"exposure", "auto"}}).picture.exposure);
  CHECK(explore::read_view({{"exposure", "-1.5"}}).picture.exposure == -1.5);
  CHECK_THROWS_WITH(explore::read_view({{"look", "/tmp/a.toml"}}),
                    Catch::Matchers::ContainsSubstring("no look '/tmp/a.toml'"));
  CHECK_THROWS_WITH(explore::read_view({{"lamp", "1,2"}}),
                    Catch::Matchers::ContainsSubstring("lamp: '1,2' is no lamp"));
}

TEST_CASE("what cannot be used is named, with what to give") {
  using Catch::Matchers::ContainsSubstring;
  using explore::read_view;
  CHECK_THROWS_WITH(read_view({{"size", "0x0"}}),
                    ContainsSubstring("size: give sides of 1 to 16384"));
  CHECK_THROWS_WITH(read_view({{"size", "-1x-1"}}),
                    ContainsSubstring("size: give sides of 1 to 16384"));
  CHECK_THROWS_WITH(read_view({{"samples", "0"}}), "samples: give 1 to 4");
  for (const char* detail : {"1", "0.11", "0.00009", "0", "-1"}) {
    CHECK_THROWS_WITH(read_view({{"detail", detail}}),
                      ContainsSubstring("detail: ") && ContainsSubstring("give 0.0001 to 0.1"));
  }
  CHECK(*read_view({{"detail", "0.1"}}).knobs.detail == 0.1);
  CHECK(read_view({{"steady", "1"}}).is_steady);
  CHECK(*read_view({{"distance", "3.5"}}).picture.camera.distance == 3.5);
  CHECK_THROWS_WITH(read_view({{"draft", "7"}}), "draft: '7' cannot be used; give 0 or 1");
  CHECK_THROWS_WITH(read_view({{"zoom", "far"}}), "zoom: 'far' cannot be used; give a number");
  CHECK_THROWS_WITH(read_view({{"order-seed", "-1"}}),
                    ContainsSubstring("give a whole number that is not"));
  for (const std::string& type : extensions(FileContent::mesh, FileUse::write)) {
    CHECK(read_make({{"make", type.substr(1)}}).extension == type);
    CHECK_THROWS_WITH(read_make({{"make", "png"}}), ContainsSubstring("make: give one of") &&
                                                        ContainsSubstring(type.substr(1) + ","));
  }
  CHECK_THROWS_WITH(read_make({{"make", "ply"}, {"length", "1"}}),
                    ContainsSubstring("a request has an unknown name; it takes frames, make"));
  CHECK_THROWS_WITH(read_make({{"make", "ply"}, {"resolution", "x"}}),
                    "resolution: 'x' cannot be used; give a whole number");
}

TEST_CASE("a mesh is cut along planes") {
  // An octahedron, whose lower half is four triangles and whose section is a square.
  TriangleMesh mesh;
  for (const double side : {-1.0, 1.0}) {
    for (int axis = 0; axis < 3; ++axis)
      mesh.vertices.push_back(side * Eigen::Vector3d::Unit(axis));
  }
  mesh.triangles = {{3, 4, 5}, {4, 0, 5}, {0, 1, 5}, {1, 3, 5},
                    {4, 3, 2}, {0, 4, 2}, {1, 0, 2}, {3, 1, 2}};
  for (const Eigen::Vector3d& v : mesh.vertices) {
    mesh.normals.push_back(v.cast<float>());
    const auto grey = static_cast<std::uint8_t>(100 + 100 * v.z());
    mesh.colors.push_back({grey, grey, 7});
  }
  REQUIRE(inspect(mesh).closed());
  for (const double most : {-0.5, 0.0, 0.5}) {
    const TriangleMesh cut = explore::cut_away(mesh, 2, most);
    const MeshReport report = inspect(cut);
    CHECK(report.open_edges == 4);
    CHECK(report.non_manifold_edges == 0);
    CHECK(cut.box().high.z() == most);
    CHECK(cut.box().low.z() == -1);
    CHECK(cut.normals.size() == cut.vertices.size());
    REQUIRE(cut.colors.size() == cut.vertices.size());
    for (std::size_t v = 0; v < cut.vertices.size(); ++v) {
      CHECK(std::abs(cut.colors[v][0] - (100 + 100 * cut.vertices[v].z())) <= 1);
      CHECK(cut.colors[v][2] == 7);
    }
    double area = 0;
    for (const Triangle& t : cut.triangles) {
      const Eigen::Vector3d a = cut.vertices[t[1]] - cut.vertices[t[0]];
      const Eigen::Vector3d normal = a.cross(cut.vertices[t[2]] - cut.vertices[t[0]]);
      CHECK(normal.dot(cut.vertices[t[0]]) > 0);
      area += 0.5 * normal.norm();
    }
    // Of each face, a triangle of area √3 / 2, what is above is a smaller one, or below.
    const double part = (1 - std::abs(most)) * (1 - std::abs(most));
    const double faces = most > 0 ? 8 - 4 * part : 4 * part;
    CHECK(area == Catch::Approx(faces * std::sqrt(3) / 2));
  }
  CHECK(explore::cut_away(mesh, 0, 2).triangles.size() == mesh.triangles.size());
  CHECK(explore::cut_away(mesh, 0, -2).triangles.empty());
}

TEST_CASE("nothing else is made") {
  const explore::Query bad[] = {{},
                                {{"make", ""}},
                                {{"make", "png"}},
                                {{"make", "/../x.ply"}},
                                {{"make", "ply"}, {"make", "obj"}},
                                {{"make", "ply"}, {"resolution", "5000"}},
                                {{"make", "ply"}, {"resolution", "1e2"}},
                                {{"make", "ply"}, {"resolution", "64"}, {"resolution", "65"}},
                                {{"make", "stl"}, {"millimetres", "-1"}},
                                {{"make", "stl"}, {"cut", "z=50%"}},
                                {{"make", "3mf"}, {"cut", "z=50%"}},
                                {{"make", "stl"}, {"millimetres", "nan"}},
                                {{"make", "turntable"}, {"frames", "1"}},
                                {{"make", "turntable"}, {"frames", "120"}, {"size", "4000x4000"}},
                                {{"make", "ply"}, {"file", "/etc/passwd"}}};
  for (const auto& query : bad) CHECK_THROWS_AS(read_make(query), InputError);
}

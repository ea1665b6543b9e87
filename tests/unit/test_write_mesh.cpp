// Meshes as files, and which way they stand.

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/larger_error.hpp"
#include "qjulia/error.hpp"
#include "qjulia/mesh.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;

namespace {

const test::TemporaryFolder written_folder;

/// The vertices of a .glb of ours as a viewer sees them: in the scene, whose Y is up.
TriangleMesh read_glb(const std::filesystem::path& path) {
  const std::string bytes = test::read_text(path);
  const auto at = [&bytes](std::size_t from, auto value) {
    std::memcpy(&value, bytes.data() + from, sizeof value);
    return value;
  };
  const std::size_t json_bytes = at(12, std::uint32_t{});
  const auto scene = nlohmann::json::parse(bytes.substr(20, json_bytes));
  const auto q = scene.at("nodes").at(0).at("rotation").get<std::vector<double>>();
  const Eigen::Quaterniond turn(q[3], q[0], q[1], q[2]);
  const auto& positions = scene.at("accessors").at(1);
  const std::size_t view = scene.at("bufferViews").at(1).at("byteOffset");
  TriangleMesh mesh;
  for (std::size_t i = 0; i < positions.at("count"); ++i) {
    const std::size_t from = 28 + json_bytes + view + 12 * i;
    const Eigen::Vector3d own(at(from, float{}), at(from + 4, float{}), at(from + 8, float{}));
    mesh.vertices.emplace_back(turn * own);
  }
  return mesh;
}

}  // namespace

TEST_CASE("every format is written and read back") {
  const std::string name = GENERATE("m.ply", "m.stl", "m.obj", "m.off", "M.PLY");
  const TriangleMesh mesh = shapes::torus(1, 0.35, 24, 12);
  const auto path = written_folder.path() / name;
  write_mesh(mesh, path);
  const auto [read, report] = read_and_inspect_mesh(path);
  CAPTURE(name);
  CHECK(read.vertices.size() == mesh.vertices.size());
  REQUIRE(read.triangles.size() == mesh.triangles.size());
  double worst = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      worst = base::larger_error(worst, (mesh.vertices[mesh.triangles[t][corner]] -
                                         read.vertices[read.triangles[t][corner]])
                                            .norm());
    }
  }
  CHECK(worst < 2e-7);
  CHECK(report.closed());
  CHECK(report.components == 1);
  CHECK(report.warnings().empty());
}

TEST_CASE("binary formats have the size their layout asks for") {
  const TriangleMesh mesh = shapes::sphere(1);
  write_mesh(mesh, written_folder.path() / "size.stl");
  CHECK(std::filesystem::file_size(written_folder.path() / "size.stl") ==
        84 + 50 * mesh.triangles.size());
  write_mesh(mesh, written_folder.path() / "size.ply");
  const std::string ply = test::read_text(written_folder.path() / "size.ply");
  CHECK(ply.size() ==
        ply.find("end_header\n") + 11 + 12 * mesh.vertices.size() + 13 * mesh.triangles.size());
}

TEST_CASE("an .off file is plain, whether or not the mesh has normals") {
  TriangleMesh mesh = shapes::sphere(1);
  const auto written = [&] {
    write_mesh(mesh, written_folder.path() / "plain.off");
    return test::read_text(written_folder.path() / "plain.off");
  };
  const std::string without = written();
  CHECK(without.starts_with("OFF\n"));
  for (const auto& x : mesh.vertices) mesh.normals.push_back(x.normalized().cast<float>());
  CHECK(written() == without);
}

TEST_CASE("files stand upright where their format has an up, and keep coordinates elsewhere") {
  // Three sides of its own along each axis, so that no turn is like another.
  const TriangleMesh mesh = shapes::box({-1, -2, -3}, {4, 8, 16});
  const auto written = [&](const std::string& name, std::optional<UpAxis> up) {
    const std::filesystem::path path = written_folder.path() / name;
    write_mesh(mesh, path, {}, up);
    return path;
  };
  for (const UpAxis up :
       {UpAxis::x, UpAxis::y, UpAxis::z, UpAxis::minus_x, UpAxis::minus_y, UpAxis::minus_z}) {
    CAPTURE(to_string(up));
    const auto along = [&](const Eigen::Vector3d& v) { return direction(up).dot(v); };
    const double top = std::max(along(mesh.box().low), along(mesh.box().high));
    const TriangleMesh print = read_mesh(written("up.stl", up));
    CHECK(print.box().high.z() == top);
    CHECK(print.box().size().z() == std::abs(along(mesh.box().size())));
    CHECK(signed_volume(print) == Approx(signed_volume(mesh)));

    const TriangleMesh glb = read_glb(written("up.glb", up));
    CHECK(glb.box().high.y() == Approx(top));
    CHECK(glb.box().size().y() == Approx(std::abs(along(mesh.box().size()))));
    CHECK(glb.vertices.size() == mesh.vertices.size());

    for (const std::string name : {"up.ply", "up.obj", "up.off"}) {
      const std::string standing = test::read_text(written(name, up));
      CHECK(standing == test::read_text(written(name, {})));
    }
  }
  const std::string upright = test::read_text(written("up.stl", UpAxis::z));
  CHECK(upright == test::read_text(written("up.stl", {})));
  CHECK(read_glb(written("up.glb", {})).box().high.y() == Approx(16));
}

TEST_CASE("writing to an unknown format or a missing folder fails") {
  CHECK_THROWS_AS(write_mesh(shapes::box(), written_folder.path() / "box.gltf"), InputError);
  CHECK_THROWS_AS(write_mesh(shapes::box(), written_folder.path() / "no" / "box.ply"), OutputError);
}

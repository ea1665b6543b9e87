// Meshes as files, and which way they stand.

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/larger_error.hpp"
#include "qjulia/error.hpp"
#include "qjulia/mesh.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;

namespace {

const test::TemporaryFolder written_folder;

/// A .glb, taken apart.
struct GlbFile {
  std::string bytes;
  nlohmann::json scene;
  std::size_t binary = 0;  ///< where its buffer begins

  explicit GlbFile(const std::filesystem::path& path) : bytes(test::read_text(path)) {
    const std::size_t json_bytes = at(12, std::uint32_t{});
    scene = nlohmann::json::parse(bytes.substr(20, json_bytes));
    binary = 28 + json_bytes;
  }
  template <class Value>
  Value at(std::size_t from, Value value) const {
    REQUIRE(from + sizeof value <= bytes.size());
    std::memcpy(&value, bytes.data() + from, sizeof value);
    return value;
  }
};

/// The vertices of a .glb of ours as a viewer sees them: in the scene, whose Y is up.
TriangleMesh read_glb(const std::filesystem::path& path) {
  const GlbFile file(path);
  const nlohmann::json& scene = file.scene;
  const auto q = scene.at("nodes").at(0).at("rotation").get<std::vector<double>>();
  const Eigen::Quaterniond turn(q[3], q[0], q[1], q[2]);
  const auto& positions = scene.at("accessors").at(1);
  const std::size_t view = scene.at("bufferViews").at(1).at("byteOffset");
  TriangleMesh mesh;
  for (std::size_t i = 0; i < positions.at("count"); ++i) {
    const std::size_t from = file.binary + view + 12 * i;
    const Eigen::Vector3d own(file.at(from, float{}), file.at(from + 4, float{}),
                              file.at(from + 8, float{}));
    mesh.vertices.emplace_back(turn * own);
  }
  return mesh;
}

/// A sphere with a colour of its own at each vertex; with normals where asked for.
TriangleMesh colored_sphere(bool has_normals) {
  TriangleMesh mesh = shapes::sphere(2);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (has_normals) mesh.normals.push_back(mesh.vertices[v].cast<float>());
    mesh.colors.push_back({static_cast<std::uint8_t>(v), static_cast<std::uint8_t>(255 - v), 188});
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

TEST_CASE("a .ply has colours of 8 bits after positions and normals") {
  const bool has_normals = GENERATE(false, true);
  const TriangleMesh mesh = colored_sphere(has_normals);
  const auto path = written_folder.path() / "colored.ply";
  write_mesh(mesh, path);
  const std::string ply = test::read_text(path);
  CHECK(ply.find(std::string(has_normals ? "float nz" : "float z") +
                 "\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nelement face") !=
        std::string::npos);
  const std::size_t first = ply.find("end_header\n") + 11, record = has_normals ? 27 : 15;
  REQUIRE(ply.size() == first + record * mesh.vertices.size() + 13 * mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto* const color = ply.data() + first + record * (v + 1) - 3;
    for (std::size_t c = 0; c < 3; ++c) {
      REQUIRE(static_cast<std::uint8_t>(color[c]) == mesh.colors[v][c]);
    }
  }
  CHECK(read_mesh(path).triangles.size() == mesh.triangles.size());
}

TEST_CASE("a .glb has linear colours, a plain material and the file's name") {
  const bool has_normals = GENERATE(false, true);
  const TriangleMesh mesh = colored_sphere(has_normals);
  write_mesh(mesh, written_folder.path() / "my ball.glb");
  const GlbFile file(written_folder.path() / "my ball.glb");
  const nlohmann::json& scene = file.scene;
  CHECK(scene.at("nodes").at(0).at("name") == "my ball");
  CHECK(scene.at("meshes").at(0).at("name") == "my ball");
  const auto& primitive = scene.at("meshes").at(0).at("primitives").at(0);
  const auto& accessor =
      scene.at("accessors").at(primitive.at("attributes").at("COLOR_0").get<std::size_t>());
  CHECK(accessor.at("componentType") == 5121);
  CHECK(accessor.at("normalized") == true);
  CHECK(accessor.at("type") == "VEC4");
  REQUIRE(accessor.at("count") == mesh.vertices.size());
  const auto& view = scene.at("bufferViews").at(accessor.at("bufferView").get<std::size_t>());
  CHECK(view.at("byteLength") == 4 * mesh.vertices.size());
  const std::size_t offset = view.at("byteOffset");
  CHECK(offset % 4 == 0);
  CHECK(file.binary + offset + 4 * mesh.vertices.size() == file.bytes.size());
  CHECK(scene.at("buffers").at(0).at("byteLength") == file.bytes.size() - file.binary);
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto color = file.at(file.binary + offset + 4 * v, std::array<std::uint8_t, 4>{});
    // sRGB 188 is half of the light.
    REQUIRE(color[2] == 128);
    REQUIRE(color[3] == 255);
    if (mesh.colors[v][0] == 255) CHECK(color[0] == 255);
    if (mesh.colors[v][0] == 0) CHECK(color[0] == 0);
    if (mesh.colors[v][0] == 99) CHECK(color[0] == 32);
    if (mesh.colors[v][1] == 99) CHECK(color[1] == 32);
  }
  const auto& material = scene.at("materials")
                             .at(primitive.at("material").get<std::size_t>())
                             .at("pbrMetallicRoughness");
  CHECK(material.at("baseColorFactor") == nlohmann::json({1, 1, 1, 1}));
  CHECK(material.at("metallicFactor") == 0);
  CHECK(material.at("roughnessFactor") > 0.3);
}

TEST_CASE("an .obj has colours from 0 to 1 after coordinates") {
  const bool has_normals = GENERATE(false, true);
  const TriangleMesh mesh = colored_sphere(has_normals);
  const auto path = written_folder.path() / "colored.obj";
  write_mesh(mesh, path);
  std::istringstream text(test::read_text(path));
  std::size_t v = 0, normals = 0;
  for (std::string line; std::getline(text, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key == "vn") ++normals;
    if (key != "v") continue;
    double x = 0;
    for (int i = 0; i < 3; ++i) words >> x;
    for (std::size_t c = 0; c < 3; ++c) {
      REQUIRE(words >> x);
      REQUIRE(std::lround(255 * x) == mesh.colors.at(v)[c]);
    }
    ++v;
  }
  CHECK(v == mesh.vertices.size());
  CHECK(normals == mesh.normals.size());
  CHECK(read_mesh(path).triangles.size() == mesh.triangles.size());
}

TEST_CASE("what holds no colours is the same with and without them") {
  for (const std::string name : {"plain.stl", "plain.off"}) {
    CHECK_FALSE(holds_colors(name));
    const auto path = written_folder.path() / name;
    TriangleMesh mesh = colored_sphere(false);
    write_mesh(mesh, path);
    const std::string with = test::read_text(path);
    mesh.colors.clear();
    write_mesh(mesh, path);
    CHECK(with == test::read_text(path));
  }
  for (const char* name : {"a.ply", "a.obj", "a.GLB"}) CHECK(holds_colors(name));
  TriangleMesh mesh = colored_sphere(false);
  mesh.colors.pop_back();
  CHECK_THROWS_WITH(write_mesh(mesh, written_folder.path() / "few.ply"),
                    Catch::Contains("colours"));
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

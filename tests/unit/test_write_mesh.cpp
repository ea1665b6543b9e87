// Meshes as files, and which way they stand.

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/file_types.hpp"
#include "base/larger_error.hpp"
#include "mesh_io/formats.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
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

TEST_CASE("every type of the table is written") {
  for (const std::string& extension :
       base::extensions(base::FileContent::mesh, base::FileUse::write)) {
    CAPTURE(extension);
    const auto path = written_folder.path() / ("every" + extension);
    write_mesh(shapes::torus(1, 0.35, 24, 12), path);
    CHECK(std::filesystem::file_size(path) > 0);
  }
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
                    Catch::Matchers::ContainsSubstring("colours"));
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
    CHECK(signed_volume(print) == Catch::Approx(signed_volume(mesh)));

    const TriangleMesh glb = read_glb(written("up.glb", up));
    CHECK(glb.box().high.y() == Catch::Approx(top));
    CHECK(glb.box().size().y() == Catch::Approx(std::abs(along(mesh.box().size()))));
    CHECK(glb.vertices.size() == mesh.vertices.size());

    for (const std::string name : {"up.ply", "up.obj", "up.off"}) {
      const std::string standing = test::read_text(written(name, up));
      CHECK(standing == test::read_text(written(name, {})));
    }
  }
  const std::string upright = test::read_text(written("up.stl", UpAxis::z));
  CHECK(upright == test::read_text(written("up.stl", {})));
  CHECK(read_glb(written("up.glb", {})).box().high.y() == Catch::Approx(16));
}

TEST_CASE("files without an up of their own are turned where they are asked to") {
  TriangleMesh mesh = shapes::box({-1, -2, -3}, {4, 8, 16});
  for (const auto& x : mesh.vertices) mesh.normals.push_back(x.normalized().cast<float>());
  for (const std::string name : {"turned.ply", "turned.obj", "turned.off"}) {
    CAPTURE(name);
    const auto path = written_folder.path() / name;
    write_mesh(mesh, path, MeshFileOptions{.up = UpAxis::minus_x, .file_up = UpAxis::z});
    const TriangleMesh turned = read_mesh(path);
    CHECK(turned.box().high.z() == Catch::Approx(1));
    CHECK(turned.box().size().z() == Catch::Approx(5));
    CHECK(signed_volume(turned) == Catch::Approx(signed_volume(mesh)));
    // Without a known up, y is.
    write_mesh(mesh, path, MeshFileOptions{.file_up = UpAxis::z});
    CHECK(read_mesh(path).box().size().z() == Catch::Approx(10));
  }
  const std::string obj = test::read_text(written_folder.path() / "turned.obj");
  std::istringstream after(obj.substr(obj.find("\nv ") + 3));
  std::string word;
  Eigen::Vector3d x, n;
  after >> x[0] >> x[1] >> x[2] >> word >> n[0] >> n[1] >> n[2];
  CHECK(word == "vn");
  CHECK((x.normalized() - n).norm() < 1e-6);
}

TEST_CASE("a .glb has the name and the size that it is given") {
  const auto path = written_folder.path() / "sized.glb";
  write_mesh(shapes::box(), path, MeshFileOptions{.name = "a \"box\"", .metres_per_unit = 0.25});
  const GlbFile file(path);
  CHECK(file.scene.at("nodes").at(0).at("name") == "a \"box\"");
  CHECK(file.scene.at("meshes").at(0).at("name") == "a \"box\"");
  CHECK(file.scene.at("nodes").at(0).at("scale") == nlohmann::json({0.25, 0.25, 0.25}));
}

TEST_CASE("an .obj has a name, and a material of its colours' mean beside it") {
  TriangleMesh mesh = colored_sphere(true);
  const auto path = written_folder.path() / "with material.obj";
  const auto material = written_folder.path() / "with material.mtl";
  const std::vector<VertexColor> colors = std::move(mesh.colors);
  mesh.colors = {};
  write_mesh(mesh, path, MeshFileOptions{.name = "two\nlines"});
  CHECK_FALSE(std::filesystem::exists(material));
  const std::string plain = test::read_text(path);
  CHECK(plain.find("\no two_lines\n") != std::string::npos);
  CHECK(plain.find("mtl") == std::string::npos);

  mesh.colors.assign(colors.size(), {0, 255, 188});
  write_mesh(mesh, path);
  const std::string text = test::read_text(path);
  CHECK(text.find("\nmtllib with material.mtl\n") != std::string::npos);
  const std::string described = test::read_text(material);
  CHECK(described.find("Kd 0.0000 1.0000 0.7373\n") != std::string::npos);
  const std::size_t name = described.find("newmtl ") + 7;
  CHECK(text.find("usemtl " + described.substr(name, described.find('\n') - name) + "\n") !=
        std::string::npos);
}

TEST_CASE("a .usda says its unit, its up, its normals and linear colours") {
  const TriangleMesh mesh = colored_sphere(true);
  const auto path = written_folder.path() / "2 balls.usda";
  write_mesh(mesh, path, MeshFileOptions{.note = "a \"note\"", .metres_per_unit = 0.001});
  const std::string text = test::read_text(path);
  CHECK(text.starts_with("#usda 1.0\n"));
  for (const char* line :
       {"defaultPrim = \"_2_balls\"", "doc = \"a \\\"note\\\"\"", "metersPerUnit = 0.001\n",
        "upAxis = \"Y\"", "def Mesh \"_2_balls\"", "subdivisionScheme = \"none\"", "def Camera",
        // Z up becomes Y up.
        "xformOp:transform = ( (1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1) )"}) {
    CAPTURE(line);
    CHECK(text.find(line) != std::string::npos);
  }
  const auto count = [&](const std::string& list, char item) {
    const std::string begin = list + " = [";
    const std::size_t from = text.find(begin);
    REQUIRE(from != std::string::npos);
    const std::size_t first = from + begin.size();
    const std::string inner = text.substr(first, text.find(']', first) - first);
    return static_cast<std::size_t>(std::ranges::count(inner, item));
  };
  CHECK(count("point3f[] points", '(') == mesh.vertices.size());
  CHECK(count("normal3f[] normals", '(') == mesh.normals.size());
  CHECK(text.substr(text.find("displayColor = [")).find(", 0.50289)") != std::string::npos);
  CHECK(count("int[] faceVertexCounts", '3') == mesh.triangles.size());
}

TEST_CASE("in a .usda mesh and material have different names") {
  const auto path = written_folder.path() / "vertex_colours.usda";
  write_mesh(colored_sphere(false), path);
  const std::string colored = test::read_text(path);
  CHECK(colored.find("def Mesh \"vertex_colours_mesh\"") != std::string::npos);
  CHECK(colored.find("def Material \"vertex_colours\"") != std::string::npos);
  write_mesh(shapes::box(), path);
  CHECK(test::read_text(path).find("def Mesh \"vertex_colours\"") != std::string::npos);
}

TEST_CASE("writing to an unknown format or a missing folder fails") {
  CHECK_THROWS_AS(write_mesh(shapes::box(), written_folder.path() / "box.gltf"), InputError);
  CHECK_THROWS_AS(write_mesh(shapes::box(), written_folder.path() / "no" / "box.ply"), OutputError);
}

TEST_CASE("every mesh of the table of file types has a reader and a writer, and no other has") {
  using base::FileContent, base::FileUse;
  for (const std::string& extension : base::extensions(FileContent::mesh, FileUse::read)) {
    INFO(extension);
    CHECK(shape::mesh_format(extension).read != nullptr);
  }
  for (const std::string& extension : base::extensions(FileContent::mesh, FileUse::write)) {
    INFO(extension);
    CHECK(shape::mesh_format(extension).write != nullptr);
  }
  CHECK(shape::mesh_format(".usda").read == nullptr);
  CHECK(shape::mesh_format(".gltf").write == nullptr);
  CHECK_THROWS_AS(shape::mesh_format(".vti"), std::logic_error);
}

// Scenes of glTF and 3MF as they are read, and what is refused.

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch_all.hpp>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/base64.hpp"
#include "base/zip_file.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "shapes.hpp"
#include "stored_zip.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

using Json = nlohmann::json;

const test::TemporaryFolder scene_folder;

void check_scene_refused(const std::string& name, std::string_view bytes, const std::string& why) {
  const auto path = scene_folder.file(name, bytes);
  CAPTURE(name);
  CHECK_THROWS_AS(read_mesh(path), InputError);
  CHECK_THROWS_WITH(read_mesh(path), ContainsSubstring(name) && ContainsSubstring(why));
}

TriangleMesh read_scene(const std::string& name, std::string_view bytes) {
  return read_mesh(scene_folder.file(name, bytes));
}

template <class Number>
std::string raw_bytes(const std::vector<Number>& numbers) {
  std::string bytes(numbers.size() * sizeof(Number), '\0');
  std::memcpy(bytes.data(), numbers.data(), bytes.size());
  return bytes;
}

const std::string kTetrahedronCorners = raw_bytes<float>({0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1});
const std::vector<int> kTetrahedronIndices = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

template <class Index>
std::string index_bytes_of() {
  return raw_bytes(std::vector<Index>(kTetrahedronIndices.begin(), kTetrahedronIndices.end()));
}

/// A tetrahedron of volume 1/6, whose indices have the given type.
Json tetrahedron_scene(int index_type, std::size_t index_bytes) {
  return {
      {"asset", {{"version", "2.0"}}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", {{{"mesh", 0}}}},
      {"meshes", {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}}},
      {"buffers", {{{"byteLength", kTetrahedronCorners.size() + index_bytes}}}},
      {"bufferViews",
       {{{"buffer", 0}, {"byteLength", kTetrahedronCorners.size()}},
        {{"buffer", 0}, {"byteOffset", kTetrahedronCorners.size()}, {"byteLength", index_bytes}}}},
      {"accessors",
       {{{"bufferView", 0}, {"componentType", 5126}, {"count", 4}, {"type", "VEC3"}},
        {{"bufferView", 1}, {"componentType", index_type}, {"count", 12}, {"type", "SCALAR"}}}}};
}
Json tetrahedron_scene() { return tetrahedron_scene(5121, 12); }

std::string word_bytes(std::size_t value) {
  return raw_bytes<std::uint32_t>({static_cast<std::uint32_t>(value)});
}

std::string glb_file(const Json& scene,
                     std::string binary = kTetrahedronCorners + index_bytes_of<std::uint8_t>()) {
  std::string text = scene.dump();
  text.append((4 - text.size() % 4) % 4, ' ');
  binary.append((4 - binary.size() % 4) % 4, '\0');
  return "glTF" + word_bytes(2) + word_bytes(28 + text.size() + binary.size()) +
         word_bytes(text.size()) + "JSON" + text + word_bytes(binary.size()) +
         std::string("BIN\0", 4) + binary;
}

/// The scene with one change.
std::string changed_glb(const char* pointer, const Json& value) {
  Json scene = tetrahedron_scene();
  scene[Json::json_pointer(pointer)] = value;
  return glb_file(scene);
}

constexpr const char* k3mfRelations =
    "<Relationships xmlns='http://schemas.openxmlformats.org/package/2006/relationships'>"
    "<Relationship Target='/3D/m.model' Id='r' "
    "Type='http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel'/></Relationships>";
constexpr const char* kTetrahedron3mf =
    "<object id='1'><mesh><vertices><vertex x='0' y='0' z='0'/><vertex x='1' y='0' z='0'/>"
    "<vertex x='0' y='1' z='0'/><vertex x='0' y='0' z='1'/></vertices><triangles>"
    "<triangle v1='0' v2='2' v3='1'/><triangle v1='0' v2='1' v3='3'/>"
    "<triangle v1='0' v2='3' v3='2'/><triangle v1='1' v2='2' v3='3'/></triangles></mesh></object>";

std::string model_3mf(const std::string& objects, const std::string& items,
                      const std::string& unit = "millimeter") {
  return fmt::format(
      "<?xml version='1.0'?><model unit='{}' "
      "xmlns='http://schemas.microsoft.com/3dmanufacturing/core/2015/02' "
      "xmlns:p='http://schemas.microsoft.com/3dmanufacturing/production/2015/06'>"
      "<resources>{}</resources><build>{}</build></model>",
      unit, objects, items);
}

std::string package_3mf(const std::string& text) {
  return test::stored_zip({{"_rels/.rels", k3mfRelations}, {"3D/m.model", text}});
}

/// Objects of which each holds the one before twice: the last one has 2^(top - 1) tetrahedra.
std::string tower_3mf(int top) {
  std::string tower = kTetrahedron3mf;
  for (int i = 2; i <= top; ++i) {
    tower += fmt::format(
        "<object id='{0}'><components><component objectid='{1}'/>"
        "<component objectid='{1}'/></components></object>",
        i, i - 1);
  }
  return tower;
}

}  // namespace

TEST_CASE("glb: what is written is read again") {
  const TriangleMesh mesh = shapes::torus(1, 0.35, 24, 12);
  const auto path = scene_folder.path() / "torus.glb";
  for (const UpAxis up : {UpAxis::x, UpAxis::y, UpAxis::z, UpAxis::minus_x, UpAxis::minus_z}) {
    CAPTURE(to_string(up));
    write_mesh(mesh, path, {}, up);
    const TriangleMesh read = read_mesh(path);
    REQUIRE(read.vertices.size() == mesh.vertices.size());
    REQUIRE(read.triangles.size() == mesh.triangles.size());
    const Eigen::Matrix3d turn = quarter_turns(up, UpAxis::y);
    // Vertices are numbered in the order in which triangles use them.
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3d x = mesh.vertices[mesh.triangles[t][k]].cast<float>().cast<double>();
        REQUIRE(read.vertices[read.triangles[t][k]] == turn * x);
      }
    }
  }
}

TEST_CASE("glb: indices of every width, strips, fans and none") {
  const TriangleMesh bytes = read_scene("byte.glb", glb_file(tetrahedron_scene()));
  CHECK(bytes.vertices.size() == 4);
  CHECK(signed_volume(bytes) == Catch::Approx(1.0 / 6));
  const auto check_same = [&](const std::string& file) {
    const TriangleMesh mesh = read_scene("same.glb", file);
    CHECK(mesh.vertices == bytes.vertices);
    CHECK(mesh.triangles == bytes.triangles);
  };
  check_same(
      glb_file(tetrahedron_scene(5123, 24), kTetrahedronCorners + index_bytes_of<std::uint16_t>()));
  check_same(
      glb_file(tetrahedron_scene(5125, 48), kTetrahedronCorners + index_bytes_of<std::uint32_t>()));
  Json bare = tetrahedron_scene();
  bare["meshes"][0]["primitives"][0].erase("indices");
  bare["meshes"][0]["primitives"][0]["mode"] = 5;
  CHECK(read_scene("strip.glb", glb_file(bare)).triangles ==
        std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}});
  bare["meshes"][0]["primitives"][0]["mode"] = 6;
  CHECK(read_scene("fan.glb", glb_file(bare)).triangles ==
        std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});
}

TEST_CASE("glb: numbers that are shares, with gaps between") {
  Json scene = tetrahedron_scene();
  const std::string places =
      raw_bytes<std::int16_t>({0, 0, 0, 9, 32767, 0, 0, 9, 0, 32767, 0, 9, 0, 0, -32767, 9});
  scene["bufferViews"][0] = {{"buffer", 0}, {"byteLength", 32}, {"byteStride", 8}};
  scene["bufferViews"][1]["byteOffset"] = 32;
  scene["buffers"][0]["byteLength"] = 44;
  scene["accessors"][0]["componentType"] = 5122;
  scene["accessors"][0]["normalized"] = true;
  scene["extensionsRequired"] = {"KHR_mesh_quantization"};
  const TriangleMesh mesh =
      read_scene("share.glb", glb_file(scene, places + index_bytes_of<std::uint8_t>()));
  CHECK(mesh.box().high == Eigen::Vector3d(1, 1, 0));
  CHECK(mesh.box().low == Eigen::Vector3d(0, 0, -1));
}

TEST_CASE("glb: nodes place meshes, and mirrors keep the outside") {
  Json scene = tetrahedron_scene();
  scene["nodes"] = {{{"children", {1, 2, 3}}, {"rotation", {0.70710677, 0, 0, 0.70710677}}},
                    {{"mesh", 0}, {"translation", {5, 0, 0}}, {"scale", {2, 2, 2}}},
                    {{"mesh", 0}, {"scale", {-1, 1, 1}}},
                    {{"mesh", 0}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 9, 8, 7, 1}}},
                    {{"mesh", 0}}};  // which the scene does not show
  const TriangleMesh mesh = read_scene("nodes.glb", glb_file(scene));
  CHECK(mesh.triangles.size() == 12);
  CHECK(signed_volume(mesh) == Catch::Approx((8 + 1 + 1) / 6.0));
  CHECK(inspect(mesh).turned_parts == 0);
  // Y becomes Z, Z becomes -Y.
  CHECK(mesh.box().low == Eigen::Vector3d(-1, -8, 0));
  CHECK(mesh.box().high == Eigen::Vector3d(10, 0, 9));
  scene.erase("scene");
  scene.erase("scenes");
  CHECK(read_scene("all.glb", glb_file(scene)).triangles.size() == 16);
}

TEST_CASE("gltf: buffers in the file, beside it, and elsewhere") {
  Json scene = tetrahedron_scene();
  const std::string buffer = kTetrahedronCorners + index_bytes_of<std::uint8_t>();
  const auto with_uri = [&](const std::string& uri) {
    scene["buffers"][0]["uri"] = uri;
    return scene.dump();
  };
  CHECK(read_scene("data.gltf",
                   with_uri("data:application/octet-stream;base64," + base::base64(buffer)))
            .triangles.size() == 4);
  scene_folder.file("my data.bin", buffer);
  CHECK(read_scene("beside.gltf", with_uri("./my%20data.bin")).triangles.size() == 4);
  check_scene_refused("up.gltf", with_uri("../data.bin"), "own folder");
  check_scene_refused("hidden.gltf", with_uri("a/%2E%2E/%2e%2e/data.bin"), "own folder");
  check_scene_refused("root.gltf", with_uri("/etc/passwd"), "own folder");
  check_scene_refused("web.gltf", with_uri("https://example.org/a.bin"), "own folder");
  check_scene_refused("escape.gltf", with_uri("a%2"), "not a file name");
  check_scene_refused("zero.gltf", with_uri("a%00b"), "not a file name");
  check_scene_refused("base64.gltf", with_uri("data:;base64,A"), "base64");
  scene_folder.file("short.bin", "short");
  check_scene_refused("short.gltf", with_uri("short.bin"), "should have 60 bytes");
  CHECK_THROWS_WITH(read_scene("gone.gltf", with_uri("gone.bin")), ContainsSubstring("gone.bin"));
  check_scene_refused("none.gltf", tetrahedron_scene().dump(), "has no data");
}

TEST_CASE("gltf: a file beside it counts once, however its name is written") {
  constexpr std::size_t kRepeats = 100'000;
  std::string buffer = kTetrahedronCorners;
  for (std::size_t i = 0; i < kRepeats; ++i) buffer += index_bytes_of<std::uint8_t>();
  scene_folder.file("a.bin", buffer);
  const std::size_t indices = kRepeats * kTetrahedronIndices.size();
  Json scene = tetrahedron_scene(5121, indices);
  scene["accessors"][1]["count"] = indices;
  const Json buffer_0 = scene["buffers"][0], views = scene["bufferViews"];
  const Json accessors = scene["accessors"];
  for (const char* list : {"buffers", "bufferViews", "accessors"}) scene[list] = Json::array();
  Json& primitives = scene["meshes"][0]["primitives"] = Json::array();
  // More triangles than one copy of the file allows, and fewer than four copies would.
  for (const char* uri : {"a.bin", "./a.bin", "%61.bin", ".//a.bin"}) {
    const std::size_t number = scene["buffers"].size();
    scene["buffers"].push_back(buffer_0);
    scene["buffers"].back()["uri"] = uri;
    for (std::size_t i = 0; i < 2; ++i) {
      scene["bufferViews"].push_back(views[i]);
      scene["bufferViews"].back()["buffer"] = number;
      scene["accessors"].push_back(accessors[i]);
      scene["accessors"].back()["bufferView"] = 2 * number + i;
    }
    primitives.push_back({{"attributes", {{"POSITION", 2 * number}}}, {"indices", 2 * number + 1}});
  }
  check_scene_refused("names.gltf", scene.dump(), "so often");
}

TEST_CASE("glb: what is wrong is refused") {
  const std::string whole = glb_file(tetrahedron_scene());
  check_scene_refused("cut.glb", whole.substr(0, whole.size() - 1), "promises");
  check_scene_refused("head.glb", whole.substr(0, 15), "cut off");
  std::string old = whole;
  old[4] = 1;
  check_scene_refused("old.glb", old, "glTF version 1");
  check_scene_refused("other.glb", "solid but not a scene", ".stl");
  check_scene_refused("json.glb",
                      "glTF" + word_bytes(2) + word_bytes(24) + word_bytes(4) + "JSON{...", "JSON");
  check_scene_refused("sparse.glb", changed_glb("/accessors/0/sparse", Json::object()), "sparse");
  check_scene_refused("draco.glb",
                      changed_glb("/extensionsRequired", {"KHR_draco_mesh_compression"}), "Draco");
  check_scene_refused(
      "meshopt.glb",
      changed_glb("/bufferViews/0/extensions", {{"EXT_meshopt_compression", Json::object()}}),
      "meshopt");
  check_scene_refused("new.glb", changed_glb("/extensionsRequired", {"XYZ_cubes"}), "XYZ_cubes");
  check_scene_refused("past.glb", changed_glb("/accessors/0/count", 5), "beyond its buffer");
  check_scene_refused("huge.glb", changed_glb("/accessors/0/count", 1e15), "beyond its buffer");
  check_scene_refused("offset.glb", changed_glb("/accessors/0/byteOffset", 0xffffffffffffffffU),
                      "beyond");
  check_scene_refused("view.glb", changed_glb("/bufferViews/0/byteOffset", 100), "beyond");
  check_scene_refused("step.glb", changed_glb("/bufferViews/0/byteStride", 4), "beyond");
  check_scene_refused("index.glb", changed_glb("/accessors/0/count", 3), "vertex 3");
  Json real = tetrahedron_scene();
  real["accessors"][1] = {
      {"bufferView", 1}, {"componentType", 5126}, {"count", 3}, {"type", "SCALAR"}};
  check_scene_refused("real.glb", glb_file(real), "whole");
  check_scene_refused("type.glb", changed_glb("/accessors/0/componentType", 5124), "5124");
  check_scene_refused("shape.glb", changed_glb("/accessors/0/type", "VEC4"), "VEC3");
  check_scene_refused("half.glb", changed_glb("/accessors/0/bufferView", 0.5), "whole number");
  check_scene_refused("mesh.glb", changed_glb("/nodes/0/mesh", 7), "meshes[7]");
  check_scene_refused("circle.glb", changed_glb("/nodes/0/children", {0}), "two parents");
  check_scene_refused("scale.glb", changed_glb("/nodes/0/scale", {1, 2}), "scale");
  check_scene_refused("far.glb", changed_glb("/nodes/0/scale", {1e300, 1, 1}), "finite");
  check_scene_refused("words.glb", changed_glb("/meshes/0/primitives", "none"), "glTF 2.0");
  check_scene_refused("lines.glb", changed_glb("/meshes/0/primitives/0/mode", 1), "no triangles");
  check_scene_refused("empty.glb", changed_glb("/scenes/0", Json::object()), "no triangles");
}

TEST_CASE("glb: a small file does not become a large mesh") {
  Json scene = tetrahedron_scene();
  scene["nodes"] = Json::array();
  Json all = Json::array();
  for (int i = 0; i < 20'000; ++i) {
    scene["nodes"].push_back({{"mesh", 0}});
    all.push_back(i);
  }
  scene["scenes"] = {{{"nodes", all}}};
  scene["meshes"][0]["primitives"] = Json::array();
  for (int i = 0; i < 100; ++i) {
    scene["meshes"][0]["primitives"].push_back(tetrahedron_scene()["meshes"][0]["primitives"][0]);
  }
  check_scene_refused("often.glb", glb_file(scene), "so often");
}

TEST_CASE("3mf: objects, components, items and units") {
  const TriangleMesh plain =
      read_scene("plain.3mf", package_3mf(model_3mf(kTetrahedron3mf, "<item objectid='1'/>")));
  CHECK(plain.vertices.size() == 4);
  CHECK(signed_volume(plain) == Catch::Approx(1.0 / 6));
  const std::string parts =
      "<object id='2'><components><component objectid='1'/>"
      "<component objectid='1' transform='-1 0 0 0 1 0 0 0 1 5 0 0'/></components></object>"
      "<object id='3' type='support'><components><component objectid='1'/></components></object>";
  const TriangleMesh placed = read_scene(
      "parts.3mf",
      package_3mf(
          model_3mf(kTetrahedron3mf + parts,
                    "<item objectid='2' transform='0 1 0 -1 0 0 0 0 1 0 0 7'/><item objectid='3'/>",
                    "centimeter")));
  CHECK(placed.triangles.size() == 8);
  CHECK(signed_volume(placed) == Catch::Approx(2000.0 / 6));
  CHECK(placed.box().low == Eigen::Vector3d(-10, 0, 70));
  CHECK(placed.box().high == Eigen::Vector3d(0, 50, 80));
}

TEST_CASE("3mf: objects of other parts") {
  const std::string root = model_3mf(
      "<object id='9'><components><component objectid='1' "
      "p:path='/3D/Objects/a.model'/></components></object>",
      "<item objectid='9'/>");
  const TriangleMesh mesh = read_scene(
      "other.3mf", test::stored_zip({{"_rels/.rels", k3mfRelations},
                                     {"3D/m.model", root},
                                     {"3D/Objects/a.model", model_3mf(kTetrahedron3mf, "")}}));
  CHECK(mesh.triangles.size() == 4);
  check_scene_refused("lost.3mf", package_3mf(root), "'3D/Objects/a.model' is missing");
}

TEST_CASE("3mf: the first part of a name is read, in any case of its letters") {
  const std::string model = model_3mf(kTetrahedron3mf, "<item objectid='1'/>");
  const TriangleMesh mesh = read_scene(
      "case.3mf", test::stored_zip(
                      {{"_RELS/.rels", k3mfRelations}, {"3d/M.MODEL", model}, {"3D/m.model", ""}}));
  CHECK(mesh.triangles.size() == 4);
}

TEST_CASE("3mf: blanks do not let a small file become a large mesh") {
  std::ostringstream out;
  base::ZipFile zip(out);
  zip.begin("_rels/.rels", 1000) << k3mfRelations;
  constexpr std::size_t kBlanks = std::size_t{12} << 20;
  zip.begin("3D/m.model", 2 * kBlanks)
      << model_3mf(tower_3mf(20) + std::string(kBlanks, ' '), "<item objectid='20'/>");
  zip.finish();
  check_scene_refused("blanks.3mf", out.str(), "so often");
}

TEST_CASE("3mf: what is wrong is refused") {
  const std::string item = "<item objectid='1'/>";
  const std::string whole = package_3mf(model_3mf(kTetrahedron3mf, item));
  check_scene_refused("cut.3mf", whole.substr(0, whole.size() / 2), "cut off");
  std::string damaged = whole;
  damaged[damaged.find("x='1'") + 3] = '2';
  check_scene_refused("damaged.3mf", damaged, "damaged");
  check_scene_refused("text.3mf", "once upon a time", "ZIP");
  check_scene_refused("office.3mf", test::stored_zip({{"word/document.xml", "<a/>"}}), ".rels");
  check_scene_refused("xml.3mf", package_3mf("<model>"), "not well-formed XML");
  check_scene_refused("doctype.3mf", package_3mf("<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>"),
                      "document type");
  check_scene_refused("unit.3mf", package_3mf(model_3mf(kTetrahedron3mf, item, "parsec")),
                      "parsec");
  check_scene_refused("item.3mf", package_3mf(model_3mf(kTetrahedron3mf, "<item objectid='4'/>")),
                      "object 4");
  check_scene_refused("none.3mf", package_3mf(model_3mf(kTetrahedron3mf, "")), "no triangles");
  check_scene_refused("twice.3mf",
                      package_3mf(model_3mf(std::string(kTetrahedron3mf) + kTetrahedron3mf, item)),
                      "two objects");
  check_scene_refused(
      "circle.3mf",
      package_3mf(model_3mf(
          "<object id='1'><components><component objectid='1'/></components></object>", item)),
      "hold themselves");
  check_scene_refused("tower.3mf", package_3mf(model_3mf(tower_3mf(59), "<item objectid='59'/>")),
                      "so often");
  const auto change = [&](std::string_view from, std::string_view to) {
    std::string text = model_3mf(kTetrahedron3mf, item);
    return package_3mf(text.replace(text.find(from), from.size(), to));
  };
  check_scene_refused("nan.3mf", change("x='1'", "x='nan'"), "vertex 1");
  check_scene_refused("lack.3mf", change("x='1'", ""), "vertex 1");
  check_scene_refused("index.3mf", change("v1='1'", "v1='4'"), "vertex 4");
  check_scene_refused("negative.3mf", change("v1='1'", "v1='-1'"), "triangle 3");
  check_scene_refused("matrix.3mf", change("<item ", "<item transform='1 0 0' "), "12 finite");
}

// Meshes of every format as they are read, and what is refused.

#include <fmt/format.h>

#include <catch2/catch_all.hpp>
#include <cstring>
#include <random>
#include <stop_token>

#include "qjulia/base/error.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/mesh/painted_mesh.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

const test::TemporaryFolder mesh_folder;

constexpr const char* kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// The mesh file is refused with a message that names it and says `why`.
void check_refused(const std::string& name, std::string_view bytes, const std::string& why) {
  const auto path = mesh_folder.file(name, bytes);
  CAPTURE(name, bytes.substr(0, 200));
  CHECK_THROWS_AS(read_mesh(path), InputError);
  CHECK_THROWS_WITH(read_mesh(path), ContainsSubstring(name) && ContainsSubstring(why));
}

TriangleMesh parsed(const std::string& name, std::string_view bytes) {
  return read_mesh(mesh_folder.file(name, bytes));
}

}  // namespace

TEST_CASE("obj: indices of every kind") {
  const TriangleMesh plain = parsed("plain.obj", kTetrahedron);
  CHECK(plain.vertices.size() == 4);
  CHECK(plain.triangles.size() == 4);
  const TriangleMesh dressed = parsed(
      "dressed.obj",
      "# made by hand\r\nmtllib none.mtl\r\n"
      "v 0 0 0 1 0.5 0.2\r\nv +1 0 0\r\nv 0 1e0 0\r\nv 0 0 1.0\r\nvt 0.5\r\nvn nan 0 0\r\n"
      "usemtl none\r\ns off\r\nf 1/1/1 3//1 2/1\r\nf -4 -3 -1\r\nf 1 -1 3\r\nf 2 3 4 # last\r\n");
  CHECK(dressed.vertices == plain.vertices);
  CHECK(dressed.triangles == plain.triangles);
  const TriangleMesh quad = parsed("quad.obj", "f 1 2 3 4\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n");
  CHECK(quad.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});
}

TEST_CASE("obj: what is wrong is refused") {
  check_refused("empty.obj", "", "empty");
  check_refused("words.obj", "hello\nworld\n", "no vertices");
  check_refused("points.obj", "v 0 0 0\nv 1 0 0\n", "no faces");
  check_refused("past.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4");
  check_refused("zero.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4");
  check_refused("back.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -1 -2 -4\n", "line 4");
  check_refused("huge.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 99999999999999999999\n", "line 4");
  check_refused("letter.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", "line 4");
  check_refused("pair.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "line 4");
  check_refused("nan.obj", "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "line 2");
  check_refused("inf.obj", "v 0 0 0\nv 1e300 0 0\nv 0 1 0\nf 1 2 3\n", "line 2");
  check_refused("comma.obj", "v 0 0 0\nv 1,5 0 0\nv 0 1 0\nf 1 2 3\n", "line 2");
  check_refused("short.obj", "v 0 0 0\nv 1 0\n", "line 2");
  check_refused("equal.obj", "v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n", "area");
  check_refused("line.obj", "v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 3\n", "area");
  check_refused("same.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 2\n", "area");
}

TEST_CASE("off: comments, colours and counts on the first line") {
  const TriangleMesh mesh = parsed("colour.off",
                                   "COFF 4 2 0 # counts\n# corners\n0 0 0 255 0 0\n1 0 0 9 9 9\n\n"
                                   "1 1 0 1 1 1\n0 1 0 1 1 1 # end\n3 0 1 2 255 0 0\n"
                                   "3 0 2 3 0.5 0.5 0.5");
  CHECK(mesh.vertices.size() == 4);
  CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});
}

TEST_CASE("off: what is wrong is refused") {
  check_refused("empty.off", "", "empty");
  check_refused("words.off", "hello", "OFF");
  // Without a blank after the header, as in a well-known collection.
  CHECK(parsed("glued.off", "OFF3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").triangles.size() == 1);
  CHECK(parsed("lower.off", "off\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").triangles.size() == 1);
  check_refused("four.off", "4OFF\n3 1 0\n0 0 0 0\n1 0 0 0\n0 1 0 0\n3 0 1 2\n", "OFF");
  check_refused("binary.off", "OFF BINARY\n\1\2\3", "binary");
  check_refused("counts.off", "OFF\nmany few\n", "counts");
  check_refused("none.off", "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n", "no faces");
  check_refused("huge.off", "OFF\n100000000 100000000 0\n0 0 0\n", "promises");
  check_refused("overflow.off", "OFF\n9223372036854775807 9223372036854775807 0\n0 0 0\n",
                "promises");
  check_refused("cut.off", "OFF\n3 1 0\n0 0 0\n1.000000 0 0\n0.000000 1 0\n", "early");
  check_refused("past.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "line 6");
  check_refused("negative.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n", "line 6");
  check_refused("long.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n4000000000 0 1 2\n", "line 6");
  check_refused("nan.off", "OFF\n3 1 0\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n", "line 4");
}

TEST_CASE("stl: text") {
  constexpr std::string_view kFacet =
      "solid part\n facet normal nan 0 0\n  OUTER loop\n   vertex 0 0 0\n   vertex 1 0 0\n"
      "   vertex 0 1 0\n  endloop\n endfacet\n";
  const std::string whole = std::string(kFacet) + "endsolid part\n";
  CHECK(parsed("text.stl", whole).triangles == std::vector<Triangle>{{0, 1, 2}});
  check_refused("cut.stl", kFacet, "endsolid");
  check_refused("cutter.stl", std::string_view(whole).substr(0, 90), "line 6");
  check_refused("none.stl", "solid part\nendsolid part\n", "no triangles");
  check_refused("nan.stl", "solid\nouter loop\nvertex 0 nan 0\nendloop\nendsolid", "line 3");
  check_refused("two.stl", "solid\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nendloop\nendsolid",
                "line 5");
  check_refused("four.stl",
                "solid\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex 1 1 0\nvertex 1 0 0\n"
                "endloop\nendsolid",
                "line 6");
}

TEST_CASE("stl: binary") {
  write_mesh(shapes::box(), mesh_folder.path() / "box.stl");
  const std::string bytes = test::read_text(mesh_folder.path() / "box.stl");
  check_refused("empty.stl", "", "empty");
  check_refused("short.stl", bytes.substr(0, bytes.size() - 7), "cut off");
  check_refused("header.stl", bytes.substr(0, 84), "cut off");
  std::string huge = bytes;
  std::memcpy(huge.data() + 80, "\xff\xff\xff\xff", 4);
  check_refused("huge.stl", huge, "promises 4294967295");
  std::string nan = bytes;
  std::memcpy(nan.data() + 84 + 50 + 12, "\0\0\xc0\x7f", 4);
  check_refused("nan.stl", nan, "triangle 2");
  // A few bytes too many do no harm, a triangle too many would be lost.
  CHECK(parsed("more.stl", bytes + "\n").triangles.size() == 12);
  check_refused("most.stl", bytes + std::string(50, '\0'), "holds 13");
  // A binary file may begin with the word that marks text.
  std::string solid = bytes;
  std::memcpy(solid.data(), "solid", 5);
  CHECK(parsed("solid.stl", solid).triangles.size() == 12);
}

TEST_CASE("ply: text with properties of every kind") {
  const TriangleMesh mesh = parsed(
      "rich.ply",
      "ply\r\nformat ascii 1.0\r\ncomment element of surprise\r\nobj_info property\r\n"
      "element camera 1\r\nproperty list int float view\r\n"
      "element vertex 4\r\nproperty float nx\r\nproperty double x\r\nproperty float y\r\n"
      "property float z\r\nproperty uchar red\r\n"
      "element face 2\r\nproperty uchar flags\r\nproperty list uint8 int32 vertex_index\r\n"
      "property list uchar float texcoord\r\nelement edge 1\r\nproperty int vertex1\r\n"
      "end_header\r\n2 0.5 0.5\r\nnan 0 0 0 255\r\n0 1 0 0 255\r\n0 1 1 0 255\r\n0 0 1 0 255\r\n"
      "1 3 0 1 2 6 0 0 0 1 1 1\r\n1 3 0 2 3 0\r\n7");
  CHECK(mesh.vertices.size() == 4);
  CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}, {0, 2, 3}});
}

TEST_CASE("ply: big-endian bytes with unusual types") {
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty short x\nproperty double y\n"
      "property float z\nelement face 1\nproperty list uint ushort vertex_indices\nend_header\n";
  const auto append = [&bytes]<class T>(T value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(std::reverse_iterator(raw + sizeof value), std::reverse_iterator(raw + 0));
  };
  for (const auto& [x, y] : {std::pair(0, 0.0), std::pair(300, 0.0), std::pair(0, 2.5)}) {
    append(static_cast<std::int16_t>(x));
    append(y);
    append(1.0F);
  }
  append(std::uint32_t{3});
  for (std::uint16_t v = 0; v < 3; ++v) append(v);
  const TriangleMesh mesh = parsed("big.ply", bytes);
  CHECK(mesh.vertices == std::vector<Eigen::Vector3d>{{0, 0, 1}, {300, 0, 1}, {0, 2.5, 1}});
  CHECK(mesh.triangles == std::vector<Triangle>{{0, 1, 2}});
}

TEST_CASE("what vertices say of their share is read with the mesh") {
  const auto text = [](const char* properties, const char* rows) {
    return fmt::format(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
        "float z\n{}element face 1\nproperty list uchar int vertex_indices\nend_header\n{}4 0 1 2 "
        "3\n",
        properties, rows);
  };
  const auto read = [&](const std::string& name, const std::string& bytes,
                        const std::string& property = {}) {
    return read_painted_mesh(mesh_folder.file(name, bytes), property);
  };
  const char* const colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  const std::string in_color =
      text(colors, "0 0 0 255 255 255\n1 0 0 0 0 0\n1 1 0 51 51 51\n0 1 0 255 0 0\n");
  const PaintedMesh mesh = read("color.ply", in_color);
  CHECK(mesh.vertices[2] == Eigen::Vector3d(1, 1, 0));
  CHECK(mesh.triangles.size() == 2);
  REQUIRE(mesh.shares.size() == 4);
  CHECK(mesh.shares[0] == 1);
  CHECK(mesh.shares[1] == 0);
  CHECK(mesh.shares[2] == Catch::Approx(0.2));
  CHECK(mesh.shares[3] == Catch::Approx(1.0 / 3));
  const std::string with_number =
      text("property float wild\n", "0 0 0 1\n1 0 0 0\n1 1 0 0.25\n0 1 0 1\n");
  CHECK(read("number.ply", with_number, "wild").shares == std::vector<float>{1, 0, 0.25, 1});
  // The mesh itself is what it is without.
  CHECK(parsed("color.ply", in_color).vertices == parsed("number.ply", with_number).vertices);
  const PaintedMesh obj = read(
      "color.obj", "v 0 0 0 1 1 1\nv 1 0 0 0 0 0\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0 0 0 1\nf 1 2 3 4\n");
  CHECK(obj.triangles.size() == 2);
  CHECK(obj.shares[2] == Catch::Approx(0.5));

  CHECK_THROWS_WITH(read("number.ply", with_number), ContainsSubstring("red, green and blue"));
  CHECK_THROWS_WITH(read("color.ply", in_color, "wild"), ContainsSubstring("no property 'wild'"));
  CHECK_THROWS_WITH(read("plain.obj", kTetrahedron),
                    ContainsSubstring("no color") && ContainsSubstring("line 1"));
  CHECK_THROWS_WITH(read("color.obj", "v 0 0 0 1 1 2\n"), ContainsSubstring("the color 1 1 2"));
  CHECK_THROWS_WITH(read("color.obj", kTetrahedron, "wild"), ContainsSubstring("property"));
  CHECK_THROWS_WITH(read("color.stl", "solid"), ContainsSubstring(".obj or .ply"));
  for (const auto& [wrong, range] : {std::pair{"1.5", "from 0 to 1.5"},
                                     {"-0.25", "from -0.25 to 1"},
                                     {"nan", "no number"},
                                     {"inf", "no number"}}) {
    const std::string rows = fmt::format("0 0 0 1\n1 0 0 {}\n1 1 0 0\n0 1 0 1\n", wrong);
    CHECK_THROWS_WITH(read("wrong.ply", text("property float wild\n", rows.c_str()), "wild"),
                      ContainsSubstring("wrong.ply") && ContainsSubstring("vertex 1") &&
                          ContainsSubstring("'wild'") && ContainsSubstring(range));
  }
}

TEST_CASE("a coordinate is a property like any other") {
  const auto read = [](float low, float high) {
    const std::string text = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty "
        "float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n{} 0 0\n{} "
        "0 0\n{} 1 0\n{} 1 0\n4 0 1 2 3\n",
        low, high, high, low);
    return read_painted_mesh(mesh_folder.file("x.ply", text), "x");
  };
  CHECK(read(0.25F, 1).shares == std::vector<float>{0.25F, 1, 1, 0.25F});
  CHECK_THROWS_WITH(read(-3, 0.5F), ContainsSubstring("x.ply") &&
                                        ContainsSubstring("'x' goes from -3 to 0.5") &&
                                        ContainsSubstring("vertex 0") && ContainsSubstring("ramp"));
}

TEST_CASE("colors beyond what their type can say are refused, though their mean is a share") {
  const auto refuse = [](const char* type, const char* color, const char* what) {
    const std::string text = fmt::format(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty "
        "float z\nproperty {0} red\nproperty {0} green\nproperty {0} blue\nelement face 1\n"
        "property list uchar int vertex_indices\nend_header\n0 0 0 0 0 0\n1 0 0 {1}\n0 1 0 0 0 "
        "0\n3 0 1 2\n",
        type, color);
    CAPTURE(type, color);
    CHECK_THROWS_WITH(read_painted_mesh(mesh_folder.file("beyond.ply", text)),
                      ContainsSubstring("beyond.ply") && ContainsSubstring("vertex 1") &&
                          ContainsSubstring(what));
  };
  refuse("uchar", "300 0 0", "a red of 300");
  refuse("uint8", "0 -1 200", "a green of -1");
  refuse("uchar", "0 0.5 0", "a green of 0.5");
  refuse("float", "0.5 0.5 -0.25", "a blue of -0.25");
  refuse("float", "0 1.5 0", "a green of 1.5");
  refuse("int", "200 0 0", "a red of 200");
  refuse("float", "0 nan 0", "no number for its 'green'");
}

TEST_CASE("ply: what is wrong is refused") {
  const std::string vertices =
      "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string faces = "element face 1\nproperty list uchar int vertex_indices\n";
  const std::string points = "0 0 0\n1 0 0\n0 1 0\n";
  const auto text = [](const std::string& header, const std::string& body) {
    return "ply\nformat ascii 1.0\n" + header + "end_header\n" + body;
  };
  CHECK(parsed("good.ply", text(vertices + faces, points + "3 0 1 2\n")).triangles.size() == 1);
  check_refused("empty.ply", "", "empty");
  check_refused("cut_header.ply", "ply\nformat ascii 1.0\nelement vertex 3\n", "cut off");
  check_refused("format.ply", "ply\nformat cuneiform 1.0\nend_header\n", "format");
  check_refused("type.ply", text("element vertex 3\nproperty quad x\n", points), "quad");
  check_refused("points.ply", text(vertices, points), "no faces");
  check_refused("no_faces.ply",
                text(vertices + "element face 0\nproperty list uchar int vertex_indices\n", points),
                "no faces");
  check_refused("strips.ply",
                text(vertices + "element tristrips 1\nproperty list int int vertex_indices\n",
                     points + "3 0 1 2\n"),
                "strips");
  check_refused("flat.ply",
                text("element vertex 3\nproperty float x\nproperty float y\n" + faces, points),
                "no z");
  check_refused("order.ply", text(faces + vertices, "3 0 1 2\n" + points), "before");
  check_refused("past.ply", text(vertices + faces, points + "3 0 1 3\n"), "vertex is 3");
  check_refused("negative.ply", text(vertices + faces, points + "3 0 1 -1\n"), "vertex is -1");
  check_refused("pair.ply", text(vertices + faces, points + "2 0 1\n"), "length is 2");
  check_refused("nan.ply", text(vertices + faces, "0 0 nan\n1 0 0\n0 1 0\n3 0 1 2\n"), "finite");
  check_refused("cut.ply", text(vertices + faces, points + "3 0 1"), "early");
  check_refused("huge.ply",
                "ply\nformat binary_little_endian 1.0\nelement vertex 100000000\nproperty float x\n"
                "property float y\nproperty float z\nelement face 100000000\n"
                "property list uchar int vertex_indices\nend_header\nshort",
                "promises 100000000");
  check_refused("long_face.ply",
                "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\n"
                "property float y\nproperty float z\nelement face 1\n"
                "property list int int vertex_indices\nend_header\n" +
                    std::string(12, '\0') + "\xff\xff\xff\x7f" + std::string(8, '\0'),
                "early");
  write_mesh(shapes::sphere(2), mesh_folder.path() / "sphere.ply");
  const std::string sphere = test::read_text(mesh_folder.path() / "sphere.ply");
  check_refused("cut_faces.ply", std::string_view(sphere).substr(0, sphere.size() - 1), "early");
  check_refused("cut_vertices.ply", std::string_view(sphere).substr(0, 600), "promises");
}

TEST_CASE("random bytes are refused or read, never worse") {
  std::mt19937 random(5);
  for (int trial = 0; trial < 50; ++trial) {
    std::string bytes(1 + random() % 400, '\0');
    for (char& byte : bytes) byte = static_cast<char>(random());
    if (trial < 4) check_refused("random.ply", bytes, "ply");
    for (const char* name : {"random.ply", "random.obj", "random.off", "random.stl"}) {
      CHECK_THROWS_AS(parsed(name, bytes), InputError);
    }
  }
}

TEST_CASE("files with damaged bytes are refused or read, never worse") {
  const TriangleMesh sphere = shapes::sphere(1);
  std::mt19937 random(6);
  for (const std::string name : {"damaged.ply", "damaged.obj", "damaged.off", "damaged.stl"}) {
    write_mesh(sphere, mesh_folder.path() / name);
    const std::string bytes = test::read_text(mesh_folder.path() / name);
    for (int trial = 0; trial < 150; ++trial) {
      std::string damaged =
          bytes.substr(0, trial % 3 == 0 ? random() % bytes.size() : bytes.size());
      for (int hits = trial % 5; hits > 0 && !damaged.empty(); --hits) {
        damaged[random() % damaged.size()] = static_cast<char>(random());
      }
      try {
        const TriangleMesh mesh = parsed(name, damaged);
        CHECK(!mesh.triangles.empty());
        CHECK(mesh.triangles.size() <= sphere.triangles.size() + 4);
        for (const auto& triangle : mesh.triangles) {
          for (const auto v : triangle) CHECK(v < mesh.vertices.size());
        }
      } catch (const InputError&) {
        SUCCEED();
      }
    }
  }
}

TEST_CASE("a mesh that is missing, a folder or of another type is refused") {
  CHECK_THROWS_WITH(read_mesh(mesh_folder.path() / "gone.obj"),
                    ContainsSubstring("gone.obj") && ContainsSubstring("no such file"));
  std::filesystem::create_directory(mesh_folder.path() / "folder.obj");
  CHECK_THROWS_WITH(read_mesh(mesh_folder.path() / "folder.obj"), ContainsSubstring("folder"));
  check_refused("scene.fbx", "{}", ".ply");
  check_refused("noextension", "v 0 0 0\n", ".ply");
}

TEST_CASE("byte order marks: UTF-8 is read, UTF-16 is refused by name") {
  const std::string mark = "\xEF\xBB\xBF";
  const std::string obj = kTetrahedron;
  CHECK(parsed("mark.obj", mark + obj).vertices == parsed("plain.obj", obj).vertices);
  CHECK(parsed("mark.off", mark + "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").box().high ==
        Eigen::Vector3d(1, 1, 0));
  CHECK(parsed("mark.ply", mark + "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                                  "property float y\nproperty float z\nelement face 1\n"
                                  "property list uchar int vertex_indices\nend_header\n"
                                  "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")
            .triangles.size() == 1);
  CHECK(parsed("mark.stl", mark + "solid\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
                                  "vertex 0 1 0\nendloop\nendsolid")
            .triangles.size() == 1);
  for (const std::string name : {"wide.obj", "wide.off", "wide.ply", "wide.stl"}) {
    std::string wide = "\xFF\xFE";
    for (const char c : obj) (wide += c) += '\0';
    check_refused(name, wide, "UTF-16");
  }
}

TEST_CASE("meshes that are too large or too small to compute with are refused with the limit") {
  const auto sized = [](double side) {
    return fmt::format("v 0 0 0\nv {0:e} 0 0\nv 0 {0:e} 0\nv 0 0 {0:e}\nf 1 3 2\nf 1 2 4\n", side);
  };
  check_refused("large.obj", sized(1e15), "1e+12");
  check_refused("small.obj", sized(1e-15), "1e-12");
  CHECK(parsed("fine.obj", sized(9e11)).triangles.size() == 2);
  CHECK(parsed("fine.obj", sized(2e-12)).triangles.size() == 2);
  // What is too small for single precision is 0.
  CHECK(parsed("tiny.obj", "v 1e-60 1e-400 -1e-50\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").box().low ==
        Eigen::Vector3d::Zero());
}

TEST_CASE("text .stl files are known by their first word in any case") {
  CHECK(parsed("capitals.stl",
               "SOLID PART\nFACET NORMAL 0 0 1\nOUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\n"
               "VERTEX 0 1 0\nENDLOOP\nENDFACET\nENDSOLID PART\n")
            .triangles.size() == 1);
  // Facets in one line each.
  CHECK(parsed("lines.stl",
               "solid vertex\nfacet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0 vertex 0 1 "
               "0 endloop endfacet\nendsolid vertex\n")
            .triangles.size() == 1);
}

TEST_CASE("a file of another type is refused with what it seems to be") {
  using namespace std::string_view_literals;
  for (const std::string name : {"seems.obj", "seems.off", "seems.ply", "seems.stl"}) {
    check_refused(name, "\x89PNG\r\n\x1a\n\0\0\0\rIHDR"sv, "a PNG picture");
    check_refused(name, "<!DOCTYPE html>\n<title>Not found</title>", "an HTML page");
    check_refused(name, "<?xml version=\"1.0\"?><COLLADA/>", "an XML document");
    check_refused(name, "PK\3\4 a 3MF scene", "a ZIP archive");
    check_refused(name, "\x1f\x8b\x08", "gunzip");
    check_refused(name, "{\"asset\": {}}", "a JSON document");
    check_refused(name, "glTF\2\0\0\0"sv, "glTF");
    check_refused(name, "version https://git-lfs.github.com/spec/v1\n", "git lfs pull");
    check_refused(name, std::string(300, '\0'), "zero bytes");
  }
  check_refused("obj_inside.ply", kTetrahedron, "its name ends in .obj");
  check_refused("ply_inside.obj", "ply\nformat ascii 1.0\n", "its name ends in .ply");
  check_refused("stl_inside.off", "solid part\n facet normal 0 0 1\n", "its name ends in .stl");
  check_refused("off_inside.stl", "OFF\n3 1 0\n0 0 0\n", "its name ends in .off");
  // The count of a binary file is wrong.
  write_mesh(shapes::box(), mesh_folder.path() / "count.stl");
  std::string bytes = test::read_text(mesh_folder.path() / "count.stl");
  bytes[80] = 13;
  check_refused("count.stl", bytes,
                "promises 13 triangles (734 bytes) and it holds 12 (684 bytes)");
}

TEST_CASE("lines that go on after a backslash, and lines that end as on old computers") {
  CHECK(parsed("long.obj", "v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 \\\n 3 \\\n2\nf 1 2 4\n")
            .triangles.size() == 2);
  std::string text = kTetrahedron;
  std::ranges::replace(text, '\n', '\r');
  CHECK(parsed("old.obj", text).triangles.size() == 4);
}

TEST_CASE("a stop request ends reading") {
  std::stop_source source;
  source.request_stop();
  for (const std::string name : {"stop.obj", "stop.off", "stop.ply", "stop.stl"}) {
    write_mesh(shapes::sphere(1), mesh_folder.path() / name);
    CHECK_THROWS_AS(read_mesh(mesh_folder.path() / name, source.get_token()), Interrupted);
  }
}

// Files that pages send: what their names may be, and that they see no files beside them.

#include <catch2/catch_all.hpp>
#include <filesystem>
#include <string>

#include "explore/uploaded.hpp"
#include "qjulia/base/error.hpp"

using namespace qjulia;
using namespace qjulia::explore;
using Catch::Matchers::ContainsSubstring;

namespace {

const std::string kTetrahedron =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

std::string problem_of(const Upload& upload) {
  try {
    (void)uploaded_mesh(upload);
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

}  // namespace

TEST_CASE("Names of files from pages lead nowhere") {
  CHECK(harmless_name("bunny-2.v1_a.obj") == "bunny-2.v1_a.obj");
  CHECK(harmless_name("../../etc/passwd") == ".._.._etc_passwd");
  CHECK(harmless_name("") == "file");
  CHECK(harmless_name("..") == "file");
  CHECK(harmless_name(std::string("a\0b\n.obj", 8)) == "a_b_.obj");
  CHECK(harmless_name(std::string(500, 'x') + ".obj").size() == 80);
  CHECK(harmless_name(std::string(500, 'x') + ".obj").ends_with("x.obj"));
}

TEST_CASE("A mesh from a page is that of its file, and messages name it as the page does") {
  CHECK(uploaded_mesh({"a b.obj", kTetrahedron}).triangles.size() == 4);
  CHECK_THAT(problem_of({"a b.obj", "v 0 0\n"}), ContainsSubstring("'a_b.obj'"));
  const std::string folder = std::filesystem::temp_directory_path().string();
  CHECK_THAT(problem_of({"x.obj", ""}), !ContainsSubstring(folder));
  CHECK_THAT(problem_of({"x.exe", kTetrahedron}), ContainsSubstring("'x.exe' is no mesh"));
  CHECK_THROWS_AS(uploaded_map({"x.qjulia.json", "{}"}), InputError);
  CHECK_THROWS_AS(uploaded_map({"x.obj", kTetrahedron}), InputError);
}

TEST_CASE("A scene from a page reads no files but itself") {
  for (const char* uri : {"/etc/passwd", "../passwd", "file:///etc/passwd", "other.bin"}) {
    const std::string scene = R"({"asset":{"version":"2.0"},"buffers":[{"uri":")" +
                              std::string(uri) +
                              R"(","byteLength":36}],"bufferViews":[{"buffer":0,"byteLength":36}],
      "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],
      "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]})";
    const std::string problem = problem_of({"x.gltf", scene});
    INFO(uri);
    // The last one lies where it may, but is not there.
    const bool is_inside = std::string(uri) == "other.bin";
    CHECK_THAT(problem, ContainsSubstring(is_inside ? "cannot read mesh 'other.bin'"
                                                    : "only files in its own folder"));
  }
}

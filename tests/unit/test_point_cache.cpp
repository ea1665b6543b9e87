// Point caches: what is read of them, and what is refused.

#include <catch2/catch_all.hpp>
#include <limits>

#include "obj_text.hpp"
#include "point_cache.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/point_cache.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::StartsWith;
using namespace qjulia;
using qjulia::test::npy_text;
using qjulia::test::saved_cache;
using qjulia::test::TemporaryFolder;

namespace {

/// A ball that grows and moves, with numbers that single precision does not hold.
std::vector<TriangleMesh> growing_ball() {
  std::vector<TriangleMesh> frames(3, shapes::sphere(1));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    for (Eigen::Vector3d& x : frames[i].vertices) {
      x = (1 + 0.1 * static_cast<double>(i)) * x + Eigen::Vector3d(0.3, 0, 0.1);
    }
  }
  return frames;
}

/// Why the cache's first frame is not read; empty where it is.
std::string cache_problem(const std::string& bytes) {
  const TemporaryFolder folder;
  const auto path = folder.file("walk.npz", bytes);
  try {
    read_and_inspect_frame(path, 0);
  } catch (const InputError& error) {
    CHECK_THAT(error.what(), StartsWith("cannot read mesh '" + path.string() + "': "));
    return error.what();
  }
  return {};
}

const std::string kFaces = npy_text("|u1", "1, 3", std::string("\0\1\2", 3));

std::string corners(float last = 1) {
  std::string bytes;
  for (const float x : {0.F, 0.F, 0.F, 1.F, 0.F, 0.F, 0.F, last, 0.F}) {
    test::append_number(bytes, x);
  }
  return bytes;
}

}  // namespace

TEST_CASE("frames of a point cache are the meshes of files with the same numbers") {
  const TemporaryFolder folder;
  const auto frames = growing_ball();
  const std::string faces = test::faces_text(frames[0]);
  const std::string single = test::vertices_text<float>(frames),
                    dbl = test::vertices_text<double>(frames);
  for (const std::string& bytes :
       {saved_cache(single, faces), saved_cache(dbl, faces), test::packed_cache(single, faces),
        test::packed_cache(dbl, faces)}) {
    const auto cache = folder.file("ball.npz", bytes);
    CHECK(is_point_cache(cache));
    REQUIRE(count_frames(cache) == 3);
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const auto path = folder.file("ball.obj", test::obj_text(frames[i]));
      const InspectedMesh of_file = read_and_inspect_mesh(path);
      const InspectedMesh of_cache = read_and_inspect_frame(cache, i);
      CHECK(of_cache.mesh.vertices == of_file.mesh.vertices);
      CHECK(of_cache.mesh.triangles == of_file.mesh.triangles);
      CHECK(of_cache.report.warnings() == of_file.report.warnings());
    }
    CHECK(read_frame(cache, 1).vertices.size() == frames[1].vertices.size());
    CHECK_THROWS_WITH(read_frame(cache, 3), ContainsSubstring("it has 3 frames"));
  }
  CHECK_FALSE(is_point_cache("ball.obj"));
}

TEST_CASE("faces may have any whole numbers") {
  const std::string vertices = npy_text("<f4", "1, 3, 3", corners());
  for (const auto& [type, size] : std::vector<std::pair<std::string, std::size_t>>{{"|i1", 1},
                                                                                   {"|u1", 1},
                                                                                   {"<i2", 2},
                                                                                   {"<u2", 2},
                                                                                   {"<i4", 4},
                                                                                   {"<u4", 4},
                                                                                   {"<i8", 8},
                                                                                   {"<u8", 8}}) {
    std::string bytes;
    for (const char* index : {"\0", "\1", "\2"}) {
      bytes += *index;
      bytes.append(size - 1, '\0');
    }
    CAPTURE(type);
    CHECK(cache_problem(saved_cache(vertices, npy_text(type, "1, 3", bytes))).empty());
  }
}

TEST_CASE("a point cache that is damaged, of another shape or type is refused by name") {
  const std::string good = npy_text("<f4", "1, 3, 3", corners());
  REQUIRE(cache_problem(saved_cache(good, kFaces)).empty());
  const auto vertices = [](const std::string& array) {
    return cache_problem(saved_cache(array, kFaces));
  };
  const auto faces = [&](const std::string& array) {
    return cache_problem(saved_cache(good, array));
  };
  CHECK_THAT(cache_problem(test::stored_zip({{"points.npy", good}})),
             ContainsSubstring("it has no array 'vertices'"));
  CHECK_THAT(cache_problem(test::stored_zip({{"vertices.npy", good}})),
             ContainsSubstring("it has no array 'faces'"));
  CHECK_THAT(cache_problem("PK"), ContainsSubstring("not a complete ZIP archive"));
  std::string spoilt = saved_cache(good, kFaces);
  spoilt[spoilt.find("<f4") + 120] ^= 1;
  CHECK_THAT(cache_problem(spoilt), ContainsSubstring("'vertices.npy' in it is damaged"));
  CHECK_THAT(vertices("no array"), ContainsSubstring("'vertices' is no array of NumPy's"));
  CHECK_THAT(vertices(good.substr(0, 40)), ContainsSubstring("'vertices' is no array of NumPy's"));
  CHECK_THAT(vertices(npy_text(">f4", "1, 3, 3", corners())),
             ContainsSubstring("'vertices' are numbers of the type '>f4'"));
  CHECK_THAT(vertices(npy_text("<f4", "3, 3", corners())),
             ContainsSubstring("'vertices' has the shape (3, 3); give frames"));
  CHECK_THAT(vertices(npy_text("<f4", "1, 3, 3", corners(), "True")),
             ContainsSubstring("'vertices' is in Fortran's order"));
  for (const char* shape :
       {"2, 3, 3", "6148914691236517205, 4, 3", "1, 2, 3", "1, 4611686018427387905, 3"}) {
    CAPTURE(shape);
    CHECK_THAT(vertices(npy_text("<f4", shape, corners())),
               ContainsSubstring("'vertices' has the shape") && ContainsSubstring("9 numbers"));
  }
  CHECK_THAT(vertices(npy_text("<f4", "0, 3, 3", corners())),
             ContainsSubstring("'vertices' is empty, of the shape (0, 3, 3)"));
  CHECK_THAT(vertices(npy_text("<f4", "1, 3, 3", corners(std::numeric_limits<float>::infinity()))),
             ContainsSubstring("vertex 2 in frame 0 of 'vertices'"));
  CHECK_THAT(vertices(npy_text("<f4", "1, 3, 3", corners(0))),
             ContainsSubstring("frame 0, from 0 on: ") && ContainsSubstring("has an area"));
  CHECK_THAT(faces(npy_text("<f4", "1, 3", std::string(12, '\0'))),
             ContainsSubstring("'faces' are numbers of the type '<f4'"));
  CHECK_THAT(faces(npy_text("|u1", "3", std::string(3, '\0'))),
             ContainsSubstring("'faces' has the shape (3); give triangles"));
  CHECK_THAT(faces(npy_text("|u1", "2, 3", std::string(3, '\0'))),
             ContainsSubstring("'faces' has the shape (2, 3) and 3 numbers"));
  CHECK_THAT(faces(npy_text("|i1", "1, 3", std::string("\0\1\xff", 3))),
             ContainsSubstring("'faces' has the index -1 in row 0, and there are 3 vertices"));
  CHECK_THAT(faces(npy_text("|i1", "1, 3", std::string("\0\1\3", 3))),
             ContainsSubstring("'faces' has the index 3 in row 0"));
  // Faces are checked before any frame is read.
  const TemporaryFolder folder;
  CHECK_THROWS_WITH(
      count_frames(folder.file("w.npz", saved_cache(good, npy_text("|O", "1, 3", "")))),
      ContainsSubstring("'faces' are numbers of the type '|O'"));
}

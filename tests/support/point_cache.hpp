#pragma once
/// Point caches as NumPy writes them, made here so that tests of reading need no NumPy.

#include <array>
#include <bit>
#include <cstdint>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/zip_file.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "stored_zip.hpp"

namespace qjulia::test {

/// An array's file. @param type such as "<f4". @param shape such as "2, 3".
inline std::string npy_text(const std::string& type, const std::string& shape,
                            const std::string& values, const std::string& is_fortran = "False") {
  std::string text =
      "{'descr': '" + type + "', 'fortran_order': " + is_fortran + ", 'shape': (" + shape + "), }";
  text.append(63 - (10 + text.size()) % 64, ' ');
  text += '\n';
  using namespace std::string_literals;
  return "\x93NUMPY\1\0"s + static_cast<char>(text.size() & 0xffU) +
         static_cast<char>(text.size() >> 8U) + text + values;
}

template <class Number>
void append_number(std::string& bytes, Number number) {
  for (const char byte : std::bit_cast<std::array<char, sizeof(Number)>>(number)) bytes += byte;
}

/// `vertices.npy` of frames with as many vertices each. @tparam Real float or double.
template <class Real>
std::string vertices_text(const std::vector<TriangleMesh>& frames) {
  std::string bytes;
  for (const TriangleMesh& frame : frames) {
    for (const Eigen::Vector3d& x : frame.vertices) {
      for (const double coordinate : x) append_number(bytes, static_cast<Real>(coordinate));
    }
  }
  return npy_text(
      std::is_same_v<Real, float> ? "<f4" : "<f8",
      std::to_string(frames.size()) + ", " + std::to_string(frames.front().vertices.size()) + ", 3",
      bytes);
}

/// `faces.npy`, of the type "<i8".
inline std::string faces_text(const TriangleMesh& mesh) {
  std::string bytes;
  for (const Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t corner : triangle) append_number(bytes, std::int64_t{corner});
  }
  return npy_text("<i8", std::to_string(mesh.triangles.size()) + ", 3", bytes);
}

/// As `numpy.savez` writes it.
inline std::string saved_cache(const std::string& vertices, const std::string& faces) {
  return stored_zip({{"vertices.npy", vertices}, {"faces.npy", faces}});
}

/// As `numpy.savez_compressed` writes it.
inline std::string packed_cache(const std::string& vertices, const std::string& faces) {
  std::stringstream out;
  base::ZipFile zip(out);
  zip.begin("vertices.npy", vertices.size()) << vertices;
  zip.begin("faces.npy", faces.size()) << faces;
  zip.finish();
  return out.str();
}

}  // namespace qjulia::test

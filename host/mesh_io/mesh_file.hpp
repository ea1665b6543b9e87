#pragma once
/// What the readers of mesh files share: the file in memory, its words and numbers, and the faces
/// that they fill.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "qjulia/mesh/mesh.hpp"

namespace qjulia::shape {

constexpr std::size_t kPolled = std::size_t{1} << 16;  ///< vertices or faces between two polls
constexpr std::uint64_t kLargestFile = std::uint64_t{16} << 30;  ///< bytes

/// A mesh file in memory, with what is needed to complain about it.
class MeshFile {
 public:
  /// @throws InputError when the file cannot be read or is obviously of another type.
  MeshFile(std::filesystem::path path, std::string extension, std::stop_token stop);
  /// A file of a type that `mesh_formats` has not: any bytes. @throws InputError as above
  MeshFile(std::filesystem::path path, std::stop_token stop);

  std::string_view bytes() const { return bytes_; }
  /// The bytes as text without a byte order mark.
  /// @throws InputError where they are UTF-16 or UTF-32.
  std::string_view text() const;

  /// The place of a file that this one names, from this one's folder: the same for all ways to
  /// write it, such as a.bin, ./a.bin and %61.bin.
  /// @param name as in URIs: with slashes and escapes such as %20.
  /// @throws InputError where it lies neither in the same folder nor below it.
  std::filesystem::path place_beside(const std::string& name) const;
  /// All of the file at such a place. @throws InputError where it cannot be read.
  std::string read_beside(const std::filesystem::path& place) const;

  /// @throws InputError "cannot read mesh 'path': what".
  [[noreturn]] void refuse(std::string_view what) const;
  [[noreturn]] void refuse_line(std::size_t line, std::string_view what) const;
  /// Says what the file seems to be, where that can be told, and otherwise `what`.
  [[noreturn]] void refuse_type(std::string_view what) const;
  /// To be called now and then. @throws Interrupted when a stop is requested.
  void poll() const;

 private:
  std::filesystem::path path_;
  std::string extension_;
  std::stop_token stop_;
  std::string bytes_;
};

/// Vertices and faces in the order of the file. Coordinates are those of single precision.
class FaceList {
 public:
  explicit FaceList(const MeshFile& file) : file_(file) {}

  std::vector<Eigen::Vector3d> vertices;
  std::vector<Triangle> triangles;
  /// A face of more than three corners: `count` triangles from `first` on, a fan about its first
  /// corner.
  struct Polygon {
    std::size_t first;
    std::size_t count;
  };
  std::vector<Polygon> polygons;
  /// One for each vertex of a file that has points and no faces; of any length but 0.
  std::vector<Eigen::Vector3d> normals;
  std::vector<float> shares;      ///< one for each vertex, where they are asked for
  std::size_t dropped_faces = 0;  ///< with fewer than three different vertices
  bool is_soup = false;           ///< each triangle has vertices of its own

  void add_vertex(const Eigen::Vector3f& x);
  /// @param corners three or more; vertices need not be there yet.
  void add_face(std::span<const std::uint32_t> corners);
  std::size_t faces() const { return faces_; }

 private:
  const MeshFile& file_;
  std::size_t faces_ = 0;
};

/// Readers of formats: each throws InputError that names the file, where it is wrong and what to
/// do. Nothing much larger than the file is allocated, whatever its header promises.
/// @param share where not null, FaceList::shares are read too: the vertices' property of that name,
///   or where it is empty, the brightness of their colors.
FaceList read_ply(const MeshFile& file, const std::string* share);
/// These formats hold no shares, so that `share` is ignored.
FaceList read_gltf(const MeshFile& file, const std::string* share);
FaceList read_3mf(const MeshFile& file, const std::string* share);

/// Hands out lines without their ends, comments (from `comment` on) and outer blanks. Lines end
/// with LF or CR LF, or with CR where the text has no LF.
class Lines {
 public:
  explicit Lines(std::string_view text, char comment = '#');
  /// The next line that is not empty; none at the end.
  std::optional<std::string_view> next();
  std::size_t number() const { return number_; }   ///< the last line's, from 1
  std::string_view rest() const { return rest_; }  ///< what follows that line

 private:
  std::string_view rest_;
  char comment_;
  char end_;
  std::size_t number_ = 0;
};

/// Cuts the first word, up to blanks, off `text`; empty at the end.
std::string_view take_word(std::string_view& text);

/// Comparison of an ASCII word in any case with a lower-case one.
bool is_word(std::string_view word, std::string_view lower);

/// The whole word as a finite number; what is too small for it is 0.
std::optional<double> to_number(std::string_view word);

/// The whole word as an integer.
std::optional<long long> to_integer(std::string_view word);

/// Three coordinates off the front of `text`; none when one is missing, no number or not finite.
std::optional<Eigen::Vector3f> take_point(std::string_view& text);

}  // namespace qjulia::shape

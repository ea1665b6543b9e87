#pragma once
/// A surface written as it is made.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>

#include "qjulia/surface/surface.hpp"

namespace qjulia {

/// Binary PLY with normals, coordinates in single precision. Vertices and triangles wait in
/// temporary files, not in memory. The file appears under its name in `commit`;
/// without it nothing is left.
class PlyFile : public SurfaceSink {
 public:
  /// @param note a line of text, ASCII, for the header's comments, 200 characters in each.
  /// @param turn a rotation: vertices and normals are turned by it.
  /// @throws OutputError when the folder cannot be written.
  explicit PlyFile(const std::filesystem::path& path, const std::string& note = {},
                   const Eigen::Matrix3d& turn = Eigen::Matrix3d::Identity());
  ~PlyFile() override;
  PlyFile(const PlyFile&) = delete;
  PlyFile& operator=(const PlyFile&) = delete;

  /// @throws OutputError when the disk is full; InputError unless each vertex has a normal.
  void vertices(std::span<const Eigen::Vector3d> positions,
                std::span<const Eigen::Vector3d> normals) override;
  void triangles(std::span<const Triangle> triangles) override;

  /// Joins, checks and renames the file; may be called once. @throws OutputError when anything
  /// could not be written; InputError when a triangle has a vertex that was never given.
  void commit();
  /// Writes only the vertices for whose numbers `keeps` holds, and their triangles. It must hold
  /// for all three of a triangle or for none. Takes 4 bytes of memory a vertex.
  void commit(const std::function<bool(std::uint32_t)>& keeps);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace qjulia

#pragma once
/// Faces of scene files, whose meshes are placed by transformations, often more than once.

#include <Eigen/Geometry>
#include <functional>
#include <span>

#include "mesh_io/mesh_file.hpp"

namespace qjulia::shape {

class SceneFaces {
 public:
  /// @param bytes size of the scene's meshes in their files. A scene may place meshes repeatedly,
  /// but the result may not be much larger than this.
  SceneFaces(const MeshFile& file, std::size_t bytes);
  void set_bytes(std::size_t bytes);

  /// Counts `items` that have to be looked at.
  /// @throws InputError if a small file would take far too much work.
  void spend(std::size_t items);

  /// Adds triangles and those of the vertices that they use. A transformation that mirrors turns
  /// the triangles over, so that the outside stays outside.
  /// @param vertices how many there are. @param vertex the place of one, before it is transformed.
  /// @throws InputError where an index has no vertex or a place is not finite.
  void add(std::span<const Triangle> triangles, std::size_t vertices,
           const std::function<Eigen::Vector3d(std::uint32_t)>& vertex,
           const Eigen::Affine3d& to_scene);

  /// All that was added. @throws InputError where there is nothing.
  FaceList take() &&;

 private:
  [[noreturn]] void refuse_size() const;

  const MeshFile& file_;
  FaceList faces_;
  std::size_t most_items_ = std::size_t{1} << 20;  ///< vertices, or triangles; and at least this
  std::size_t work_ = 0;
};

}  // namespace qjulia::shape

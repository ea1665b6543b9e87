#pragma once
/// Meshes whose bodies move, and their files.

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "qjulia/base/up_axis.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia {

/// Where a body is at a moment.
struct BodyPose {
  Eigen::Vector3d place;  ///< of its centre
  Eigen::Quaterniond turn;
};

struct MovingBody {
  TriangleMesh mesh;            ///< about the body's centre, which is the origin
  std::vector<BodyPose> poses;  ///< one for each moment; a single one stands still
};

struct MovingMesh {
  std::vector<MovingBody> bodies;
  double rate = 24;         ///< moments a second
  std::size_t moments = 1;  ///< 1 or more
  /// @throws InputError naming the body: a mesh that is none, too few or too many poses, numbers
  ///   that are not finite, turns whose length is not 1, normals or colors that other bodies lack
  void validate() const;
};

/// The whole mesh at a moment, 0 … `moments` − 1. @throws InputError
TriangleMesh mesh_at(const MovingMesh& moving, std::size_t moment);

/// The whole mesh so many seconds after its first moment; between two moments bodies move evenly.
/// The last moment is what is shown after it. @throws InputError
TriangleMesh mesh_after(const MovingMesh& moving, double seconds);

/// Where bodies fly.
enum class ScatterField {
  outward,  ///< away from the middle
  wind,     ///< sideways and a little up, with a flutter
  gravity   ///< down, until they lie on the floor
};

struct ScatterOptions {
  ScatterField field = ScatterField::outward;
  double seconds = 5;   ///< 0.1 … 600
  double distance = 1;  ///< how far bodies fly by the end, in longest sides of the mesh, 0 … 100;
                        ///< gravity ends where the floor is
  std::uint64_t seed = 1;  ///< of when bodies set off, how far they fly and how they turn
  void validate() const;   ///< @throws OptionError
};

/// The mesh with its bodies, connected parts together with their cavities, on their ways. The body
/// of the largest volume stands still and comes first; at the first moment all are where they are
/// in the mesh. Outer bodies set off first, with `wind` those on the lee side, and with `gravity`
/// the lowest; all have set off after half of the time.
/// @throws InputError for a mesh that is none, whose coordinates are too large to add, or which has
///   too many bodies for so many seconds
MovingMesh scattered(const TriangleMesh& mesh, const ScatterOptions& options,
                     UpAxis up = kDefaultUp);

/// Writes .glb, with a node and an animation for each body that moves, or .usda with time samples.
/// @throws OutputError when the file cannot be written, InputError for another extension
void write_moving_mesh(const MovingMesh& moving, const std::filesystem::path& path,
                       const MeshFileOptions& options);

}  // namespace qjulia

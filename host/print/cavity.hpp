#pragma once
/// The cavity of a hollow print, and the hole that drains it.

#include <Eigen/Core>
#include <stop_token>

#include "print/slab_distances.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::surface {

/// The largest connected part of a solid that is deeper below the surface than the thickness of the
/// shell, with a round hole from its lowest place straight down to the outside. Lengths are in the
/// mesh's units.
class Cavity {
 public:
  /// @param body closed, standing on its lower end along z.
  /// @param drain the hole's diameter; 0 for none.
  /// @throws OptionError naming "shell" if no part is that deep, or if the grid, whose cells are a
  /// quarter of the shell's thickness, would have too many points; Interrupted.
  Cavity(const TriangleMesh& body, double shell, double drain, const std::stop_token& stop);

  /// Negative in the cavity and in its hole; near their surfaces, the distance from them.
  double at(const Eigen::Vector3d& x) const;
  /// The volume of the cells in the cavity, without the hole.
  double volume() const { return volume_; }

 private:
  /// Puts measured distances from the body's surface where the cavity's surface may be.
  void measure_walls(const TriangleMesh& body, const std::stop_token& stop);
  void keep_largest_part();
  void bore(const SlabField& near, double shell, double diameter);

  Grid grid_;
  SlabField values_;  ///< in steps
  double volume_ = 0;
  /// The hole: its axis, and where it ends.
  Eigen::Vector2d axis_ = Eigen::Vector2d::Zero();
  double radius_ = 0, bottom_ = 0, top_ = 0;
};

}  // namespace qjulia::surface

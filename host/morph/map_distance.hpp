#pragma once
/// The distances that a map holds: of fitted and of exact maps, its potential times the shell.

#include <vector>

#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::morph {

class MapDistance {
 public:
  /// @throws InputError where the map does not say its detail, box and inradius.
  MapDistance(const Device& device, const Map& map);

  /// (F_1 − L) δ of the dynamics alone, map units. @param points with W less the slice.
  std::vector<double> at(std::vector<Quaternion> points) const;
  double shell() const { return shell_; }        ///< δ, map units
  double inradius() const { return inradius_; }  ///< map units
  const Box& box() const { return box_; }        ///< the shape's, map units

 private:
  Field field_;
  double slice_, level_;
  double shell_ = 0, inradius_ = 0;
  Box box_{};
};

}  // namespace qjulia::morph

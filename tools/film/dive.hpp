#pragma once
/// Zooms without an end: the way of a camera into a portal, after which everything looks as before.

#include <cstddef>

#include "qjulia/base/up_axis.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::film {

/// A portal is a similarity P, and its copy of the set is P⁻¹ of the set. Copies on copies shrink
/// to the point x with P(x) = x, and a camera that P⁻¹ moves sees of the copies what it saw before.
/// On its way it is moved by P to the power of −t, from t = 0 to 1: about x it comes nearer by
/// equal ratios, and turns evenly.
class Dive {
 public:
  /// @param portal counted from 1. @param up what stands upright in the pictures.
  /// @throws InputError for a portal that no camera can dive into, with what to change
  Dive(const Map& map, std::size_t portal, UpAxis up);

  /// A loop shows everything so many times as large.
  double scale() const { return scale_; }
  /// Degrees by which the azimuth grows in a loop.
  double turn() const { return turn_; }
  /// Where copies shrink to, shape units.
  const Eigen::Vector3d& point() const { return point_; }

  /// The camera with what it does not say about its place. Then all that is as far away as the
  /// point, in the last picture, lies in the portal's ball; and the point stands above the middle.
  /// @param aspect width of a picture by its height.
  Camera placed(Camera camera, double aspect) const;
  /// The camera on its way. @param first with a point that it looks at and a distance.
  Camera moved(Camera first, double way) const;

 private:
  Eigen::Vector3d point_, up_;
  double scale_ = 1, turn_ = 0;
  double room_ = 0;  ///< from the point to the rim of the portal's ball, shape units
};

}  // namespace qjulia::film

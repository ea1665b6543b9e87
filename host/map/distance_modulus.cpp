#include <cmath>
#include <limits>

#include "map/checks.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

bool DistanceModulus::operator==(const DistanceModulus& other) const {
  const bool same_grid =
      grid == other.grid || (grid && other.grid && grid->data() == other.grid->data());
  return same_grid && origin == other.origin && step == other.step && shell == other.shell &&
         inradius == other.inradius && fourth == other.fourth;
}

void DistanceModulus::validate() const {
  if (!grid) throw InputError("the map's distance has no grid");
  map::check_length("distance.step", step);
  map::check_length("distance.shell", shell);
  map::check_length("distance.inradius", inradius);
  map::check_origin("distance.origin", origin);
}

/// Far out F grows as ‖q‖.
double DistanceModulus::degree(const Dynamics& /*map*/) const {
  return std::numeric_limits<double>::infinity();
}

/// With R the radius of a ball about the origin that holds the inside, d(x) ≥ ‖x‖ − R, because
/// the segment from x away from the origin, or towards it, has a point of the surface no farther
/// off; and so d₄(q) ≥ ‖q‖ − R. The radius where (r − R)/δ + S = ln r is found by bisection. A cell
/// is added for what the spline differs from the distance.
OuterBound DistanceModulus::outer_bound(const Dynamics& map) const {
  validate();
  if (fourth == FourthCoordinate::ignored) return {std::numeric_limits<double>::infinity(), true};
  const Eigen::Vector3d center = -origin / step;
  const double reach = step * (1 + grid->farthest_inside({center.x(), center.y(), center.z()}));
  const auto excess = [&](double r) { return (r - reach) / shell + map.log_scale - std::log(r); };
  // Beyond δ it rises.
  double low = std::max(reach, shell), high = low;
  for (double more = shell; excess(high) <= 0; more *= 2) high += more;
  for (int halving = 0; halving < 50; ++halving) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0 ? high : low) = middle;
  }
  return {high, true};
}

}  // namespace qjulia

#include "qjulia/base/quaternion.hpp"

#include <cmath>
#include <limits>

namespace qjulia {

Quaternion log(const Quaternion& q) {
  const double rho = std::hypot(q.y, q.z, q.w);
  const double length = std::log(norm(q));
  // atan2(|v|, A) is acos(A/|q|) without its loss of digits near 0 and pi.
  const double angle = std::atan2(rho, q.x);
  if (rho == 0) return {length, angle, 0, 0};
  const double s = angle / rho;
  return {length, s * q.y, s * q.z, s * q.w};
}

Quaternion exp(const Quaternion& q) {
  const double angle = std::hypot(q.y, q.z, q.w);
  const double length = std::exp(q.x);
  if (angle == 0) return {length, 0, 0, 0};
  const double s = length * std::sin(angle) / angle;
  return {length * std::cos(angle), s * q.y, s * q.z, s * q.w};
}

Quaternion pow(const Quaternion& q, double a) {
  if (a == 0) return {1, 0, 0, 0};
  if (q == Quaternion{}) return {a > 0 ? 0 : std::numeric_limits<double>::infinity(), 0, 0, 0};
  return exp(a * log(q));
}

}  // namespace qjulia

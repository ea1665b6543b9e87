#pragma once
/// Quaternions X + Y i + Z j + W k in double precision. The first coordinate is the real part.

#include <array>
#include <cmath>

namespace qjulia {

struct Quaternion {
  double x = 0;  ///< real part
  double y = 0;  ///< i
  double z = 0;  ///< j
  double w = 0;  ///< k

  bool operator==(const Quaternion&) const = default;
};

constexpr std::array<double, 4> coordinates(const Quaternion& q) { return {q.x, q.y, q.z, q.w}; }
constexpr Quaternion operator+(const Quaternion& p, const Quaternion& q) {
  return {p.x + q.x, p.y + q.y, p.z + q.z, p.w + q.w};
}
constexpr Quaternion operator-(const Quaternion& p, const Quaternion& q) {
  return {p.x - q.x, p.y - q.y, p.z - q.z, p.w - q.w};
}
constexpr Quaternion operator*(double s, const Quaternion& q) {
  return {s * q.x, s * q.y, s * q.z, s * q.w};
}
/// Hamilton's product.
constexpr Quaternion operator*(const Quaternion& p, const Quaternion& q) {
  return {
      p.x * q.x - p.y * q.y - p.z * q.z - p.w * q.w, p.x * q.y + p.y * q.x + p.z * q.w - p.w * q.z,
      p.x * q.z - p.y * q.w + p.z * q.x + p.w * q.y, p.x * q.w + p.y * q.z - p.z * q.y + p.w * q.x};
}
constexpr double dot(const Quaternion& p, const Quaternion& q) {
  return p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w;
}
inline double norm(const Quaternion& q) { return std::sqrt(dot(q, q)); }

/// log q = (ln |q|, v/|v| acos(A/|q|)) for q = (A, v); the principal branch. Kim 2015, Eq. 5.
/// On the branch cut (v = 0, A < 0) every direction would do: i is taken. The real part of log 0
/// is −infinity.
Quaternion log(const Quaternion& q);
/// e^q = e^A (cos |v|, v/|v| sin |v|).
Quaternion exp(const Quaternion& q);
/// q^a = e^(a log q) for a real exponent. q^0 = 1; 0^a is 0 for a > 0 and infinite for a < 0.
Quaternion pow(const Quaternion& q, double a);

}  // namespace qjulia

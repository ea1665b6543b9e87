#pragma once
/// The mathematics of the reference, over any scalar type: doubles, or those that carry
/// derivatives. It shares no code with kernels.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <unsupported/Eigen/AutoDiff>
#include <vector>

#include "qjulia/map/map.hpp"

namespace qjulia::reference {

/// Unknowns differentiated in one pass.
constexpr Eigen::Index kPass = 8;
using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, kPass, 1>>;

inline double value_of(double x) { return x; }
inline double value_of(const Dual& x) { return x.value(); }

/// A quaternion, a factor, a map and a step over any scalar type.
template <class T>
struct QuaternionOf {
  T x, y, z, w;
};

template <class T>
struct FactorOf {
  QuaternionOf<T> center;
  T exponent;
};

template <class T>
struct MapOf {
  const Map& plain;  ///< holds everything that is not differentiated
  T log_scale;
  std::vector<FactorOf<T>> factors;
};

template <class T>
struct StepOf {
  T log_norm;
  QuaternionOf<T> versor;
};

template <class T>
QuaternionOf<T> convert(const Quaternion& q) {
  return {T(q.x), T(q.y), T(q.z), T(q.w)};
}

template <class T>
MapOf<T> convert(const Map& map) {
  MapOf<T> result{map, T(map.dynamics.log_scale), {}};
  for (const auto& [center, exponent] : map.dynamics.factors) {
    result.factors.push_back({convert<T>(center), T(exponent)});
  }
  return result;
}

template <class T>
QuaternionOf<T> product(const QuaternionOf<T>& p, const QuaternionOf<T>& q) {
  return {
      p.x * q.x - p.y * q.y - p.z * q.z - p.w * q.w, p.x * q.y + p.y * q.x + p.z * q.w - p.w * q.z,
      p.x * q.z - p.y * q.w + p.z * q.x + p.w * q.y, p.x * q.w + p.y * q.z - p.z * q.y + p.w * q.x};
}

/// d^a = e^(a log d): a ln |d| and the unit quaternion (cos a t, v/|v| sin a t), t the angle of d.
template <class T>
StepOf<T> power(const QuaternionOf<T>& d, const T& a) {
  using std::atan2, std::cos, std::log, std::sin, std::sqrt;
  const T rho2 = d.y * d.y + d.z * d.z + d.w * d.w;
  const T norm2 = d.x * d.x + rho2;
  const T log_norm = a * log(norm2) * 0.5;
  if (value_of(norm2) == 0) return {log_norm, {T(1), T(0), T(0), T(0)}};
  if (value_of(rho2) == 0) {
    if (value_of(d.x) > 0) {
      // sin(a t)/|v| tends to a/A, which the derivative by v needs.
      const T s = a / d.x;
      return {log_norm, {T(1), s * d.y, s * d.z, s * d.w}};
    }
    // On the branch cut the direction is i, as in log().
    const T angle = a * std::numbers::pi;
    return {log_norm, {cos(angle), sin(angle), T(0), T(0)}};
  }
  const T rho = sqrt(rho2);
  const T angle = a * T(atan2(rho, d.x));
  const T s = sin(angle) / rho;
  return {log_norm, {cos(angle), s * d.y, s * d.z, s * d.w}};
}

/// The quadratic B-spline about 0.
template <class T>
T spline(const T& x) {
  const T a = value_of(x) < 0 ? T(-x) : x;
  if (value_of(a) >= 1.5) return T(0);
  return value_of(a) >= 0.5 ? T(0.5 * (1.5 - a) * (1.5 - a)) : T(0.75 - a * a);
}

/// Σ c B(u − i − ½) B(v − j − ½) B(w − k − ½) over the coefficients c of cells (i, j, k).
template <class T, class Coefficient>
T spline_sum(const std::array<T, 3>& at, const Coefficient& coefficient) {
  std::array<int, 3> first{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    first[axis] = static_cast<int>(std::floor(value_of(at[axis]))) - 1;
  }
  T sum(0);
  for (int k = first[2]; k < first[2] + 3; ++k) {
    for (int j = first[1]; j < first[1] + 3; ++j) {
      for (int i = first[0]; i < first[0] + 3; ++i) {
        sum += coefficient(i, j, k) * spline(T(at[0] - (i + 0.5))) * spline(T(at[1] - (j + 0.5))) *
               spline(T(at[2] - (k + 0.5)));
      }
    }
  }
  return sum;
}

/// A place in a grid, in cells, and its squared distance from the place that was asked for.
template <class T>
struct GridPlace {
  std::array<T, 3> at;
  T beyond2;
};

/// The place nearest to q that is `margin` cells away from the faces.
template <class T>
GridPlace<T> place_in(const std::array<int, 3>& cells, const Eigen::Vector3d& origin, double step,
                      double margin, const QuaternionOf<T>& q) {
  GridPlace<T> place{{q.x, q.y, q.z}, T(0)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    T& at = place.at[axis];
    at = T((at - origin[static_cast<Eigen::Index>(axis)]) / step);
    const double nearest = std::clamp(value_of(at), margin, cells[axis] - margin);
    if (nearest == value_of(at)) continue;
    place.beyond2 += (at - nearest) * (at - nearest);
    at = T(nearest);
  }
  return place;
}

/// q² + c.
template <class T>
QuaternionOf<T> quadratic(const QuaternionOf<T>& q, const QuaternionOf<T>& c) {
  const QuaternionOf<T> square = product(q, q);
  return {square.x + c.x, square.y + c.y, square.z + c.z, square.w + c.w};
}

}  // namespace qjulia::reference

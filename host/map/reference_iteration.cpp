#include "map/reference_iteration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/AutoDiff>

#include "map/kinds.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::reference {
namespace {

/// Unknowns differentiated in one pass.
constexpr Eigen::Index kPass = 8;
using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, kPass, 1>>;

double value_of(double x) { return x; }
double value_of(const Dual& x) { return x.value(); }

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

/// ln |q² + c|, and q² + c over its norm.
template <class T>
StepOf<T> quadratic(const QuaternionOf<T>& q, const QuaternionOf<T>& c) {
  const QuaternionOf<T> square = product(q, q);
  return power<T>({square.x + c.x, square.y + c.y, square.z + c.z, square.w + c.w}, T(1));
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

/// Both splines of a grid, each by itself; cells.
template <class T>
T grid_distance(const DistanceGridData& data, const std::array<T, 3>& at) {
  const std::array<int, 3> coarse = data.coarse_cells();
  const auto wide = [](int n) { return static_cast<std::size_t>(n); };
  const auto number = [nx = wide(coarse[0]), ny = wide(coarse[1]), wide](int i, int j, int k) {
    return (wide(k) * ny + wide(j)) * nx + wide(i);
  };
  const auto correction = [&](int i, int j, int k) {
    const auto block = static_cast<std::uint32_t>(number(i / 4, j / 4, k / 4));
    const auto found = std::ranges::lower_bound(data.blocks, block);
    if (found == data.blocks.end() || *found != block) return 0.0;
    const auto cell = static_cast<std::size_t>((k % 4 * 4 + j % 4) * 4 + i % 4);
    return data.corrections[64 * static_cast<std::size_t>(found - data.blocks.begin()) + cell] /
           256.0;
  };
  return spline_sum<T>({T(at[0] / 4), T(at[1] / 4), T(at[2] / 4)},
                       [&](int i, int j, int k) { return data.coarse[number(i, j, k)] / 64.0; }) +
         spline_sum<T>(at, correction);
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

/// d₄ / δ.
template <class T>
T distance_field(const DistanceModulus& modulus, const QuaternionOf<T>& q) {
  using std::sqrt;
  const DistanceGridData& data = modulus.grid->data();
  const auto [at, beyond2] = place_in(data.cells, modulus.origin, modulus.step, 4, q);
  T d = grid_distance(data, at);
  if (value_of(beyond2) > 0) d += sqrt(beyond2);
  const T depth = d * modulus.step + modulus.inradius;
  const bool is_round = modulus.fourth == FourthCoordinate::round;
  const T radius = is_round ? T(sqrt(depth * depth + q.w * q.w)) : depth;
  return (radius - modulus.inradius) / modulus.shell;
}

/// Bits of a lattice point, each the result of all bits of its numbers.
std::uint32_t lattice_bits(const std::array<std::int64_t, 3>& point, std::uint32_t salt) {
  constexpr std::array<std::uint32_t, 3> kPrimes{2376512323, 3625334849, 3407524639};
  std::uint32_t bits = salt;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bits ^= static_cast<std::uint32_t>(point[axis]) * kPrimes[axis];
  }
  bits = (bits ^ bits / 65536) * 2246822507;
  bits = (bits ^ bits / 8192) * 3266489909;
  return bits ^ bits / 65536;
}

/// The sum over the corners of a cell of (gradient · way from the corner), weighted by the fades of
/// the way to the other side.
double noise_value(const std::array<double, 3>& at, std::uint32_t salt) {
  double sum = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    std::array<std::int64_t, 3> point{};
    std::array<double, 3> way{};
    double weight = 1;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double x = std::clamp(at[axis], -1e6, 1e6);
      point[axis] = static_cast<std::int64_t>(std::floor(x)) + (corner >> axis & 1U);
      way[axis] = x - static_cast<double>(point[axis]);
      const double far = 1 - std::abs(way[axis]);
      weight *= far * far * far * (10 + far * (6 * far - 15));
    }
    const std::uint32_t bits = lattice_bits(point, salt);
    double slope = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t part = bits >> 10 * axis & 1023U;
      slope += (static_cast<double>(part) - 511.5) / 512 * way[axis];
    }
    sum += weight * slope;
  }
  return sum;
}

/// n of a noise, not of length 1. It has no derivatives.
template <class T>
QuaternionOf<T> noise_vector(const NoiseVersor& noise, const QuaternionOf<T>& q) {
  const std::array<double, 3> x{value_of(q.x) - noise.origin.x(), value_of(q.y) - noise.origin.y(),
                                value_of(q.z) - noise.origin.z()};
  std::array<double, 4> n{};
  const std::uint32_t components = noise.values == NoiseValues::vectors ? 3 : 4;
  for (std::uint32_t c = 0; c < components; ++c) {
    for (std::uint32_t octave = 0; octave < static_cast<std::uint32_t>(noise.octaves); ++octave) {
      std::array<double, 3> at{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        at[axis] = x[axis] * noise.scale * std::pow(2, octave) + double{0.37F} * c;
      }
      const std::uint32_t salt = (32 * noise.seed + 4 * octave + c) * 2654435769;
      n[c] += noise_value(at, salt) / std::pow(2, octave);
    }
  }
  return {T(n[0]), T(n[1]), T(n[2]), T(n[3])};
}

/// The share of the detail that a place has.
template <class T>
T share_at(const Paint& paint, const QuaternionOf<T>& q) {
  const GridPlace<T> place = place_in(paint.cells, paint.origin, paint.step, 1.5, q);
  return spline_sum<T>(place.at, [&](int i, int j, int k) {
    const int number = (k * paint.cells[1] + j) * paint.cells[0] + i;
    return (1.0 + paint.shares[static_cast<std::size_t>(number)]) / 256;
  });
}

/// Without portals.
template <class T>
StepOf<T> plain_step_of(const MapOf<T>& map, const QuaternionOf<T>& q) {
  const Map& plain = map.plain;
  T f = map.log_scale;
  QuaternionOf<T> u = convert<T>(plain.dynamics.phase);
  const bool adds_factors = std::holds_alternative<FactorsModulus>(plain.dynamics.modulus);
  const bool turns_by_factors = std::holds_alternative<FactorsVersor>(plain.dynamics.versor);
  for (const auto& [c, a] : map.factors) {
    const StepOf<T> one = power<T>({q.x - c.x, q.y - c.y, q.z - c.z, q.w - c.w}, a);
    if (adds_factors) f += one.log_norm;
    if (turns_by_factors) u = product(u, one.versor);
  }
  std::visit(map::Overloaded{[](const FactorsModulus&) {},
                             [&](const QuadraticModulus& kind) {
                               f += quadratic(q, convert<T>(kind.c)).log_norm;
                             },
                             [&](const DistanceModulus& kind) { f += distance_field(kind, q); }},
             plain.dynamics.modulus);
  std::visit(map::Overloaded{[](const FactorsVersor&) {},
                             [&](const QuadraticVersor& kind) {
                               u = product(u, quadratic(q, convert<T>(kind.c)).versor);
                             },
                             [&](const NoiseVersor& kind) {
                               u = product(u, power<T>(noise_vector<T>(kind, q), T(1)).versor);
                             }},
             plain.dynamics.versor);
  const double level = plain.dynamics.surface_level;
  if (value_of(f) > level) f = level + plain.layers.steepness * (f - level);
  if (plain.layers.paint) f = level + (f - level) / share_at(*plain.layers.paint, q);
  return {f, u};
}

/// F of the last of these iterates, `step` being one.
template <class T, class Step>
T last_field(QuaternionOf<T> q, int iterations, double escape, const Step& step) {
  using std::exp, std::log;
  T log_norm = log(T(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w)) * 0.5;
  for (int i = 0; i < iterations && value_of(log_norm) < std::log(escape); ++i) {
    const StepOf<T> next = step(q);
    log_norm = next.log_norm;
    const T radius = exp(log_norm);
    const QuaternionOf<T>& u = next.versor;
    q = {radius * u.x, radius * u.y, radius * u.z, radius * u.w};
  }
  return log_norm;
}

/// Rodrigues' formula: v turned about the axis.
template <class T>
std::array<T, 3> turned(const Rotation& rotation, const std::array<T, 3>& v) {
  const double angle = rotation.degrees * std::numbers::pi / 180;
  const double c = std::cos(angle), s = std::sin(angle);
  const auto& a = rotation.axis;
  const double length = std::sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
  const std::array<double, 3> k{a[0] / length, a[1] / length, a[2] / length};
  const T along = k[0] * v[0] + k[1] * v[1] + k[2] * v[2];
  std::array<T, 3> result;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, l = (i + 2) % 3;
    result[i] = v[i] * c + (k[j] * v[l] - k[l] * v[j]) * s + k[i] * along * (1 - c);
  }
  return result;
}

/// Whether the portal takes q: within its ball, and on the side that its mask asks for.
template <class T>
bool takes(const Portal& portal, const MapOf<T>& map, const QuaternionOf<T>& q) {
  const double x = value_of(q.x) - portal.center.x(), y = value_of(q.y) - portal.center.y(),
               z = value_of(q.z) - portal.center.z(), w = value_of(q.w);
  if (x * x + y * y + z * z + w * w >= portal.radius * portal.radius) return false;
  if (portal.mask == PortalMask::none) return true;
  const double f = value_of(last_field(
      q, 4, kLargestEscape, [&](const QuaternionOf<T>& at) { return plain_step_of(map, at); }));
  return (f < map.plain.dynamics.surface_level) == (portal.mask == PortalMask::inside);
}

template <class T>
StepOf<T> step_of(const MapOf<T>& map, const QuaternionOf<T>& q) {
  using std::log, std::sqrt;
  for (const Portal& portal : map.plain.layers.portals) {
    if (!takes(portal, map, q)) continue;
    const auto x = turned<T>(
        portal.rotation,
        {T(q.x - portal.center.x()), T(q.y - portal.center.y()), T(q.z - portal.center.z())});
    const QuaternionOf<T> p{T(portal.destination.x() + portal.scale * x[0]),
                            T(portal.destination.y() + portal.scale * x[1]),
                            T(portal.destination.z() + portal.scale * x[2]), T(portal.scale * q.w)};
    const T length = sqrt(p.x * p.x + p.y * p.y + p.z * p.z + p.w * p.w);
    return {log(length), {p.x / length, p.y / length, p.z / length, p.w / length}};
  }
  return plain_step_of(map, q);
}

template <class T>
T field_at(const MapOf<T>& map, const QuaternionOf<T>& start, int iterations, double escape) {
  return last_field(start, iterations, escape,
                    [&](const QuaternionOf<T>& q) { return step_of(map, q); });
}

/// The scalars of a map in the order of the unknowns.
std::vector<Dual*> unknowns_of(MapOf<Dual>& map) {
  std::vector<Dual*> all{&map.log_scale};
  for (auto& f : map.factors) all.push_back(&f.exponent);
  using Center = QuaternionOf<Dual>;
  for (const auto coordinate : {&Center::x, &Center::y, &Center::z, &Center::w}) {
    for (auto& f : map.factors) all.push_back(&(f.center.*coordinate));
  }
  return all;
}

}  // namespace

Step step(const Map& map, const Quaternion& q) {
  const auto [log_norm, u] = step_of(convert<double>(map), convert<double>(q));
  return {log_norm, {u.x, u.y, u.z, u.w}};
}

std::vector<double> field(const Map& map, std::span<const Quaternion> starts, int iterations,
                          double escape) {
  const auto plain = convert<double>(map);
  std::vector<double> values;
  values.reserve(starts.size());
  for (const Quaternion& start : starts) {
    values.push_back(field_at(plain, convert<double>(start), iterations, escape));
  }
  return values;
}

Eigen::MatrixXd field_gradients(const Map& map, std::span<const Quaternion> starts, int iterations,
                                double escape) {
  const auto unknowns = static_cast<Eigen::Index>(1 + 5 * map.dynamics.factors.size());
  Eigen::MatrixXd gradients(static_cast<Eigen::Index>(starts.size()), unknowns);
  for (Eigen::Index first = 0; first < unknowns; first += kPass) {
    auto dual = convert<Dual>(map);
    const auto all = unknowns_of(dual);
    const Eigen::Index count = std::min(kPass, unknowns - first);
    for (Eigen::Index i = 0; i < count; ++i) {
      all[static_cast<std::size_t>(first + i)]->derivatives()[i] = 1;
    }
    for (Eigen::Index row = 0; row < gradients.rows(); ++row) {
      const Dual f =
          field_at(dual, convert<Dual>(starts[static_cast<std::size_t>(row)]), iterations, escape);
      gradients.block(row, first, 1, count) = f.derivatives().head(count).transpose();
    }
  }
  return gradients;
}

std::vector<Quaternion> point_gradients(const Map& map, std::span<const Quaternion> starts,
                                        int iterations, double escape) {
  const auto dual = convert<Dual>(map);
  std::vector<Quaternion> gradients;
  for (const Quaternion& start : starts) {
    auto q = convert<Dual>(start);
    q.x.derivatives()[0] = q.y.derivatives()[1] = q.z.derivatives()[2] = q.w.derivatives()[3] = 1;
    const auto g = field_at(dual, q, iterations, escape).derivatives();
    gradients.push_back({g[0], g[1], g[2], g[3]});
  }
  return gradients;
}

}  // namespace qjulia::reference

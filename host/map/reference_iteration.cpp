#include "map/reference_iteration.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "kind_reference.hpp"
#include "map/reference_math.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::reference {
namespace {

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
  T f = map.log_scale + std::visit([&](const auto& kind) { return modulus_of(kind, map, q); },
                                   plain.dynamics.modulus);
  const QuaternionOf<T> u = product(
      convert<T>(plain.dynamics.phase),
      std::visit([&](const auto& kind) { return versor_of(kind, map, q); }, plain.dynamics.versor));
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

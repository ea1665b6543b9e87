#include "qjulia/morph/morph.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/random.hpp"
#include "base/range_check.hpp"
#include "exact/distance_grid.hpp"
#include "morph/map_distance.hpp"
#include "morph/matching.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {
namespace {

constexpr double kBand = 0.05 * kMapSide;  ///< points count about so far from the surface
constexpr double kFarWeight = 1e-3;        ///< of points far from it
constexpr std::size_t kTriedPoints = 400'000;
constexpr std::size_t kMostMorphPoints = 24'000;
constexpr double kOffSliceShare = 0.3;  ///< of the points, with W about as large as the band
/// Holds exponents to where they come straight: their spread over that of the potential.
constexpr double kRidge = 1e-4;
constexpr double kLeastDistance = 1e-6;  ///< map units: a factor's centre is no point
constexpr std::uint64_t kMorphSeed = 1;

double between(double a, double b, double t) { return (1 - t) * a + t * b; }
double ratio_between(double a, double b, double t) { return a * std::pow(b / a, t); }
Eigen::Vector3d between(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double t) {
  return (1 - t) * a + t * b;
}
Quaternion between(const Quaternion& a, const Quaternion& b, double t) {
  return (1 - t) * a + t * b;
}

/// Along the shortest arc of the unit sphere.
Quaternion arc_between(const Quaternion& a, const Quaternion& b, double t) {
  const double angle = std::acos(std::clamp(dot(a, b), -1.0, 1.0));
  if (std::sin(angle) < 1e-9) return t < 0.5 ? a : b;
  return (1 / std::sin(angle)) * (std::sin((1 - t) * angle) * a + std::sin(t * angle) * b);
}

/// A map as one end of the way.
struct MorphEnd {
  Map map;
  morph::MapDistance distance;

  MorphEnd(const Device& device, const Map& given) : map(given), distance(device, given) {
    if (map.layers.paint || !map.layers.portals.empty()) {
      throw InputError(
          "a map of the morph has paint or portals, which do not go from shape to shape; take them "
          "off");
    }
  }
};

/// A point where potentials are fitted, its W less the slice.
struct MorphPoint {
  Quaternion at;
  double first = 0, second = 0;  ///< distances that the two maps hold
};

bool is_near_sometimes(const MorphPoint& p) {
  return p.first * p.second <= 0 || std::min(std::abs(p.first), std::abs(p.second)) < 3 * kBand;
}

Box box_of_both(const Box& a, const Box& b) {
  return {a.low.cwiseMin(b.low), a.high.cwiseMax(b.high)};
}

}  // namespace

struct Morph::Impl {
  Device device;
  MorphEnd from, to;
  ProgressMonitor monitor;
  morph::Matching matching;
  std::vector<MorphPoint> points{};  ///< none of exact maps

  Impl(const Device& on, const Map& first, const Map& second, ProgressMonitor watched)
      : device(on), from(on, first), to(on, second), monitor(std::move(watched)) {
    expect_way();
    matching = morph::matched(from.map.dynamics, to.map.dynamics, monitor.stop);
    if (from.map.dynamics.is_rational()) draw_points();
  }

  Box box() const { return box_of_both(from.distance.box(), to.distance.box()); }

  void expect_way() const {
    const std::string a = from.map.dynamics.kind(), b = to.map.dynamics.kind();
    const bool is_exact = std::holds_alternative<DistanceModulus>(from.map.dynamics.modulus) &&
                          !std::holds_alternative<QuadraticVersor>(from.map.dynamics.versor);
    if (a != b || !(from.map.dynamics.is_rational() || is_exact)) {
      throw InputError(fmt::format(
          "a {} map has no way to a {} map; give two that 'fit' made, or two that 'shape' made "
          "with versors of one kind",
          a, b));
    }
    const auto* first = std::get_if<NoiseVersor>(&from.map.dynamics.versor);
    const auto* second = std::get_if<NoiseVersor>(&to.map.dynamics.versor);
    if (first != nullptr && (first->octaves != second->octaves || first->seed != second->seed ||
                             first->values != second->values)) {
      throw InputError(
          "the noises of the two maps differ in octaves, seed or values; make both with the same "
          "noise");
    }
  }

  /// The same points for all t: those that are near the surface at some t, in the box and a band
  /// about it.
  void draw_points() {
    base::Random random(kMorphSeed);
    const Box about = box();
    std::vector<Quaternion> tried(kTriedPoints);
    for (Quaternion& q : tried) {
      Eigen::Vector3d x;
      for (int axis = 0; axis < 3; ++axis) {
        x[axis] = random.uniform(about.low[axis] - kBand, about.high[axis] + kBand);
      }
      const bool is_off = random.uniform(0, 1) < kOffSliceShare;
      q = {x.x(), x.y(), x.z(), is_off ? random.uniform(-2 * kBand, 2 * kBand) : 0};
    }
    const std::vector<double> first = from.distance.at(tried), second = to.distance.at(tried);
    for (std::size_t i = 0; i < tried.size() && points.size() < kMostMorphPoints; ++i) {
      const MorphPoint point{tried[i], first[i], second[i]};
      if (is_near_sometimes(point)) points.push_back(point);
    }
  }

  double shell_at(double t) const {
    return ratio_between(from.distance.shell(), to.distance.shell(), t);
  }

  void set_frame(Map& map, double t) const {
    const Frame &a = from.map.frame, &b = to.map.frame;
    Frame& frame = map.frame;
    const double scale = ratio_between(a.shape_to_map.scale, b.shape_to_map.scale, t);
    const Eigen::Vector3d origin = between(a.shape_to_map.to_shape(Eigen::Vector3d::Zero()),
                                           b.shape_to_map.to_shape(Eigen::Vector3d::Zero()), t);
    frame.shape_to_map = {scale, -scale * origin};
    const Box part_a = from.distance.box(), part_b = to.distance.box();
    frame.box = Box{frame.shape_to_map.to_shape(between(part_a.low, part_b.low, t)),
                    frame.shape_to_map.to_shape(between(part_a.high, part_b.high, t))};
    frame.diagonal.reset();
    frame.inradius = between(from.distance.inradius(), to.distance.inradius(), t) / scale;
    frame.up = t < 0.5 ? a.up : b.up;
    frame.detail = shell_at(t) / (scale * frame.box->diagonal());
  }

  /// Centres and exponents on straight ways. @param weight of exponents of either end.
  std::vector<Factor> straight(double t, double weight_from, double weight_to) const {
    std::vector<Factor> factors;
    for (const auto& [a, b] : matching.factors) {
      factors.push_back({between(a.center, b.center, t),
                         (1 - t) * weight_from * a.exponent + t * weight_to * b.exponent});
    }
    return factors;
  }

  /// Fits S and exponents to the distances at t by weighted least squares.
  /// @param dynamics with centres less the slice, and L = 0.
  void refit(Dynamics& dynamics, double t) const {
    const auto unknowns = static_cast<Eigen::Index>(dynamics.factors.size()) + 1;
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    Eigen::VectorXd straight_way(unknowns);
    straight_way[0] = dynamics.log_scale;
    for (Eigen::Index k = 1; k < unknowns; ++k) {
      straight_way[k] = dynamics.factors[static_cast<std::size_t>(k - 1)].exponent;
    }
    constexpr std::size_t kRowsAtOnce = 512;
    double weights = 0;
    for (std::size_t first = 0; first < points.size(); first += kRowsAtOnce) {
      throw_if_stopped(monitor.stop);
      const auto rows = static_cast<Eigen::Index>(std::min(kRowsAtOnce, points.size() - first));
      Eigen::MatrixXd part(rows, unknowns);
      Eigen::VectorXd missing(rows);
      for (Eigen::Index i = 0; i < rows; ++i) {
        const MorphPoint& point = points[first + static_cast<std::size_t>(i)];
        const double distance = between(point.first, point.second, t);
        const double near = 1 / (1 + distance * distance / (kBand * kBand));
        const double weight = near * near + kFarWeight;
        part(i, 0) = 1;
        for (Eigen::Index k = 1; k < unknowns; ++k) {
          const Quaternion& c = dynamics.factors[static_cast<std::size_t>(k - 1)].center;
          part(i, k) = std::log(std::max(norm(point.at - c), kLeastDistance));
        }
        missing[i] = distance / shell_at(t) - part.row(i).dot(straight_way);
        part.row(i) *= std::sqrt(weight);
        missing[i] *= std::sqrt(weight);
        weights += weight;
      }
      normal.selfadjointView<Eigen::Lower>().rankUpdate(part.transpose());
      right += part.transpose() * missing;
    }
    normal.diagonal().array() += kRidge * weights;
    const Eigen::VectorXd change = normal.selfadjointView<Eigen::Lower>().llt().solve(right);
    if (!change.allFinite()) throw Error("the potential between the two maps cannot be fitted");
    dynamics.log_scale += change[0];
    for (Eigen::Index k = 1; k < unknowns; ++k) {
      dynamics.factors[static_cast<std::size_t>(k - 1)].exponent += change[k];
    }
  }

  /// Of fitted maps: the blend of potentials, as far as the factors on their way can have it.
  void blend_factors(Map& map, double t) const {
    const double shell = shell_at(t);
    const Dynamics &a = from.map.dynamics, &b = to.map.dynamics;
    map.dynamics.factors = straight(t, from.distance.shell() / shell, to.distance.shell() / shell);
    map.dynamics.log_scale =
        between(from.distance.shell() / shell * (a.log_scale - a.surface_level),
                to.distance.shell() / shell * (b.log_scale - b.surface_level), t);
    if (t > 0 && t < 1) refit(map.dynamics, t);
    for (Factor& factor : map.dynamics.factors) factor.center.w += map.dynamics.slice;
    map.dynamics.log_scale += map.dynamics.surface_level;
  }

  /// Of exact maps: a grid of the blended distances, and the versor between.
  void blend_distances(Map& map, double t) const {
    const auto& a = std::get<DistanceModulus>(from.map.dynamics.modulus);
    const auto& b = std::get<DistanceModulus>(to.map.dynamics.modulus);
    const auto distances = [&](std::span<const Eigen::Vector3d> places) {
      // Grids hold distances at W = 0; the slice is applied to the result.
      std::vector<double> blended = from.distance.at(on_slice(places, -from.map.dynamics.slice));
      const std::vector<double> second = to.distance.at(on_slice(places, -to.map.dynamics.slice));
      for (std::size_t i = 0; i < blended.size(); ++i) {
        blended[i] = between(blended[i], second[i], t);
      }
      return blended;
    };
    const auto cells_of = [](const DistanceModulus& modulus) {
      return std::ranges::max(modulus.grid->data().cells);
    };
    DistanceModulus modulus =
        exact::sampled_distance(distances, map.frame.shape_to_map.to_map(*map.frame.box),
                                std::max(cells_of(a), cells_of(b)), monitor.stop);
    modulus.shell = shell_at(t);
    modulus.inradius = between(a.inradius, b.inradius, t);
    modulus.fourth = a.fourth;
    map.dynamics.modulus = modulus;
    map.dynamics.log_scale = map.dynamics.surface_level;
    if (auto* noise = std::get_if<NoiseVersor>(&map.dynamics.versor)) {
      const auto& other = std::get<NoiseVersor>(to.map.dynamics.versor);
      noise->scale = ratio_between(noise->scale, other.scale, t);
      noise->origin = between(noise->origin, other.origin, t);
    } else {
      map.dynamics.factors = straight(t, 1, 1);
      for (Factor& factor : map.dynamics.factors) factor.center.w += map.dynamics.slice;
    }
  }

  Map at(double t) const {
    Map map = from.map;
    const Dynamics &a = from.map.dynamics, &b = to.map.dynamics;
    map.dynamics.slice = between(a.slice, b.slice, t);
    map.dynamics.surface_level = between(a.surface_level, b.surface_level, t);
    map.dynamics.phase = arc_between(a.phase, b.phase, t);
    map.layers.steepness = ratio_between(from.map.layers.steepness, to.map.layers.steepness, t);
    set_frame(map, t);
    if (a.is_rational()) {
      blend_factors(map, t);
    } else {
      blend_distances(map, t);
    }
    map.validate();
    return calibrated(device, map);
  }
};

Morph::Morph(const Device& device, const Map& from, const Map& to, const ProgressMonitor& monitor) {
  from.validate();
  to.validate();
  impl_ = std::make_unique<Impl>(device, from, to, monitor);
}

Morph::~Morph() = default;
Morph::Morph(Morph&&) noexcept = default;
Morph& Morph::operator=(Morph&&) noexcept = default;

const MorphPairs& Morph::pairs() const { return impl_->matching.pairs; }

Box Morph::box() const { return impl_->box(); }

Map Morph::at(double t) const {
  base::expect_between("t", t, 0.0, 1.0);
  return impl_->at(t);
}

}  // namespace qjulia

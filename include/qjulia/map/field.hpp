#pragma once
/// The field F_n of a map on a device: the log norm of the last executed iterate.

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

/// The most an escape radius may be, map units: fourth powers of distances up to twice this are
/// finite in single precision, as versors need.
constexpr double kLargestEscape = 1e9;

/// The escape radius, map units, where nothing asks for another.
constexpr double kUsualEscape = 20;

/// The largest n.
constexpr int kMostIterations = 16;

/// Radii about the origin that settle an orbit, map units.
struct StopRadii {
  double inner = 0;              ///< below it an iterate never leaves; 0 when there is none
  double outer = 0;              ///< above it an iterate never returns; infinity when there is none
  double escape = kUsualEscape;  ///< iteration goes on below it
};

/// Evaluates one map of any kind at many points. Points are 4-D, in map coordinates.
///
/// The orbit of a point q_0 = q is q_j = R(q_{j-1}). It ends with the first q_j whose norm is not
/// below the escape radius, which may be q itself, and with q_n at the latest. F_n is ln |q_j| of
/// its last point.
///
/// Every function below takes time in proportion to points × iterates × factors, and returns
/// nothing for no points. All throw OptionError naming `iterations` unless n is
/// 1 … kMostIterations; InputError naming the first point, counted from 0, with a coordinate that
/// is not finite or beyond ±1e15; Interrupted after a stop request; and DeviceError where the
/// device refuses.
class Field {
 public:
  /// @param stop makes the functions below throw `Interrupted` soon.
  /// @throws InputError naming what is wrong with the map.
  Field(const Device& device, const Map& map, Precision precision = Precision::single,
        const StopRadii& stops = {}, std::stop_token stop = {});

  /// F_n with the escape radius alone. @param iterations n
  std::vector<double> at(std::span<const Quaternion> points, int iterations = 1) const;

  /// F_n where orbits also end at r_in and r_out. It is on the same side as `at` of every level
  /// between ln r_in and ln r_out.
  std::vector<double> decided_at(std::span<const Quaternion> points, int iterations) const;

  /// U of the map, a unit quaternion: R(q) = e^F(q) U(q). In a portal, that of where it leads.
  std::vector<Quaternion> versors_at(std::span<const Quaternion> points) const;

  /// The last point of each orbit, whose norm is e^F_n. An orbit that has not escaped after n
  /// iterates ends at q_n. A norm above e^700 is given as e^700.
  std::vector<Quaternion> images_at(std::span<const Quaternion> points, int iterations = 1) const;

  /// All points of the orbits: point i has n + 1 of them, from number i (n + 1) on, beginning with
  /// itself. After its end an orbit repeats its last point. Takes 32 bytes for each.
  std::vector<Quaternion> orbits_at(std::span<const Quaternion> points, int iterations) const;

  /// How many iterates each orbit has: how many of q_0 … q_{n-1} come before the first that is not
  /// below the escape radius. 0 where the point itself is not; n where all of them are, whether q_n
  /// is or not.
  std::vector<int> escape_counts_at(std::span<const Quaternion> points, int iterations) const;

  /// ∂F_n/∂q, analytic for every kind of map. F_n jumps at branch cuts of the versor (q − c_k on
  /// the negative real axis, unless a_k is whole), at rims of portals and where orbits begin to
  /// escape earlier: there the gradient is that of one side. Where an orbit has no iterate, F_n is
  /// ln |q|. Takes up to three times as long as `at`. An iterate may stretch rounding as it
  /// stretches distances, so that in single precision gradients of large n are rough where orbits
  /// are unsteady: use double there.
  std::vector<Quaternion> gradient_at(std::span<const Quaternion> points, int iterations = 1) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// 3-D points, in map coordinates, as quaternions on the map's slice.
std::vector<Quaternion> on_slice(std::span<const Eigen::Vector3d> points, double slice);

/// r_eff: the median over 4,096 fixed directions of the 4-D unit sphere of the first radius at
/// which F_1 crosses `level`; a direction without a crossing counts as the search limit.
/// `limit` in map units.
double effective_radius(const Field& field, double level, double limit);

/// Shifts S and the surface level L alike, so that L = ln r_eff: the iterated set's boundary, not
/// only the potential's, then lies on the shape. To be done after a fit (where L ≈ 0) and again
/// whenever the origin has moved; a calibrated map stays as it is.
/// @throws InputError when the origin is not inside the surface F_1 = L.
Map calibrated(const Device& device, const Map& map);

/// r_in: the largest r < e^L whose 4-D ball the map takes into itself. r_out: the smallest r > e^L
/// beyond which F_1 > ln |q|; infinity unless Σ a_k > 1. So an orbit that is stopped at either is
/// on the side of L on which it would have ended. Both are sampled, with a margin of 2 %, but r_out
/// is never beyond the larger of e^L and the bound that holds for every direction. The escape
/// radius is `escape` if given, else 1.25 r_out or, without r_out, the larger of 20 and 1.25 e^L.
/// @throws InputError when `escape` is not above e^L, so that orbits of inside points would escape,
///   or when `escape` or e^L is above kLargestEscape; Interrupted
StopRadii find_stop_radii(const Device& device, const Map& map, std::optional<double> escape = {},
                          const std::stop_token& stop = {});

}  // namespace qjulia

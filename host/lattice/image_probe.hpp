#pragma once
/// A map's F and U at points of all four dimensions, computed on the device, and how far an iterate
/// moves points apart.

#include <Eigen/Core>
#include <array>
#include <functional>
#include <stop_token>
#include <vector>

#include "base/random.hpp"
#include "device/point_batch.hpp"
#include "map/device_map.hpp"

namespace qjulia::surface {

using Point4 = std::array<double, 4>;  ///< X, Y, Z, W, map units

double length(const Point4& p);
double distance(const Point4& a, const Point4& b);

/// The point e^f u.
Point4 image_of(double f, const std::array<float, 4>& u);

class ImageProbe {
 public:
  ImageProbe(const map::DeviceMap& map, const std::stop_token& stop) : map_(map), stop_(stop) {}

  /// Point i of a number of points.
  using PointOf = std::function<Point4(std::size_t)>;

  std::vector<float> fields(std::size_t points, const PointOf& point_of) const;
  std::vector<std::array<float, 4>> versors(std::size_t points, const PointOf& point_of) const;
  /// Least and greatest F over cubes about the points. For maps that have bounds over cubes.
  std::vector<std::array<double, 2>> bounds(const std::vector<Point4>& points,
                                            double half_side) const;

  /// Images of points that are undecided, and how far they move where the point does.
  struct Moved {
    std::vector<std::size_t> from;  ///< the points' numbers
    std::vector<Point4> images;
    std::vector<double> stretches;  ///< map units a map unit
  };
  /// @param axes along the first so many of which points are moved, in random directions.
  Moved moved_images(const std::vector<Point4>& points, std::size_t axes,
                     base::Random& random) const;
  /// The first images of `count` random points of the slice; points that are decided count too.
  Moved first_images(std::size_t count, base::Random& random) const;

 private:
  /// @param slots,reals of a point (DeviceMap::work).
  template <std::size_t kOutputs, class Take>
  void run(const char* kernel, std::size_t points, const PointOf& point_of, double slots,
           double reals, const std::vector<device::Argument>& more, const Take& take) const;

  const map::DeviceMap& map_;
  const std::stop_token& stop_;
};

/// How far the first image of an undecided point of the slice moves where the point does, map units
/// a map unit: the median over some thousands of points, and at least 1. @throws Interrupted
double first_stretch(const map::DeviceMap& map, const std::stop_token& stop);

/// How far images of these points of the slice move where the points do, map units a map unit,
/// after one iterate and more, up to `most`: less at about the share `quantile` of the points whose
/// orbits are undecided so far. Fewer than `most` where none is. @throws Interrupted
std::vector<double> stretches_at(const map::DeviceMap& map,
                                 const std::vector<Eigen::Vector3d>& points, int most,
                                 double quantile, const std::stop_token& stop);

}  // namespace qjulia::surface

#pragma once
/// A map on a device, and what every launch over it takes.

#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "device/context.hpp"
#include "map/cost.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::map {

/// The map in a device buffer, as layout/map_layout.h says.
std::vector<double> pack_map(const Map& map, const StopRadii& stops);

/// The files that a program about the map stands on, by the names that map.clh includes them under:
/// its kinds of modulus and versor, and portals and paint where it has some.
std::map<std::string, std::string> kind_files(const Map& map);

/// What a kernel does at a point.
struct PointWork {
  double cost;   ///< as PointBatch takes it
  double slots;  ///< for each factor (map/cost.hpp)
  double reals;
  bool at_most = false;
};

class DeviceMap {
 public:
  DeviceMap(const Device& device, const Map& map, const StopRadii& stops, Precision precision);

  const Device& device() const { return device_; }
  device::Context& context() const { return device_.context(); }
  /// A kernel built for this map's kinds of modulus and versor, for portals and paint where it has
  /// some, its lane width and precision.
  /// @param defines macros of the program's own, with their values.
  device::Kernel kernel(const char* file, const char* name,
                        const std::map<std::string, int>& defines = {}) const;
  const device::RealBuffer& buffer() const { return buffer_; }
  int factors() const { return factors_; }
  Precision precision() const { return precision_; }
  device::Argument real(double value) const { return device::Argument::real(value, precision_); }

  const std::vector<Quaternion>& centers() const { return centers_; }
  bool has_portals() const { return kinds_.contains("QJ_PORTALS"); }
  bool is_painted() const { return kinds_.contains("QJ_PAINT"); }
  /// Whether orbits may be interpolated. F jumps at portals' rims, and images fall on them; a
  /// noise's direction turns at once about its zeros, and nothing shows where these are.
  bool interpolates() const { return interpolates_; }
  /// Whether F can be bounded over cubes of four dimensions.
  bool has_cube_bounds() const { return has_cube_bounds_; }
  double slice() const { return slice_; }

  /// ln of the escape radius; 1e30 where there is none.
  double log_escape() const { return log_escape_; }
  /// ln of the radius below which an iterate never leaves, and of that above which none returns.
  double log_inner() const { return log_inner_; }
  double log_outer() const { return log_outer_; }

  /// What F, and what a whole iterate costs at a point, in factors' logarithms.
  double modulus_cost() const { return modulus_cost_; }
  double step_cost() const { return step_cost_; }

  /// The work of a launch over so many points, with so many slots for each of the map's factors
  /// (map/cost.hpp) and so many reals at each.
  device::LaunchWork work(std::size_t points, double slots, double reals,
                          bool at_most = false) const {
    const auto count = static_cast<double>(points);
    return {count * factors_ * slots,
            count * reals,
            at_most,
            {.terms = static_cast<std::size_t>(factors_), .points = points}};
  }

  /// F_n, from coordinates in a buffer to a buffer.
  PointWork field_work(int iterations) const {
    return {iterations == 1 ? modulus_cost_ : step_cost_ * iterations, cost::field(iterations), 5,
            iterations > 1};
  }

  /// Points to a work-item.
  std::size_t lanes() const { return static_cast<std::size_t>(device_.lane_width(precision_)); }
  double points_per_item() const { return static_cast<double>(lanes()); }
  /// Work-items for so many points.
  std::size_t groups(std::size_t points) const { return (points + lanes() - 1) / lanes(); }

 private:
  Device device_;
  device::RealBuffer buffer_;
  int factors_;
  Precision precision_;
  std::map<std::string, std::string> kinds_;  ///< the files of modulus, versor, portals and paint
  double modulus_cost_, step_cost_;
  std::vector<Quaternion> centers_;
  double slice_;
  bool interpolates_, has_cube_bounds_;
  double log_escape_, log_inner_, log_outer_;
};

}  // namespace qjulia::map

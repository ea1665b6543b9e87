#pragma once
/// A map on a device, and what every launch over it takes.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "device/context.hpp"
#include "qjulia/field.hpp"

namespace qjulia {

class DeviceMap {
 public:
  /// Factors evaluated in one launch: about 30 ms of potentials on two cores.
  static constexpr std::size_t kPairsPerLaunch = std::size_t{1} << 27;
  /// The same for whole iterates, whose versors cost several times as much.
  static constexpr std::size_t kVersorsPerLaunch = kPairsPerLaunch / 4;

  DeviceMap(const Device& device, const RationalMap& map, const StopRadii& stops,
            Precision precision);

  device::Context& context() const { return device_.context(); }
  device::Kernel kernel(const char* file, const char* name) const;
  const device::RealBuffer& buffer() const { return buffer_; }
  int factors() const { return factors_; }
  Precision precision() const { return precision_; }
  device::Argument real(double value) const { return device::Argument::real(value, precision_); }

  const std::vector<Quaternion>& centers() const { return centers_; }
  double slice() const { return slice_; }

  /// ln of the radius below which an iterate never leaves, and of that above which none returns.
  double log_inner() const { return log_inner_; }
  double log_outer() const { return log_outer_; }

  /// Points to a work-item.
  std::size_t lanes() const;
  /// Work-items for so many points.
  std::size_t groups(std::size_t points) const { return (points + lanes() - 1) / lanes(); }
  /// Work-items for so many pairs of a point and a factor; at least one.
  std::size_t groups_per_launch(std::size_t pairs) const;

 private:
  Device device_;
  device::RealBuffer buffer_;
  int factors_;
  Precision precision_;
  std::vector<Quaternion> centers_;
  double slice_;
  double log_inner_, log_outer_;
};

/// A count as kernels take it.
inline std::int32_t narrow(std::size_t count) { return static_cast<std::int32_t>(count); }

}  // namespace qjulia

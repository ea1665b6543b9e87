#pragma once
/// Where iterates after the first take points of all four dimensions, computed once at the nodes of
/// a lattice and looked up (kernels/image_table.clh).

#include <stop_token>

#include "device/context.hpp"
#include "map/device_map.hpp"

namespace qjulia::surface {

class ImageTable {
 public:
  /// A table without anything: every image is computed.
  explicit ImageTable(const map::DeviceMap& map);

  /// Over the ball of undecided points, as fine as is needed for looking up the second iterate to
  /// displace what is seen by no more than `displacement`, map units, or as fine as memory allows.
  /// Empty where the map's kinds have no bounds over cubes, and where even a coarse table would
  /// take too much memory. @throws Interrupted
  static ImageTable of_ball(const map::DeviceMap& map, double displacement,
                            const std::stop_token& stop);

  bool is_empty() const { return step_ == 0; }
  /// Whether memory allows no finer one.
  bool is_finest() const;

  /// The first iterate that can be looked up so that what is seen is displaced by no more than
  /// this, map units; beyond every n where none can.
  int first_iterate(double displacement) const;
  /// F of undecided points is right to within this, as far as random points tell.
  double margin() const { return margin_; }
  /// How far the images of iterate 2 move where points do: the median, and at least 1.
  double stretch() const { return stretch_; }

  // These are what ray_march.cl's march_depth takes.
  const device::RealBuffer& layout() const { return layout_; }
  const device::Buffer<std::int32_t>& bricks() const { return bricks_; }
  const device::Buffer<std::uint16_t>& fields() const { return fields_; }
  const device::Buffer<std::int8_t>& versors() const { return versors_; }

 private:
  static ImageTable with_step(const map::DeviceMap& map, double step, const std::stop_token& stop);
  /// Sets what look-ups displace, and the stretch.
  void measure(const map::DeviceMap& map, const std::stop_token& stop);

  double step_ = 0;          ///< between nodes, map units; 0 without any
  double displacement_ = 0;  ///< of points of the slice by looking up iterate 2: the median
  double stretch_ = 1;       ///< of iterate 2
  double margin_ = 0;        ///< of F
  device::RealBuffer layout_;
  device::Buffer<std::int32_t> bricks_;
  device::Buffer<std::uint16_t> fields_;
  device::Buffer<std::int8_t> versors_;
};

}  // namespace qjulia::surface

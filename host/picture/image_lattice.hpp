#pragma once
/// Where one iterate takes the points that rays ask about, computed once at the nodes of a lattice
/// and interpolated between them (kernels/image_lattice.clh).

#include "device/context.hpp"
#include "map/device_map.hpp"
#include "picture/band_grid.hpp"
#include "qjulia/mesh.hpp"

namespace qjulia::picture {

class ImageLattice {
 public:
  /// Tells nothing: every image is computed.
  explicit ImageLattice(const map::DeviceMap& map);

  /// Over the part of the band in `box`. @param displacement by how far, map coordinates, the set
  /// may seem to lie elsewhere. @param stretch how far images move where points do, map units a map
  /// unit. @param rays how many it is likely to serve.
  ImageLattice(const map::DeviceMap& map, const BandGrid& band, const Box& box, double displacement,
               double stretch, double rays);

  /// Whether it serves rays inside `box` for this displacement.
  bool serves(const Box& box, double displacement) const;

  // As ray_march.cl's march_depth takes them.
  const device::RealBuffer& layout() const { return layout_; }
  const device::Buffer<std::int32_t>& places() const { return places_; }
  const device::RealBuffer& field() const { return field_; }
  const device::RealBuffer& versors() const { return versors_; }
  const device::Buffer<std::uint8_t>& trusted() const { return trusted_; }

 private:
  Box box_;
  double displacement_ = 0;
  device::RealBuffer layout_, field_, versors_;
  device::Buffer<std::int32_t> places_;
  device::Buffer<std::uint8_t> trusted_;
};

}  // namespace qjulia::picture

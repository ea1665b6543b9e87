#pragma once
/// Settling points without iterating them, by where they and their images lie on interpolation.

#include <cstdint>
#include <span>
#include <vector>

#include "map/device_map.hpp"
#include "surface/grid.hpp"
#include "surface/node_lattice.hpp"

namespace qjulia::surface {

/// A block of the grid's points as kernels take it.
device::Argument grid_block(const Grid& grid, const GridBlock& block, Precision precision);

/// Computes the kind's F and U at the points of these numbers in the block, whose points lie
/// `spacing` grid points apart; point i goes to slot slots[i].
/// @param field one real for each slot. @param versors four reals for each.
void block_images(const map::DeviceMap& map, const Grid& grid, const GridBlock& block, int spacing,
                  std::vector<std::int32_t> numbers, std::vector<std::int32_t> slots,
                  const device::Memory& field, const device::Memory& versors);

/// F_1 and the versor U of the image e^{F_1} U change smoothly from point to point, and U costs
/// several times as much as F. So both are computed on a lattice and interpolated, and only F of
/// the image is evaluated point by point. The difference to interpolants of lower order says how
/// far off F may be, with a margin that was measured, not proved (kernels/interpolated_orbit.cl).
/// What nodes may be too far apart to see lies about factors' centres: points near one, as nodes
/// are near each other, are left out. A point is settled when F_1 or F of its image is beyond
/// `below` or `above` by more than that.
template <class Real>
class InterpolatedOrbits {
 public:
  /// @param below, above where sides are certain, about `level`.
  InterpolatedOrbits(const map::DeviceMap& map, const Grid& grid, const GridBlock& block,
                     double below, double level, double above);

  /// @param numbers of some of the block's points, rising.
  /// @param values by number; takes F, short of what it may be off, of the points that are settled.
  /// @return the numbers of the others, rising.
  std::vector<std::int32_t> settle(std::span<const std::int32_t> numbers, std::span<float> values);

  /// Nodes computed.
  std::uint64_t nodes() const { return nodes_; }

 private:
  /// F of so many points and U, four reals each, on the device.
  struct Images {
    device::Buffer<Real> field, versors;
  };
  Images images(std::size_t size) const {
    auto& context = map_.context();
    return {context.template allocate<Real>(size), context.template allocate<Real>(4 * size)};
  }
  std::vector<Real> settled(const NodeLattice& lattice, std::vector<std::int32_t> numbers) const;
  int spacing(std::span<const std::int32_t> numbers) const;
  std::vector<std::int32_t> near_factors(std::span<const std::int32_t> numbers, int spacing) const;

  const map::DeviceMap& map_;
  Grid grid_;
  GridBlock block_;
  Real below_, level_, above_;
  std::uint64_t nodes_ = 0;
};

}  // namespace qjulia::surface

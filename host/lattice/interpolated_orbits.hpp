#pragma once
/// Settling points without iterating them, by where they and their images lie on interpolation.

#include <cstdint>
#include <span>
#include <vector>

#include "lattice/grid.hpp"
#include "map/device_map.hpp"

namespace qjulia::surface {

/// A block of the grid's points as kernels take it.
device::Argument grid_block(const Grid& grid, const GridBlock& block, Precision precision);

/// Computes the kind's F and U at the points of these numbers in the block, whose points lie
/// `spacing` grid points apart; point i goes to slot slots[i].
/// @param field one real for each slot. @param versors four reals for each.
void block_images(const map::DeviceMap& map, const Grid& grid, const GridBlock& block, int spacing,
                  std::vector<std::int32_t> numbers, std::vector<std::int32_t> slots,
                  const device::Memory& field, const device::Memory& versors);

/// The points that were not settled.
struct Unsettled {
  std::vector<std::int32_t> numbers;  ///< rising
  std::size_t nodes = 0;              ///< computed for those that were
};

/// Settles points of a block, as far as it can without iterating them.
///
/// F_1 and the versor U of the image e^{F_1} U change smoothly from point to point, and U costs
/// several times as much as F. So both are computed on a lattice and interpolated, and only F of
/// the image is evaluated point by point. The difference to interpolants of lower order says how
/// far off F may be, with a margin that was measured, not proved (kernels/interpolated_orbit.cl).
/// What nodes may be too far apart to see lies about factors' centres: points near one, as nodes
/// are near each other, are left out. A point is settled when F_1 or F of its image is beyond
/// `below` or `above` by more than that.
///
/// @param below, above where sides are certain, about `level`.
/// @param numbers of some of the block's points, rising.
/// @param values is indexed by number. A settled point's F goes there, less the most that it may be
///   off.
Unsettled settle_by_interpolation(const map::DeviceMap& map, const Grid& grid,
                                  const GridBlock& block, double below, double level, double above,
                                  std::span<const std::int32_t> numbers, std::span<float> values);

}  // namespace qjulia::surface

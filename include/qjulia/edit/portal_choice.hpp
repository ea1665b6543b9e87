#pragma once
/// Where portals may stand: copies of a shape on its own tips.

#include <vector>

#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

struct PortalOptions {
  int count = 3;      ///< copies on the shape itself, 1 … 16
  double size = 0.3;  ///< a copy's, where the shape's is 1; 0.02 … 0.6
  PortalMask mask = PortalMask::outside;

  void validate() const;  ///< @throws OptionError
};

/// Portals whose copies stand on the shape's protrusions: each time on the point of its surface
/// that is farthest, along the surface, from the body and from the copies before. Copies keep the
/// shape's attitude. Fewer than asked for where no more fit; they are balls that hold copies on
/// copies too, where that leaves them apart.
/// @throws InputError when the map's slice is not W = 0, OptionError when no copy of that size
///   fits, Interrupted.
std::vector<Portal> proposed_portals(const Device& device, const Map& map,
                                     const PortalOptions& options,
                                     const ProgressMonitor& monitor = {});

/// The map's portals and one more, whose copy stands on the shape's own surface, at its point
/// nearest to `place` (shape units). It keeps clear of the others, and keeps the shape's attitude.
/// Their balls hold copies on copies too, where that leaves them apart.
/// @param size a copy's, as in PortalOptions.
/// @throws InputError when the map's slice is not W = 0, or when no portal can be added;
///   OptionError when no copy of that size has room there; Interrupted.
std::vector<Portal> planted_portals(const Device& device, const Map& map,
                                    const Eigen::Vector3d& place, double size,
                                    const ProgressMonitor& monitor = {});

/// How deep copies stand on copies until they are smaller than a hundredth of the shape. A copy of
/// depth k looks with n iterations as the shape does with n − k.
int visible_depth(const std::vector<Portal>& portals);

}  // namespace qjulia

#pragma once
/// How far single precision can be trusted on a map.

#include <cstddef>
#include <stop_token>

#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::check {

/// Points near a map's surface, and how many of them are inside at one precision only.
struct LabelCheck {
  std::size_t points = 0;
  std::size_t different = 0;
  int iterations = 6;
};

/// Labels of fixed random points within one shell's thickness (1 / ‖∇F_1‖) of the surface F_1 = L,
/// on the map's slice, with the stop radii that surfaces and pictures use.
/// @throws KernelBuildError where the device has no double precision; Interrupted
LabelCheck compare_precisions(const Device& device, const Map& map, int iterations = 6,
                              const std::stop_token& stop = {});

}  // namespace qjulia::check

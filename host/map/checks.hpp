#pragma once
/// Checks that several of a map's parts share, and those of options.

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <type_traits>

#include "qjulia/base/box.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::map {

/// Cells of a sampled field along any side.
constexpr int kMostSampleCells = 8192;

/// @throws InputError unless low <= value <= high; NaN never is. @param name in the map.
template <class Number>
void check_within(const std::string& name, Number value, std::type_identity_t<Number> low,
                  std::type_identity_t<Number> high) {
  if (value >= low && value <= high) return;
  throw InputError(fmt::format("the map's {} is {}: it must be {} to {}", name, value, low, high));
}

/// A length whose square is finite in single precision, and so is that of its inverse.
/// @throws InputError
inline void check_length(const std::string& name, double value) {
  constexpr double kLeast = 1e-9, kMost = 1e9;
  if (value >= kLeast && value <= kMost) return;
  throw InputError(
      fmt::format("the map's {} is {}: it must be within {} … {}", name, value, kLeast, kMost));
}

/// Where a grid begins, map coordinates. @throws InputError
inline void check_origin(const std::string& name, const Eigen::Vector3d& origin) {
  if ((origin.array().abs() <= 1e9).all()) return;
  throw InputError(fmt::format("the map's {} must have finite numbers within ±1e9", name));
}

/// Points to evaluate a map at. @throws InputError naming the first that is not finite, or whose
/// square is not in single precision.
inline void check_points(std::span<const Quaternion> points) {
  constexpr double kMost = 1e15;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const double c : coordinates(points[i])) {
      if (std::abs(c) <= kMost) continue;
      const auto [x, y, z, w] = points[i];
      throw InputError(fmt::format(
          "point {} is {}: ({}, {}, {}, {}); give coordinates within ±{} (points count from 0)", i,
          std::isfinite(c) ? "too far away" : "not finite", x, y, z, w, kMost));
    }
  }
}

/// @param field the option's name. @throws OptionError unless it is left out, or finite with a
/// volume.
inline void expect_box(const std::optional<Box>& box, const char* field = "box") {
  if (!box || (box->low.allFinite() && box->high.allFinite() && (box->size().array() > 0).all() &&
               std::isfinite(box->diagonal()))) {
    return;
  }
  throw OptionError(field, "give x0 y0 z0 x1 y1 z1 with x0 < x1, y0 < y1, z0 < z1");
}

/// @param escape radius, map units.
/// @throws OptionError unless orbits that come to rest below `level` stay within the radius, and it
/// is small enough for single precision.
inline void expect_escape(double escape, double level) {
  if (!(escape > std::exp(level))) {
    throw OptionError("escape", fmt::format("{} is too small: orbits that come to rest reach "
                                            "radius {:.3g}, map units; give more than that",
                                            escape, std::exp(level)));
  }
  if (escape > kLargestEscape) {
    throw OptionError("escape", fmt::format("{} is too large; give {} or less, map units", escape,
                                            kLargestEscape));
  }
}

}  // namespace qjulia::map

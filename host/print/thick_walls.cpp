// Sets that are unions of balls of radius r are as thick as 2 r everywhere. The largest such set in
// a solid is its opening (Serra 1982, "Image Analysis and Mathematical Morphology"). What the
// opening leaves out is thin: flat parts, tufts and edges. Its ridges are the places about which
// the distance to the surface grows in no direction nearly as fast as one walks (Blum 1967, "A
// transformation for extracting new descriptors of shape"): the middles of walls and tufts. In a
// wedge it grows by the sine of half the angle, so that blunt edges have no ridge and stay rounded.

#include "print/thick_walls.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "qjulia/base/progress.hpp"

namespace qjulia::surface {
namespace {

/// Balls about points at most so much deeper than the radius make the opening: a ball of the radius
/// about any place has one of these within a step's diagonal.
constexpr float kDeeper = 1.75F;
/// The balls that fillets are rolled with, and how far from ridge balls there are fillets, in radii
/// of these. Where two tufts touch they would otherwise meet in a neck without thickness.
constexpr float kFillet = 0.75F, kFilletReach = 1;
/// On a ridge the distance grows by less than this share of the way, to any neighbour.
constexpr float kRidgeSlope = 0.6F;
/// A wall that lies between points of the grid has its ridge at points outside, not deeper than it.
constexpr float kMissed = 0.5F;
/// Balls that stand on a flat foot have their centres this many radii above it.
constexpr float kStanding = 0.92F;

bool is_on_ridge(const SlabField& depth, std::size_t number, const Eigen::Vector3i& index) {
  bool is_ridge = true;
  for_around(depth.points, index, 1, [&](std::size_t other, const Eigen::Vector3i& at) {
    const float way = (at - index).cast<float>().norm();
    is_ridge = is_ridge &&
               (other == number || depth.values[other] - depth.values[number] < kRidgeSlope * way);
  });
  return is_ridge;
}

/// Values are exact up to this distance beyond a surface.
float reach_beyond(const ThickWalls& walls) { return kFillet * walls.radius + kDeeper + 1; }

/// Fills what balls rolled along the outside do not reach, near ridge balls.
/// @param ridges the distance from these.
void add_fillets(SlabField& field, const SlabField& ridges, const ThickWalls& walls,
                 const std::stop_token& stop) {
  const float rolled = kFillet * walls.radius, reach = kFilletReach * walls.radius;
  SlabField free(field.points, kFarAway);
  for_each_point(field, stop, [&](std::size_t number, const Eigen::Vector3i& index) {
    const float outside = field.values[number];
    const bool fits = outside >= rolled && outside < rolled + kDeeper;
    if (fits && ridges.values[number] < reach + outside + 2)
      add_ball(free, index, outside, outside + 2);
  });
  for (std::size_t i = 0; i < field.values.size(); ++i) {
    const float fillet = std::max(-free.values[i], ridges.values[i] - reach);
    field.values[i] = std::min(field.values[i], fillet);
  }
}

/// Smooths with weights 1, 2 and 1 along each axis. Unions of balls about grid points have stepped
/// surfaces, whose normals would be useless.
void smooth(SlabField& field) {
  constexpr float kMostSmoothed = 4;
  for (float& value : field.values) value = std::clamp(value, -kMostSmoothed, kMostSmoothed);
  std::size_t stride = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<float> before = field.values;
    for (std::size_t i = stride; i + stride < before.size(); ++i) {
      field.values[i] = 0.25F * (before[i - stride] + 2 * before[i] + before[i + stride]);
    }
    stride *= static_cast<std::size_t>(field.points[axis]);
  }
}

}  // namespace

double margin_of(const ThickWalls& walls) {
  return double{walls.radius} + double{reach_beyond(walls)} + 1;
}

int halo_of(const ThickWalls& walls) {
  const float r = walls.radius;
  const float to_depth = r + kDeeper + 1 + kNearReach;
  const float to_opening = r + kDeeper + walls.tolerance + reach_beyond(walls);
  const float to_fillets = kFillet * r + kDeeper + 2;
  const float to_standing = kStanding * r + 1;
  return static_cast<int>(std::ceil(to_depth + to_opening + r + reach_beyond(walls) + to_fillets +
                                    to_standing)) +
         3;
}

SlabField thickened(const SlabField& near, const ThickWalls& walls, std::optional<float> floor,
                    const std::stop_token& stop) {
  const float r = walls.radius;
  const SlabField depth = depths(near, r + kDeeper + 1, Grooves::wide, stop);
  SlabField opened(near.points, kFarAway);
  for_each_point(depth, stop, [&](std::size_t number, const Eigen::Vector3i& index) {
    const float deep = depth.values[number];
    if (deep < r) return;
    if (deep < r + kDeeper) {
      add_ball(opened, index, deep, deep + std::max(walls.tolerance + 1, reach_beyond(walls)));
    } else {
      opened.values[number] = std::min(opened.values[number], -deep);
    }
  });
  SlabField ridges(near.points, kFarAway);
  const int lowest = floor ? static_cast<int>(std::ceil(*floor + kStanding * r)) : 0;
  for_each_point(depth, stop, [&](std::size_t number, const Eigen::Vector3i& index) {
    if (depth.values[number] <= -kMissed || opened.values[number] <= walls.tolerance) return;
    if (!is_on_ridge(depth, number, index)) return;
    const Eigen::Vector3i center(index.x(), index.y(), std::max(index.z(), lowest));
    add_ball(ridges, center, r, r + reach_beyond(walls));
  });
  SlabField result = std::move(opened);
  for (std::size_t i = 0; i < result.values.size(); ++i) {
    result.values[i] = std::min(result.values[i], ridges.values[i]);
  }
  add_fillets(result, ridges, walls, stop);
  smooth(result);
  return result;
}

}  // namespace qjulia::surface

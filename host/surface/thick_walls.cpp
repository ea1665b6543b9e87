// Sets that are unions of balls of radius r are as thick as 2 r everywhere. The largest such set in
// a solid is its opening (Serra 1982, "Image Analysis and Mathematical Morphology"). What the
// opening leaves out is thin: flakes, thorns and edges. Its ridges are the places about which the
// distance to the surface grows in no direction nearly as fast as one walks (Blum 1967, "A
// transformation for extracting new descriptors of shape"): the middles of walls and thorns. In a
// wedge it grows by the sine of half the angle, so that blunt edges have no ridge and stay rounded.

#include "surface/thick_walls.hpp"

#include <algorithm>
#include <cmath>

#include "qjulia/progress.hpp"

namespace qjulia::surface {
namespace {

/// Balls about points at most so much deeper than the radius make the opening: a ball of the radius
/// about any place has one of these within a step's diagonal.
constexpr float kDeeper = 1.75F;
/// Values are wanted so far beyond a surface.
constexpr float kBeyond = 2;
/// On a ridge the distance grows by less than this share of the way, to any neighbour.
constexpr float kRidgeSlope = 0.6F;
/// A wall that lies between points of the grid has its ridge at points outside, not deeper than it.
constexpr float kMissed = 0.5F;

bool is_on_ridge(const SlabField& depth, std::size_t number, const Eigen::Vector3i& index) {
  bool is_ridge = true;
  for_around(depth.points, index, 1, [&](std::size_t other, const Eigen::Vector3i& at) {
    const float way = (at - index).cast<float>().norm();
    is_ridge = is_ridge &&
               (other == number || depth.values[other] - depth.values[number] < kRidgeSlope * way);
  });
  return is_ridge;
}

}  // namespace

int halo_of(const ThickWalls& walls) {
  const float r = walls.radius;
  const float to_depth = r + kDeeper + 1 + kNearReach;
  const float to_opening = r + kDeeper + walls.tolerance + kBeyond;
  return static_cast<int>(std::ceil(to_depth + to_opening + r + kBeyond)) + 2;
}

SlabField thickened(const SlabField& near, const ThickWalls& walls, const std::stop_token& stop) {
  const float r = walls.radius;
  const SlabField depth = depths(near, r + kDeeper + 1, stop);
  SlabField opened(near.points, kFarAway);
  for_each_point(depth, stop, [&](std::size_t number, const Eigen::Vector3i& index) {
    const float deep = depth.values[number];
    if (deep < r) return;
    if (deep < r + kDeeper) {
      add_ball(opened, index, deep, deep + walls.tolerance + kBeyond);
    } else {
      opened.values[number] = std::min(opened.values[number], -deep);
    }
  });
  SlabField result = opened;
  for_each_point(depth, stop, [&](std::size_t number, const Eigen::Vector3i& index) {
    if (depth.values[number] <= -kMissed || opened.values[number] <= walls.tolerance) return;
    if (is_on_ridge(depth, number, index)) add_ball(result, index, r, r + kBeyond);
  });
  return result;
}

}  // namespace qjulia::surface

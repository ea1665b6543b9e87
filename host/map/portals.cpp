#include "map/portals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "map/checks.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {

namespace map {
namespace {

/// How far from the origin a portal's ball may reach, map units. This is ten times the longest side
/// of a shape. Beside a copy that stood much farther away, the shape would be smaller than a cell
/// or a pixel.
constexpr double kFarthest = 30;

void check_portal(const Portal& portal, const std::string& name) {
  const auto refuse = [&](const char* key, const std::string& what) {
    throw InputError(fmt::format("the map's {}.{} {}", name, key, what));
  };
  const auto check_point = [&](const Eigen::Vector3d& x, const char* key) {
    if ((x.array().abs() <= kLargestEscape).all()) return;
    refuse(key, fmt::format("must have finite numbers within ±{}", kLargestEscape));
  };
  check_point(portal.center, "center");
  check_point(portal.destination, "destination");
  if (!(portal.radius > 0 && portal.radius <= kLargestEscape)) {
    refuse("radius", fmt::format("is {}: it must be positive, and at most {}", portal.radius,
                                 kLargestEscape));
  }
  check_within(name + ".scale", portal.scale, Portal::kLeastScale, Portal::kMostScale);
  const Rotation& rotation = portal.rotation;
  const Eigen::Array3d lengths = rotation.axis.array().abs();
  if (!((lengths <= kLargestEscape).all() && (lengths > 0).any() &&
        std::abs(rotation.degrees) <= kLargestEscape)) {
    refuse("rotation", "must be an axis, not all zero, and degrees");
  }
}

/// The smallest box that holds what the portal takes to points of a box; map coordinates.
Box preimage(const Portal& portal, const Box& box) {
  const Eigen::Matrix3d back = portal.rotation.matrix().transpose() / portal.scale;
  const Box image = image_of(box, back, portal.destination, portal.center);
  const Eigen::Vector3d ball = Eigen::Vector3d::Constant(portal.radius);
  return {image.low.cwiseMax(portal.center - ball), image.high.cwiseMin(portal.center + ball)};
}

}  // namespace

void check_portals(const std::vector<Portal>& portals) {
  if (portals.size() > kMostPortals) {
    throw InputError(
        fmt::format("the map has {} portals: it may have {}", portals.size(), kMostPortals));
  }
  for (std::size_t i = 0; i < portals.size(); ++i) {
    check_portal(portals[i], fmt::format("portals[{}]", i));
    if (holds_origin({portals[i]})) {
      throw InputError(fmt::format(
          "the map's portals[{}] holds the origin of iteration, and no orbit would come to rest: "
          "make its radius smaller, or move its center",
          i));
    }
    const double farthest = portal_reach({portals[i]}).second;
    if (farthest > kFarthest) {
      throw InputError(fmt::format(
          "the map's portals[{}] reaches {:.6g} from the origin, and the shape would be too small "
          "to be seen beside its copy: it may reach {} map units; make its radius smaller, or "
          "move its center",
          i, farthest, kFarthest));
    }
    for (std::size_t j = 0; j < i; ++j) {
      const double between = (portals[i].center - portals[j].center).norm();
      if (between >= portals[i].radius + portals[j].radius) continue;
      throw InputError(fmt::format(
          "the map's portals[{}] and portals[{}] overlap: make a radius smaller, or move a center",
          j, i));
    }
  }
}

bool holds_origin(const std::vector<Portal>& portals) { return portal_reach(portals).first <= 0; }

std::pair<double, double> portal_reach(const std::vector<Portal>& portals) {
  std::pair<double, double> reach{std::numeric_limits<double>::infinity(), 0};
  for (const Portal& portal : portals) {
    const double distance = portal.center.norm();
    reach.first = std::min(reach.first, distance - portal.radius);
    reach.second = std::max(reach.second, distance + portal.radius);
  }
  return reach;
}

Box image_of(const Box& box, const Eigen::Matrix3d& matrix, const Eigen::Vector3d& from,
             const Eigen::Vector3d& to) {
  const Eigen::Vector3d center = to + matrix * (box.center() - from);
  const Eigen::Vector3d half = 0.5 * matrix.cwiseAbs() * box.size();
  return {center - half, center + half};
}

std::optional<Box> box_with_copies(const Map& map) {
  if (!map.frame.box || map.layers.portals.empty()) return map.frame.box;
  const ShapeToMap& to_map = map.frame.shape_to_map;
  const Box shape = to_map.to_map(*map.frame.box);
  // Copies stand on copies, each so much smaller that few of them widen the box.
  constexpr int kDepth = 4;
  Box all = shape;
  for (int depth = 0; depth < kDepth; ++depth) {
    const Box before = all;
    for (const Portal& portal : map.layers.portals) {
      const Box copy = preimage(portal, before);
      if ((copy.size().array() < 0).any()) continue;
      all = {all.low.cwiseMin(copy.low), all.high.cwiseMax(copy.high)};
    }
  }
  return Box{to_map.to_shape(all.low), to_map.to_shape(all.high)};
}

}  // namespace map
}  // namespace qjulia

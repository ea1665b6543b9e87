#include "qjulia/map/knobs.hpp"

#include <cmath>

#include "base/random.hpp"
#include "map/portals.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/knob_table.hpp"

namespace qjulia {
namespace {

/// @throws OptionError for a knob that the map does not bear.
void expect_borne(const Map& map, const MapKnobs& knobs) {
  for (const Knob& knob : knob_table()) {
    if (!knob.is_turned(knobs)) continue;
    if (const std::string why = knob.why_not(map); !why.empty()) throw OptionError(knob.name, why);
  }
}

/// Fisher and Yates.
void shuffle(std::vector<Factor>& factors, std::uint64_t seed) {
  base::Random random(seed);
  for (std::size_t i = factors.size(); i > 1; --i) {
    std::swap(factors[i - 1], factors[random.index(i)]);
  }
}

/// @throws InputError naming the options that moved the origin out of the shape.
Map calibrated_inside(const Device& device, const Map& map) {
  if (map::holds_origin(map.layers.portals)) {
    throw InputError(
        "drift and translate move the origin of iteration into a portal, and no orbit would come "
        "to rest; use less");
  }
  try {
    return calibrated(device, map);
  } catch (const InputError&) {
    throw InputError(
        "drift and translate move the origin of iteration out of the shape, so that nothing would "
        "be drawn in; use less");
  }
}

/// All centres, and portals, turned about the origin.
Map rotated(Map map, const Rotation& rotation) {
  const Eigen::Matrix3d turn = rotation.matrix();
  for (Factor& factor : map.dynamics.factors) {
    const Eigen::Vector3d c =
        turn * Eigen::Vector3d(factor.center.x, factor.center.y, factor.center.z);
    factor.center = {c.x(), c.y(), c.z(), factor.center.w};
  }
  for (Portal& portal : map.layers.portals) {
    portal.center = turn * portal.center;
    portal.destination = turn * portal.destination;
    portal.rotation = Rotation::of(turn * portal.rotation.matrix() * turn.transpose());
  }
  const Eigen::Vector3d origin = map.frame.shape_to_map.to_shape(Eigen::Vector3d::Zero());
  if (!map.frame.box) return map;
  map.frame.diagonal = map.frame.own_diagonal();  // the turned box has a longer one
  map.frame.box = map::image_of(*map.frame.box, turn, origin, origin);
  return map;
}

/// All centres, a grid, portals, paint, and the window they are seen through moved together: the
/// shape stays in its own coordinates, the origin of iteration moves by −offset (map units).
Map moved(Map map, const Eigen::Vector3d& offset) {
  for (Factor& factor : map.dynamics.factors) {
    factor.center = factor.center + Quaternion{offset.x(), offset.y(), offset.z(), 0};
  }
  if (auto* distance = std::get_if<DistanceModulus>(&map.dynamics.modulus))
    distance->origin += offset;
  if (auto* noise = std::get_if<NoiseVersor>(&map.dynamics.versor)) noise->origin += offset;
  if (map.layers.paint) map.layers.paint->origin += offset;
  for (Portal& portal : map.layers.portals) {
    portal.center += offset;
    portal.destination += offset;
  }
  map.frame.shape_to_map.translation += offset;
  return map;
}

}  // namespace

void MapKnobs::validate() const {
  expect_in_ranges(knob_table(), *this);
  if (phase && !(std::isfinite(norm(*phase)) && norm(*phase) > 0)) {
    throw OptionError("phase", "give four numbers, not all zero, such as 0.8 0.6 0 0");
  }
  if (rotate &&
      !(rotate->axis.allFinite() && rotate->axis.norm() > 0 && std::isfinite(rotate->degrees))) {
    throw OptionError("rotate", "give an axis, not all zero, and degrees, such as 0 1 0 90");
  }
}

Map with_knobs(const Device& device, const Map& map, const MapKnobs& knobs) {
  knobs.validate();
  map.validate();
  expect_borne(map, knobs);
  Map result = knobs.detail ? with_detail(map, *knobs.detail) : map;
  if (knobs.order_seed) shuffle(result.dynamics.factors, *knobs.order_seed);
  if (knobs.phase) result.dynamics.phase = (1 / norm(*knobs.phase)) * *knobs.phase;
  if (knobs.slice) result.dynamics.slice = *knobs.slice;
  if (knobs.rotate) result = rotated(std::move(result), *knobs.rotate);
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  if (knobs.drift)
    offset.z() += *knobs.drift * map.frame.inradius.value() * map.frame.shape_to_map.scale;
  if (knobs.translate) offset += map.frame.shape_to_map.scale * *knobs.translate;
  if (offset != Eigen::Vector3d::Zero()) result = calibrated_inside(device, moved(result, offset));
  if (knobs.scale) result.dynamics.log_scale -= std::log(*knobs.scale);
  if (knobs.steepness) result.layers.steepness = *knobs.steepness;
  result.validate();
  return result;
}

}  // namespace qjulia

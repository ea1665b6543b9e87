#include "morph/map_distance.hpp"

#include "qjulia/base/error.hpp"

namespace qjulia::morph {
namespace {

Map dynamics_of(const Map& map) {
  Map bare = without_paint(without_portals(map));
  bare.layers.steepness = 1;
  return bare;
}

}  // namespace

MapDistance::MapDistance(const Device& device, const Map& map)
    : field_(device, dynamics_of(map)),
      slice_(map.dynamics.slice),
      level_(map.dynamics.surface_level) {
  const Frame& frame = map.frame;
  if (!frame.detail || !frame.box || !frame.inradius) {
    throw InputError("the map does not say its detail, box and inradius; fit it again");
  }
  const ShapeToMap& to_map = frame.shape_to_map;
  shell_ = *frame.detail * to_map.scale * frame.own_diagonal().value();
  inradius_ = *frame.inradius * to_map.scale;
  box_ = to_map.to_map(*frame.box);
}

std::vector<double> MapDistance::at(std::vector<Quaternion> points) const {
  for (Quaternion& q : points) q.w += slice_;
  std::vector<double> found = field_.at(points);
  for (double& f : found) f = shell_ * (f - level_);
  return found;
}

}  // namespace qjulia::morph

#include "surface/vertex_placer.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "device/point_batch.hpp"
#include "device/quirks.hpp"
#include "layout/placement.h"
#include "surface/turn_count.hpp"

namespace qjulia::surface {
namespace {

/// Edges that each lane takes in turn, so that lanes whose orbits end early are not idle.
constexpr std::size_t kEdgesALane = 32;
/// What a try costs, in iterates.
constexpr double kIteratesATry = 2;
/// A point this near to the boundary ends the search. The unit is the length of an edge that each
/// of its tries has halved.
constexpr double kClose = 0.8;
/// How much an iterate is taken to stretch distances if the map does not say its detail. The places
/// of vertices hardly depend on it: 6 and 20 give meshes that are just as smooth.
constexpr double kUsualStretch = 12;
constexpr double kLeastStretch = 2;

/// |∇F_1| about the surface, map units; 0 if the map does not say its detail.
double slope_of(const Map& map) {
  const std::optional<double> diagonal = map.frame.own_diagonal();
  if (!map.frame.detail || !diagonal) return 0;
  return 1 / (*map.frame.detail * *diagonal * map.frame.shape_to_map.scale);
}

}  // namespace

VertexPlacer::VertexPlacer(const Device& device, const Map& map, const StopRadii& stops,
                           int iterations, Precision precision, const DifferenceScale& scale,
                           int tries)
    : map_(device, map, stops, precision),
      iterations_(iterations),
      scale_(scale),
      tries_(tries),
      is_counted_(device::launch_watch() != nullptr),
      kernel_(map_.kernel("place_vertices.cl", "place_vertices", counted_if_watched())),
      slope_(slope_of(map)),
      // Images of points at the surface have the length e^L.
      stretch_(slope_ > 0 ? std::max(kLeastStretch, slope_ * std::exp(map.dynamics.surface_level))
                          : kUsualStretch) {}

void VertexPlacer::place(const Grid& grid, std::span<EdgeVertex> vertices) const {
  const std::size_t share = device::share_of_lane(map_.device().info(), kEdgesALane) * map_.lanes();
  device::PointBatch batch(map_.context(), kernel_, map_.precision(), share,
                           map_.step_cost() * kIteratesATry * tries_);
  const TurnCount turns(map_, is_counted_, (vertices.size() + share - 1) / share);
  batch.run<6, 1>(
      vertices.size(),
      [&](std::size_t i) {
        const EdgeVertex& v = vertices[i];
        const Eigen::Vector3d index = v.point.cast<double>();
        return std::array{index.x(),      index.y(),          index.z(),
                          double(v.axis), double{v.at_start}, double{v.at_end}};
      },
      [&](const device::PointBatch::Part& part) {
        const auto placement = device::arguments(map_.precision(), [&](auto r) {
          using real = decltype(r);
          return qj_placement<real>{.origin_x = real(grid.origin.x()),
                                    .origin_y = real(grid.origin.y()),
                                    .origin_z = real(grid.origin.z()),
                                    .step = real(grid.step),
                                    .reach = real(scale_.reach),
                                    .flatten = real(1 / scale_.steepness),
                                    .slope = real(slope_ * grid.step),
                                    .stretch = real(stretch_),
                                    .close = real(std::ldexp(kClose, -tries_)),
                                    .iterations = iterations_,
                                    .tries = tries_,
                                    .stride = device::narrow(part.stride),
                                    .count = device::narrow(part.count),
                                    .share = device::narrow(share)};
        });
        Arguments arguments{map_.buffer(), map_.factors(), placement, part.in, part.out};
        turns.append_to(arguments);
        return device::PartCall{std::move(arguments),
                                device::moving(7 * static_cast<double>(part.count))};
      },
      [&](std::size_t i, const std::array<double, 1>& at) {
        vertices[i].put(static_cast<float>(at[0]));
      },
      map_.lanes() == 1 ? 64 : 1);
  turns.tell("place_vertices");
}

}  // namespace qjulia::surface

#include "qjulia/morph/versor_transfer.hpp"

#include <fmt/format.h>

#include "base/range_check.hpp"
#include "exact/distance_grid.hpp"
#include "morph/map_distance.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

constexpr int kFewestTransferCells = 32, kMostTransferCells = 384;

/// The shape that the map's factors make, on a grid.
DistanceModulus distance_of_factors(const Device& device, const Map& map, int cells,
                                    const std::stop_token& stop) {
  const morph::MapDistance distance(device, map);
  const auto distances = [&](std::span<const Eigen::Vector3d> places) {
    return distance.at(on_slice(places, 0));
  };
  DistanceModulus modulus =
      exact::sampled_distance(distances, distance.box(), (cells + 3) / 4 * 4, stop);
  modulus.shell = distance.shell();
  modulus.inradius = distance.inradius();
  return modulus;
}

double inradius_of(const Map& map) {
  if (!map.frame.inradius) {
    throw InputError(
        "a map does not say its \"inradius\", by which grooves are scaled; fit it "
        "again");
  }
  return *map.frame.inradius * map.frame.shape_to_map.scale;
}

}  // namespace

Map with_versor_of(const Device& device, const Map& map, const Map& grooves, int cells,
                   const ProgressMonitor& monitor) {
  base::expect_between("cells", cells, kFewestTransferCells, kMostTransferCells);
  map.validate();
  grooves.validate();
  for (const Map* each : {&map, &grooves}) {
    if (std::holds_alternative<QuadraticModulus>(each->dynamics.modulus) ||
        std::holds_alternative<QuadraticVersor>(each->dynamics.versor)) {
      throw InputError(
          fmt::format("a {} map has no grooves to give or to take; give maps of 'fit' "
                      "or 'shape'",
                      each->dynamics.kind()));
    }
  }
  const double enlarged = inradius_of(map) / inradius_of(grooves);
  Map result = map;
  result.dynamics.phase = grooves.dynamics.phase;
  if (const auto* noise = std::get_if<NoiseVersor>(&grooves.dynamics.versor)) {
    NoiseVersor scaled = *noise;
    scaled.scale /= enlarged;
    scaled.origin *= enlarged;
    result.dynamics.versor = scaled;
    if (std::holds_alternative<DistanceModulus>(result.dynamics.modulus)) {
      result.dynamics.factors.clear();
    }
  } else {
    if (std::holds_alternative<FactorsModulus>(map.dynamics.modulus)) {
      result.dynamics.modulus = distance_of_factors(device, map, cells, monitor.stop);
      result.dynamics.log_scale = map.dynamics.surface_level;
      result.dynamics.slice = 0;  // the grid holds the slice's shape
    }
    result.dynamics.versor = grooves.dynamics.versor;
    result.dynamics.factors.clear();
    for (auto [center, exponent] : grooves.dynamics.factors) {
      center.w -= grooves.dynamics.slice;
      center = enlarged * center;
      center.w += result.dynamics.slice;
      result.dynamics.factors.push_back({center, exponent});
    }
  }
  result.validate();
  return calibrated(device, result);
}

}  // namespace qjulia

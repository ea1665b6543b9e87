#pragma once
/// A distance modulus in a map file (docs/map-format.md).

#include <nlohmann/json_fwd.hpp>

#include "map/json_object.hpp"
#include "qjulia/modulus.hpp"

namespace qjulia::map {

nlohmann::json distance_json(const DistanceModulus& distance);

/// @throws InputError naming the key that is wrong.
DistanceModulus read_distance(const Object& object);

}  // namespace qjulia::map

#pragma once
/// Paint as an object of a map file (docs/map-format.md).

#include <nlohmann/json_fwd.hpp>

#include "map/json_object.hpp"
#include "qjulia/paint.hpp"

namespace qjulia::map {

nlohmann::json paint_json(const Paint& paint);
/// @throws InputError naming the key.
Paint read_paint(const Object& object);

}  // namespace qjulia::map

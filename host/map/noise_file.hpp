#pragma once
/// The noise versor of a map file.

#include <nlohmann/json_fwd.hpp>

#include "map/json_object.hpp"
#include "qjulia/versor.hpp"

namespace qjulia::map {

nlohmann::json noise_json(const NoiseVersor& noise);
/// @throws InputError naming the key that is wrong.
NoiseVersor read_noise(const Object& object);

}  // namespace qjulia::map

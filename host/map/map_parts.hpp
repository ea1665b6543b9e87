#pragma once
/// The parts of a map as a map file holds them (docs/map-format.md).

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "map/json_object.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia::map {

nlohmann::json json_of(const Quaternion& q);
nlohmann::json json_of(const Eigen::Vector3d& v);
nlohmann::json json_of(const DistanceModulus& distance);
nlohmann::json json_of(const NoiseVersor& noise);
nlohmann::json json_of(const Paint& paint);
nlohmann::json json_of(const std::vector<Portal>& portals);

/// Each reads what `map` has under `key`. @throws InputError naming the key that is wrong.
void read(const Object& map, const char* key, Quaternion& q);
void read(const Object& map, const char* key, DistanceModulus& distance);
void read(const Object& map, const char* key, NoiseVersor& noise);
void read(const Object& map, const char* key, Paint& paint);
void read(const Object& map, const char* key, std::vector<Portal>& portals);

}  // namespace qjulia::map

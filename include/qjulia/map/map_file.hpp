#pragma once
/// The map file: JSON, extension .qjulia.json; docs/reference/map-format.md.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <stop_token>
#include <string>

#include "qjulia/map/map.hpp"

namespace qjulia {

/// A map file; or a page (.html) that holds one: as JSON, in the script element whose id is
/// qjulia-map; or a picture (.png) or scene (.glb) that holds one: as `packed_map` makes it.
/// @throws InputError naming the file and the key that is missing, of the wrong type or not finite.
/// @param stop ends waiting for a pipe: Interrupted.
Map read_map(const std::filesystem::path& path, std::stop_token stop = {});

/// Whether the file is a picture (.png) or scene (.glb) that holds a map.
/// @throws InputError where its name is that of one, and it is none or cut off.
bool holds_map(const std::filesystem::path& path, const std::stop_token& stop = {});

/// The map in few bytes, for `png_bytes`, `write_png` and `MeshFileOptions`: a map file's text,
/// deflated, some 60 bytes a factor. @throws InputError naming what is wrong with the map.
std::string packed_map(const Map& map);

/// Written under a temporary name and renamed, so that `path` never holds half a map.
/// @throws OutputError
void write_map(const Map& map, const std::filesystem::path& path);

/// @throws InputError naming what is wrong with the map.
nlohmann::json to_json(const Map& map);
/// @param source what messages call the text, such as the file's name.
Map map_from_json(const nlohmann::json& json, const std::string& source);

}  // namespace qjulia

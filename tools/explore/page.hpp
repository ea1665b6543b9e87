#pragma once
/// The page on which a map is played with.

#include <string>

#include "qjulia/map.hpp"

namespace qjulia::explore {

/// One page that needs nothing else: the map stands in it, and the viewer's browser draws its set
/// by WebGL 2. Its policy lets it load nothing and run no script but its own.
/// @param file the name of the map's file, for the command lines that the page gives.
std::string shared_page(const Map& map, const std::string& file);

/// The page that `Server` gives out, which asks the server for its pictures.
std::string served_page(const Map& map, const std::string& file);

/// The page that shows a fit while it runs.
/// @param file the name of the file that its map is to have.
std::string fitting_page(const std::string& file);

}  // namespace qjulia::explore

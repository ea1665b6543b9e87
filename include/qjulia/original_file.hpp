#pragma once
/// Maps of the original program (Kim 2015, QUIJIBO): its .o3d files. Format: docs/map-format.md.

#include <filesystem>
#include <istream>
#include <string>

#include "qjulia/rational_map.hpp"

namespace qjulia {

/// The map T·B⁻¹ of an .o3d file: top factors in order, then bottom factors in reverse order with
/// negative exponents; S = ln expScaling. Its coordinates are the file's own.
/// @throws InputError naming the file and what is wrong: truncated, a count that the file is too
///   short for, numbers that are no map's. Nothing is allocated for a count before that.
RationalMap read_original(const std::filesystem::path& path);

/// The same from a stream that can be sought in. @param source what messages call it.
RationalMap original_from_stream(std::istream& stream, const std::string& source);

}  // namespace qjulia

#pragma once
/// Files of the papers' programs: maps (.o3d, Kim 2015), polynomials and distance fields (.poly4d,
/// .f3d, Schor and Kim 2023), portals (text, Schor and Kim 2024). Formats:
/// docs/reference/map-format.md.

#include <Eigen/Core>
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::original {

/// The map of an .o3d or .poly4d file. The latter is a polynomial alone, Π (q − root)^(scalar ·
/// power) with S = 0; an .o3d file's is T·B⁻¹: top factors in order, then bottom factors in reverse
/// order with negative exponents; S = ln expScaling. Its coordinates are the file's own.
/// @throws InputError naming the file and what is wrong: truncated, a count that the file is too
///   short for, numbers that are no map's. Nothing is allocated for a count before that.
Map read_original(const std::filesystem::path& path);

/// The same, from a file's bytes. @param source what messages call it.
Map original_from_bytes(std::string_view bytes, const std::string& source);
Map polynomial_from_bytes(std::string_view bytes, const std::string& source);

/// Distances at the centres of the cells of a regular grid, negative inside.
struct SampledDistance {
  std::array<int, 3> samples{};
  Eigen::Vector3d center = Eigen::Vector3d::Zero();   ///< the grid's box has this centre
  Eigen::Vector3d lengths = Eigen::Vector3d::Zero();  ///< and sides of these lengths
  std::vector<double> values;                         ///< x fastest
};

/// The field of an .f3d file. @throws InputError as `read_original`.
SampledDistance read_sampled_distance(const std::filesystem::path& path);
SampledDistance sampled_distance_from_bytes(std::string_view bytes, const std::string& source);

/// The zero level of a distance field, closed and 2-manifold, in the field's own coordinates.
/// @throws InputError when it has no inside, or reaches the field's faces.
TriangleMesh mesh_of(const SampledDistance& distance);

/// The portals of a text file: "Portals radius:" and "Portals scale:" for all; for each "Portal
/// location: X Y Z", then "Portal rotation: RADIANS X Y Z" where it is turned. Places are those of
/// shapes in [−½, ½]³. They lead to the origin of iteration and take what is outside.
/// @param to_map from the shape to the map that gets them. @throws InputError naming the line.
std::vector<Portal> read_portal_text(const std::filesystem::path& path, const ShapeToMap& to_map);
std::vector<Portal> portals_from_text(std::string_view text, const std::string& source,
                                      const ShapeToMap& to_map);

}  // namespace qjulia::original

#pragma once
/// The header of a PLY file (Turk 1994).

#include <cstdint>
#include <string>
#include <vector>

#include "shape/mesh_text.hpp"

namespace qjulia {

enum class PlyFormat { text, little_endian, big_endian };

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t size_of(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::float32;  ///< of the value, or of a list's values
  bool is_list = false;
  PlyType count_type = PlyType::uint8;  ///< of a list's length
};

struct PlyElement {
  std::string name;
  std::size_t count = 0;  ///< promised, not checked
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyFormat format = PlyFormat::text;
  std::vector<PlyElement> elements;
  std::size_t body = 0;  ///< offset of the first byte after the header
};

/// @throws InputError when it is no PLY header.
PlyHeader read_ply_header(const RawMeshFile& file);

}  // namespace qjulia

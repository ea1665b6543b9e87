#include "shape/ply_header.hpp"

#include <fmt/format.h>

#include <map>

namespace qjulia {
namespace {

PlyType type_named(const RawMeshFile& file, std::string_view name) {
  static const std::map<std::string_view, PlyType> types = {
      {"char", PlyType::int8},      {"int8", PlyType::int8},       {"uchar", PlyType::uint8},
      {"uint8", PlyType::uint8},    {"short", PlyType::int16},     {"int16", PlyType::int16},
      {"ushort", PlyType::uint16},  {"uint16", PlyType::uint16},   {"int", PlyType::int32},
      {"int32", PlyType::int32},    {"uint", PlyType::uint32},     {"uint32", PlyType::uint32},
      {"float", PlyType::float32},  {"float32", PlyType::float32}, {"double", PlyType::float64},
      {"float64", PlyType::float64}};
  const auto found = types.find(name);
  if (found == types.end()) {
    file.refuse(fmt::format("its PLY header has an unknown type '{}'; export it again", name));
  }
  return found->second;
}

PlyFormat format_named(const RawMeshFile& file, std::string_view name) {
  if (name == "ascii") return PlyFormat::text;
  if (name == "binary_little_endian") return PlyFormat::little_endian;
  if (name == "binary_big_endian") return PlyFormat::big_endian;
  file.refuse("its PLY header names no known format; export it again");
}

PlyProperty property_of(const RawMeshFile& file, std::string_view rest) {
  PlyProperty property;
  std::string_view type = take_word(rest);
  property.is_list = type == "list";
  if (property.is_list) {
    property.count_type = type_named(file, take_word(rest));
    type = take_word(rest);
  }
  property.type = type_named(file, type);
  property.name = take_word(rest);
  return property;
}

}  // namespace

std::size_t size_of(PlyType type) {
  switch (type) {
    case PlyType::int8:
    case PlyType::uint8:
      return 1;
    case PlyType::int16:
    case PlyType::uint16:
      return 2;
    case PlyType::int32:
    case PlyType::uint32:
    case PlyType::float32:
      return 4;
    case PlyType::float64:
      return 8;
  }
  return 0;
}

PlyHeader read_ply_header(const RawMeshFile& file) {
  Lines lines(file.bytes, '\0');
  if (lines.next() != "ply") file.refuse("it does not begin with 'ply'; is it a .ply file?");
  PlyHeader header;
  bool has_format = false;
  while (const auto line = lines.next()) {
    std::string_view rest = *line;
    const std::string_view key = take_word(rest);
    if (key == "format") {
      header.format = format_named(file, take_word(rest));
      has_format = true;
    } else if (key == "element") {
      PlyElement element;
      element.name = take_word(rest);
      const auto count = to_integer(take_word(rest));
      if (!count || *count < 0) {
        file.refuse_line(lines.number(), "an element needs a count; export it again");
      }
      element.count = static_cast<std::size_t>(*count);
      header.elements.push_back(std::move(element));
    } else if (key == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(property_of(file, rest));
    } else if (key == "end_header") {
      if (!has_format) break;
      header.body = file.bytes.size() - lines.rest().size();
      return header;
    } else if (key != "comment" && key != "obj_info") {
      file.refuse_line(lines.number(), "it does not belong in a PLY header; export it again");
    }
  }
  file.refuse("its PLY header has no format or no end; the file may be cut off, export it again");
}

}  // namespace qjulia

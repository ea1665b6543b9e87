#include "qjulia/mesh/point_cache.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "base/file_types.hpp"
#include "base/npy.hpp"
#include "base/text.hpp"
#include "mesh_io/mesh_file.hpp"
#include "mesh_io/zip_archive.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {

using namespace shape;
namespace {

constexpr std::string_view kCacheArrays =
    "a point cache has the arrays 'vertices' and 'faces', as numpy.savez writes them";

/// Bytes of an array's entry, of which the header is a part.
struct ByteRange {
  std::uint64_t first = 0, last = 0;
};

/// An array, of whose values a part is read.
struct PartOfArray {
  base::NpyHeader header;
  std::string bytes;
};

/// Goes through the array once. @param wanted says which of its values to keep, once its header is
/// known; `size` is that of the whole entry.
PartOfArray read_array(
    const MeshFile& file, const char* name,
    const std::function<ByteRange(const base::NpyHeader& header, std::uint64_t size)>& wanted) {
  ZipArchive archive(file);
  const ZipArchive::Entry* const entry = archive.find(fmt::format("{}.npy", name));
  if (entry == nullptr) file.refuse(fmt::format("it has no array '{}'; {}", name, kCacheArrays));
  PartOfArray part;
  ByteRange range;
  std::string head;
  bool is_known = false;
  std::uint64_t at = 0;
  const auto keep = [&](std::string_view some) {
    const std::uint64_t end = at + some.size();
    const std::uint64_t first = std::clamp(range.first, at, end);
    const std::uint64_t last = std::clamp(range.last, first, end);
    part.bytes.append(some.substr(first - at, last - first));
    at = end;
  };
  archive.unpack(*entry, [&](std::string_view some) {
    if (!is_known) {
      const std::size_t count = std::min(some.size(), base::kMostNpyHeader - head.size());
      head.append(some.substr(0, count));
      some.remove_prefix(count);
      const auto header = base::read_npy_header(head);
      if (!header) return;
      is_known = true;
      part.header = *header;
      range = wanted(*header, entry->size);
      keep(head);
    }
    keep(some);
  });
  if (!is_known) file.refuse(fmt::format("'{}' is no array of NumPy's; {}", name, kCacheArrays));
  return part;
}

/// @param bytes of one value
void expect_size(const MeshFile& file, const char* name, const base::NpyHeader& header,
                 std::uint64_t bytes, std::uint64_t size) {
  if (header.is_fortran) {
    file.refuse(
        fmt::format("'{}' is in Fortran's order; save numpy.ascontiguousarray of it", name));
  }
  if (std::ranges::count(header.shape, std::size_t{0}) > 0) {
    file.refuse(
        fmt::format("'{}' is empty, of the shape ({})", name, fmt::join(header.shape, ", ")));
  }
  std::uint64_t room = (size - header.bytes) / bytes;
  for (const std::size_t length : header.shape) room /= length;
  std::uint64_t values = bytes;
  if (room > 0) {
    for (const std::size_t length : header.shape) values *= length;
  }
  if (room == 0 || values != size - header.bytes) {
    file.refuse(fmt::format("'{}' has the shape ({}) and {} numbers; save it again", name,
                            fmt::join(header.shape, ", "), (size - header.bytes) / bytes));
  }
}

/// Vertices or triangles.
void expect_count(const MeshFile& file, const char* name, std::uint64_t count) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (count > kMost) file.refuse(fmt::format("'{}' has more than {} rows", name, kMost));
}

/// The shape of `vertices` and the bytes of a number of it.
struct VertexLayout {
  std::uint64_t frames = 0, vertices = 0, number = 0;
};

VertexLayout vertex_layout(const MeshFile& file, const base::NpyHeader& header,
                           std::uint64_t size) {
  if (header.type != "<f4" && header.type != "<f8") {
    file.refuse(
        fmt::format("'vertices' are numbers of the type '{}'; save them as float32 or "
                    "float64, little-endian",
                    header.type));
  }
  if (header.shape.size() != 3 || header.shape[2] != 3) {
    file.refuse(fmt::format("'vertices' has the shape ({}); give frames × vertices × 3",
                            fmt::join(header.shape, ", ")));
  }
  const VertexLayout layout{header.shape[0], header.shape[1], header.type == "<f4" ? 4U : 8U};
  expect_size(file, "vertices", header, layout.number, size);
  expect_count(file, "vertices", layout.vertices);
  return layout;
}

template <class Number>
Number cached_number(std::string_view bytes, std::size_t index) {
  Number number{};
  std::memcpy(&number, bytes.data() + index * sizeof number, sizeof number);
  return number;
}

std::vector<Eigen::Vector3d> cached_vertices(const MeshFile& file, std::size_t frame) {
  VertexLayout layout;
  const PartOfArray part =
      read_array(file, "vertices", [&](const base::NpyHeader& header, std::uint64_t size) {
        layout = vertex_layout(file, header, size);
        if (frame >= layout.frames) {
          file.refuse(fmt::format("it has {} frames, and none of number {}, from 0 on",
                                  layout.frames, frame));
        }
        const std::uint64_t length = layout.vertices * 3 * layout.number;
        const std::uint64_t first = header.bytes + frame * length;
        return ByteRange{first, first + length};
      });
  const auto number = [&](std::size_t index) -> double {
    return layout.number == 4 ? cached_number<float>(part.bytes, index)
                              : cached_number<double>(part.bytes, index);
  };
  std::vector<Eigen::Vector3d> vertices(layout.vertices);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    if (v % kPolled == 0) file.poll();
    vertices[v] = {number(3 * v), number(3 * v + 1), number(3 * v + 2)};
    if (!vertices[v].allFinite()) {
      file.refuse(
          fmt::format("vertex {} in frame {} of 'vertices', both from 0 on, is not finite; repair "
                      "it or leave the frame out",
                      v, frame));
    }
  }
  return vertices;
}

/// A whole number of an array; those beyond 2⁶³ are negative.
using IndexReader = std::int64_t (*)(std::string_view bytes, std::size_t index);

template <class Number>
std::int64_t cached_index(std::string_view bytes, std::size_t index) {
  return static_cast<std::int64_t>(cached_number<Number>(bytes, index));
}

struct IndexType {
  std::string_view name;
  std::uint64_t bytes;
  IndexReader read;
};

constexpr IndexType kIndexTypes[] = {
    {"<i4", 4, cached_index<std::int32_t>},  {"<i8", 8, cached_index<std::int64_t>},
    {"<u4", 4, cached_index<std::uint32_t>}, {"<u8", 8, cached_index<std::uint64_t>},
    {"<i2", 2, cached_index<std::int16_t>},  {"<u2", 2, cached_index<std::uint16_t>},
    {"|i1", 1, cached_index<std::int8_t>},   {"|u1", 1, cached_index<std::uint8_t>}};

std::vector<Triangle> cached_faces(const MeshFile& file, std::size_t vertices) {
  const IndexType* type = nullptr;
  const PartOfArray part =
      read_array(file, "faces", [&](const base::NpyHeader& header, std::uint64_t size) {
        type = std::ranges::find(kIndexTypes, header.type, &IndexType::name);
        if (type == std::end(kIndexTypes)) {
          file.refuse(
              fmt::format("'faces' are numbers of the type '{}'; save them as whole "
                          "numbers, such as int32, little-endian",
                          header.type));
        }
        if (header.shape.size() != 2 || header.shape[1] != 3) {
          file.refuse(fmt::format("'faces' has the shape ({}); give triangles × 3",
                                  fmt::join(header.shape, ", ")));
        }
        expect_size(file, "faces", header, type->bytes, size);
        expect_count(file, "faces", header.shape[0]);
        return ByteRange{header.bytes, size};
      });
  std::vector<Triangle> faces(part.header.shape[0]);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (f % kPolled == 0) file.poll();
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::int64_t index = type->read(part.bytes, 3 * f + corner);
      if (index < 0 || static_cast<std::uint64_t>(index) >= vertices) {
        file.refuse(fmt::format("'faces' has the index {} in row {}, and there are {} vertices",
                                index, f, vertices));
      }
      faces[f][corner] = static_cast<std::uint32_t>(index);
    }
  }
  return faces;
}

}  // namespace

bool is_point_cache(const std::filesystem::path& path) {
  return base::extension_of(path) == ".npz";
}

std::size_t count_frames(const std::filesystem::path& path, std::stop_token stop) {
  const MeshFile file(path, std::move(stop));
  VertexLayout layout;
  read_array(file, "vertices", [&](const base::NpyHeader& header, std::uint64_t size) {
    layout = vertex_layout(file, header, size);
    return ByteRange{};
  });
  cached_faces(file, layout.vertices);
  return layout.frames;
}

TriangleMesh read_frame(const std::filesystem::path& path, std::size_t frame,
                        std::stop_token stop) {
  const MeshFile file(path, std::move(stop));
  TriangleMesh mesh;
  mesh.vertices = cached_vertices(file, frame);
  mesh.triangles = cached_faces(file, mesh.vertices.size());
  return mesh;
}

InspectedMesh read_and_inspect_frame(const std::filesystem::path& path, std::size_t frame,
                                     std::stop_token stop) {
  const TriangleMesh mesh = read_frame(path, frame, stop);
  try {
    return as_if_read(mesh, stop);
  } catch (const InputError& error) {
    throw InputError(fmt::format("cannot read mesh '{}': frame {}, from 0 on: {}",
                                 base::to_utf8(path.string()), frame, error.what()));
  }
}

}  // namespace qjulia

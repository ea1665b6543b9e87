#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <iostream>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/surface_file.hpp"

namespace qjulia {
namespace {

static_assert(std::endian::native == std::endian::little, "the header says so");

/// Comments of short lines: readers have limits.
std::string comments(const std::string& note) {
  constexpr std::size_t kLine = 200;
  std::string lines;
  for (std::size_t at = 0; at < note.size(); at += kLine) {
    lines += fmt::format("comment {}\n", note.substr(at, kLine));
  }
  return lines;
}

std::string header(std::size_t vertices, std::size_t triangles, const std::string& note) {
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment made by qjulia\n{}"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      comments(note), vertices, triangles);
}

/// Position and normal, as the file holds them.
using VertexRecord = std::array<float, 6>;

/// A triangle as the file holds it: a byte with the number of corners, then the corners.
struct FaceRecord {
  std::array<char, 1 + sizeof(Triangle)> bytes;

  explicit FaceRecord(const Triangle& corners = {}) : bytes{3} {
    std::memcpy(bytes.data() + 1, corners.data(), sizeof corners);
  }
  Triangle corners() const {
    Triangle corners;
    std::memcpy(corners.data(), bytes.data() + 1, sizeof corners);
    return corners;
  }
};
static_assert(sizeof(FaceRecord) == 13);

template <class Record>
void write_records(std::ostream& stream, std::span<const Record> records) {
  stream.write(reinterpret_cast<const char*>(records.data()),
               static_cast<std::streamsize>(records.size_bytes()));
}

/// Calls `use` with `count` records from the stream's beginning, some thousands at a time; stops
/// when reading fails.
template <class Record, class Use>
void for_records(std::istream& stream, std::size_t count, const Use& use) {
  constexpr std::size_t kAtOnce = std::size_t{1} << 15;
  std::vector<Record> records;
  stream.seekg(0);
  for (; count > 0 && stream; count -= records.size()) {
    records.resize(std::min(count, kAtOnce));
    stream.read(reinterpret_cast<char*>(records.data()),
                static_cast<std::streamsize>(records.size() * sizeof(Record)));
    if (stream) use(std::span(records));
  }
}

}  // namespace

struct PlyFile::Impl {
  std::filesystem::path path;
  std::string note;
  base::OutputFile file;
  std::optional<base::ScratchFile> vertices, faces;
  std::size_t vertex_count = 0, face_count = 0;
  std::uint32_t last_vertex = 0;  ///< the largest index of a triangle

  Impl(const std::filesystem::path& path_, const std::string& note_)
      : path(path_), note(note_), file(path_), vertices(path_), faces(path_) {}

  /// @throws InputError if the file has been committed: then nothing is left to write to.
  void expect_open() const {
    if (faces) return;
    throw InputError(
        fmt::format("mesh '{}' has been committed; write another file", path.string()));
  }

  void expect_complete() const {
    expect_open();
    if (face_count == 0 || last_vertex < vertex_count) return;
    throw InputError(fmt::format("mesh '{}' has a triangle with vertex {} but only {} vertices",
                                 path.string(), last_vertex, vertex_count));
  }

  void check(const std::ios& stream) const {
    if (stream) return;
    throw OutputError(fmt::format("cannot write mesh '{}'; check the space left", path.string()));
  }

  /// Copies records to the file, and gives the space of `from` back.
  /// @param keep moves those to keep to the front of some, and says how many they are.
  template <class Record, class Keep>
  void append(std::optional<base::ScratchFile>& from, std::size_t count, const Keep& keep) {
    for_records<Record>(from->stream(), count, [&](std::span<Record> records) {
      write_records<Record>(file.stream(), records.first(keep(records)));
    });
    check(from->stream());
    check(file.stream());
    from.reset();
  }
};

PlyFile::PlyFile(const std::filesystem::path& path, const std::string& note)
    : impl_(std::make_unique<Impl>(path, note)) {}

PlyFile::~PlyFile() = default;

void PlyFile::vertices(std::span<const Eigen::Vector3d> positions,
                       std::span<const Eigen::Vector3d> normals) {
  impl_->expect_open();
  if (normals.size() != positions.size()) {
    throw InputError(fmt::format("{} vertices came with {} normals: give one for each vertex",
                                 positions.size(), normals.size()));
  }
  std::vector<VertexRecord> records(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    Eigen::Map<Eigen::Vector3f>(records[i].data()) = positions[i].cast<float>();
    Eigen::Map<Eigen::Vector3f>(records[i].data() + 3) = normals[i].cast<float>();
  }
  impl_->vertex_count += records.size();
  write_records<VertexRecord>(impl_->vertices->stream(), records);
  impl_->check(impl_->vertices->stream());
}

void PlyFile::triangles(std::span<const Triangle> triangles) {
  impl_->expect_open();
  for (const Triangle& triangle : triangles) {
    impl_->last_vertex = std::max(impl_->last_vertex, std::ranges::max(triangle));
  }
  const std::vector<FaceRecord> records(triangles.begin(), triangles.end());
  impl_->face_count += records.size();
  write_records<FaceRecord>(impl_->faces->stream(), records);
  impl_->check(impl_->faces->stream());
}

void PlyFile::commit() {
  impl_->expect_complete();
  const auto all = [](auto records) { return records.size(); };
  impl_->file.stream() << header(impl_->vertex_count, impl_->face_count, impl_->note);
  impl_->append<VertexRecord>(impl_->vertices, impl_->vertex_count, all);
  impl_->append<FaceRecord>(impl_->faces, impl_->face_count, all);
  impl_->file.commit();
}

void PlyFile::commit(const std::function<bool(std::uint32_t)>& keeps) {
  impl_->expect_complete();
  constexpr std::uint32_t kDropped = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(impl_->vertex_count, kDropped);
  std::uint32_t kept = 0;
  for (std::uint32_t v = 0; v < number.size(); ++v) {
    if (keeps(v)) number[v] = kept++;
  }
  const auto is_dropped = [&](const FaceRecord& face) {
    return number[face.corners()[0]] == kDropped;
  };
  std::size_t kept_faces = 0;
  for_records<FaceRecord>(impl_->faces->stream(), impl_->face_count, [&](auto faces) {
    kept_faces += faces.size() - static_cast<std::size_t>(std::ranges::count_if(faces, is_dropped));
  });
  impl_->check(impl_->faces->stream());
  impl_->file.stream() << header(kept, kept_faces, impl_->note);
  std::size_t v = 0;
  impl_->append<VertexRecord>(impl_->vertices, impl_->vertex_count,
                              [&](std::span<VertexRecord> vertices) {
                                std::size_t count = 0;
                                for (const VertexRecord& vertex : vertices) {
                                  if (number[v++] != kDropped) vertices[count++] = vertex;
                                }
                                return count;
                              });
  impl_->append<FaceRecord>(impl_->faces, impl_->face_count, [&](std::span<FaceRecord> faces) {
    std::size_t count = 0;
    for (const FaceRecord& face : faces) {
      if (is_dropped(face)) continue;
      const auto [a, b, c] = face.corners();
      faces[count++] = FaceRecord({number[a], number[b], number[c]});
    }
    return count;
  });
  impl_->file.commit();
}

}  // namespace qjulia

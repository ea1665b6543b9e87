#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <iostream>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/output_file.hpp"
#include "mesh_io/ply_format.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/surface/surface_file.hpp"

namespace qjulia {
namespace {

using shape::PlyFace;
using shape::PlyVertex;

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
  Eigen::Matrix3d turn;
  base::OutputFile file;
  std::optional<base::ScratchFile> vertices, faces;
  std::size_t vertex_count = 0, face_count = 0;
  std::uint32_t last_vertex = 0;  ///< the largest index of a triangle

  Impl(const std::filesystem::path& path_, const std::string& note_, const Eigen::Matrix3d& turn_)
      : path(path_), note(note_), turn(turn_), file(path_), vertices(path_), faces(path_) {}

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

PlyFile::PlyFile(const std::filesystem::path& path, const std::string& note,
                 const Eigen::Matrix3d& turn)
    : impl_(std::make_unique<Impl>(path, note, turn)) {}

PlyFile::~PlyFile() = default;

void PlyFile::vertices(std::span<const Eigen::Vector3d> positions,
                       std::span<const Eigen::Vector3d> normals) {
  impl_->expect_open();
  if (normals.size() != positions.size()) {
    throw InputError(fmt::format("{} vertices came with {} normals: give one for each vertex",
                                 positions.size(), normals.size()));
  }
  std::vector<PlyVertex> records(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    Eigen::Map<Eigen::Vector3f>(records[i].data()) = (impl_->turn * positions[i]).cast<float>();
    Eigen::Map<Eigen::Vector3f>(records[i].data() + 3) = (impl_->turn * normals[i]).cast<float>();
  }
  impl_->vertex_count += records.size();
  write_records<PlyVertex>(impl_->vertices->stream(), records);
  impl_->check(impl_->vertices->stream());
}

void PlyFile::triangles(std::span<const Triangle> triangles) {
  impl_->expect_open();
  for (const Triangle& triangle : triangles) {
    impl_->last_vertex = std::max(impl_->last_vertex, std::ranges::max(triangle));
  }
  const std::vector<PlyFace> records(triangles.begin(), triangles.end());
  impl_->face_count += records.size();
  write_records<PlyFace>(impl_->faces->stream(), records);
  impl_->check(impl_->faces->stream());
}

void PlyFile::commit() {
  impl_->expect_complete();
  const auto all = [](auto records) { return records.size(); };
  impl_->file.stream() << shape::ply_header(impl_->vertex_count, impl_->face_count,
                                            {.normals = true}, impl_->note);
  impl_->append<PlyVertex>(impl_->vertices, impl_->vertex_count, all);
  impl_->append<PlyFace>(impl_->faces, impl_->face_count, all);
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
  const auto is_dropped = [&](const PlyFace& face) {
    return number[face.corners()[0]] == kDropped;
  };
  std::size_t kept_faces = 0;
  for_records<PlyFace>(impl_->faces->stream(), impl_->face_count, [&](auto faces) {
    kept_faces += faces.size() - static_cast<std::size_t>(std::ranges::count_if(faces, is_dropped));
  });
  impl_->check(impl_->faces->stream());
  impl_->file.stream() << shape::ply_header(kept, kept_faces, {.normals = true}, impl_->note);
  std::size_t v = 0;
  impl_->append<PlyVertex>(impl_->vertices, impl_->vertex_count,
                           [&](std::span<PlyVertex> vertices) {
                             std::size_t count = 0;
                             for (const PlyVertex& vertex : vertices) {
                               if (number[v++] != kDropped) vertices[count++] = vertex;
                             }
                             return count;
                           });
  impl_->append<PlyFace>(impl_->faces, impl_->face_count, [&](std::span<PlyFace> faces) {
    std::size_t count = 0;
    for (const PlyFace& face : faces) {
      if (is_dropped(face)) continue;
      const auto [a, b, c] = face.corners();
      faces[count++] = PlyFace({number[a], number[b], number[c]});
    }
    return count;
  });
  impl_->file.commit();
}

}  // namespace qjulia

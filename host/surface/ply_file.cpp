#include <fmt/format.h>

#include <array>
#include <bit>
#include <iostream>
#include <string>

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

/// Always as long, whatever the counts: a comment is as much shorter as they are longer.
std::string header(std::size_t vertices, std::size_t triangles, const std::string& note) {
  constexpr std::size_t kDigits = 40;
  const std::string counts = fmt::format("{}{}", vertices, triangles);
  return fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment made by qjulia{}\n{}"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property float nx\nproperty float ny\nproperty float nz\n"
      "element face {}\nproperty list uchar uint vertex_indices\nend_header\n",
      std::string(kDigits - counts.size(), ' '), comments(note), vertices, triangles);
}

}  // namespace

struct PlyFile::Impl {
  std::filesystem::path path;
  std::string note;
  base::OutputFile file;    ///< header and vertices
  base::ScratchFile faces;  ///< come last in the file
  std::size_t vertices = 0;
  std::size_t triangles = 0;
  std::string bytes;

  Impl(const std::filesystem::path& path_, const std::string& note_)
      : path(path_), note(note_), file(path_), faces(path_) {}

  template <class T>
  void append(const T& value) {
    bytes.append(std::bit_cast<std::array<char, sizeof(T)>>(value).data(), sizeof(T));
  }
  void flush_to(std::ostream& stream) {
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    bytes.clear();
    if (!stream) fail();
  }
  [[noreturn]] void fail() const {
    throw OutputError(fmt::format("cannot write mesh '{}'; check the space left", path.string()));
  }
};

PlyFile::PlyFile(const std::filesystem::path& path, const std::string& note)
    : impl_(std::make_unique<Impl>(path, note)) {
  impl_->file.stream() << header(0, 0, note);
}

PlyFile::~PlyFile() = default;

void PlyFile::vertices(std::span<const Eigen::Vector3d> positions,
                       std::span<const Eigen::Vector3d> normals) {
  for (std::size_t i = 0; i < positions.size(); ++i) {
    for (const Eigen::Vector3d* v : {&positions[i], &normals[i]}) {
      for (const double c : *v) impl_->append(static_cast<float>(c));
    }
  }
  impl_->vertices += positions.size();
  impl_->flush_to(impl_->file.stream());
}

void PlyFile::triangles(std::span<const Triangle> triangles) {
  for (const Triangle& t : triangles) {
    impl_->append(std::uint8_t{3});
    for (const auto v : t) impl_->append(v);
  }
  impl_->triangles += triangles.size();
  impl_->flush_to(impl_->faces.stream());
}

void PlyFile::commit() {
  std::ostream& out = impl_->file.stream();
  std::iostream& faces = impl_->faces.stream();
  if (!faces.seekg(0)) impl_->fail();
  if (impl_->triangles > 0 && !(out << faces.rdbuf())) impl_->fail();
  out.seekp(0);
  out << header(impl_->vertices, impl_->triangles, impl_->note);
  impl_->file.commit();
}

}  // namespace qjulia

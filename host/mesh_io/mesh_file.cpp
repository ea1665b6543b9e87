#include "mesh_io/mesh_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "base/file_types.hpp"
#include "base/input_file.hpp"
#include "base/text.hpp"
#include "mesh_io/formats.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::shape {
namespace {

constexpr std::size_t kHead = std::size_t{1} << 16;  ///< enough to recognise a file's type

bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

template <class T>
std::from_chars_result parse(std::string_view word, T& value) {
  if (word.starts_with('+')) word.remove_prefix(1);
  auto result = std::from_chars(word.data(), word.data() + word.size(), value);
  if (result.ptr != word.data() + word.size()) result.ec = std::errc::invalid_argument;
  return result;
}

struct DetectedType {
  std::string_view name;
  std::string_view extension;  ///< a mesh file's; empty for anything else
  bool is_sure = true;         ///< else it may also be something without a mesh
};

/// The type of a file by its beginning, such as "a PNG picture". All is empty when nothing is
/// recognised.
DetectedType detected_type(std::string_view head) {
  using namespace std::string_view_literals;
  struct Mark {
    std::string_view bytes;
    DetectedType type;
  };
  static constexpr Mark kMarks[] = {
      {"\x89PNG"sv, {"a PNG picture", ""}},
      {"\xFF\xD8\xFF"sv, {"a JPEG picture", ""}},
      {"GIF8"sv, {"a GIF picture", ""}},
      {"%PDF"sv, {"a PDF document", ""}},
      {"\x1F\x8B"sv, {"compressed by gzip; unpack it with gunzip first", ""}},
      {"BZh"sv, {"compressed by bzip2; unpack it with bunzip2 first", ""}},
      {"\3757zXZ"sv, {"compressed by xz; unpack it with unxz first", ""}},
      {"\x28\xB5\x2F\xFD"sv, {"compressed by zstd; unpack it with unzstd first", ""}},
      {"7z\xBC\xAF"sv, {"a 7z archive; if it holds a mesh, unpack it first", ""}},
      {"Rar!"sv, {"a RAR archive; if it holds a mesh, unpack it first", ""}},
      {"BLENDER"sv, {"a Blender file; export its mesh from Blender", ""}},
      {"Kaydara FBX"sv, {"an FBX scene", ""}},
      {"\177ELF"sv, {"a program", ""}},
      {"#VRML"sv, {"a VRML scene", ""}},
      {"version https://git-lfs"sv, {"a Git LFS pointer; fetch the file with 'git lfs pull'", ""}},
      {"\0\0\0\0\0\0\0\0"sv, {"empty of all but zero bytes; get it again", ""}},
  };
  head = base::without_byte_order_mark(head);
  for (const Mark& mark : kMarks) {
    if (head.starts_with(mark.bytes)) return mark.type;
  }
  std::string_view rest = head.substr(0, 4096);
  const std::string_view word = take_word(rest);
  if (is_word(word, "<!doctype") || is_word(word, "<html>") || is_word(word, "<html")) {
    return {"an HTML page, as when a download fails; download it again", ""};
  }
  if (word.starts_with('<')) return {"an XML document", ""};
  for (const MeshFormat& format : mesh_formats()) {
    if (format.looks_like != nullptr && format.looks_like(head)) {
      return {format.seems, format.extension, !format.may_be_another};
    }
  }
  return {};
}

/// What `to_number` does, in single precision, rounded once.
std::optional<float> to_coordinate(std::string_view word) {
  float value{};
  const std::errc error = parse(word, value).ec;
  if (error == std::errc::result_out_of_range) {
    const auto wide = to_number(word);  // too small for single precision, or too large
    return wide && std::abs(*wide) < 1 ? std::optional(static_cast<float>(*wide)) : std::nullopt;
  }
  return error == std::errc() && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

/// The name with its escapes, a % and two hexadecimal digits, replaced; none where one is wrong or
/// there is a zero byte.
std::optional<std::string> from_uri(std::string_view uri) {
  std::string name;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    char c = uri[i];
    if (c == '%') {
      constexpr int kHexadecimal = 16;
      unsigned char byte = 0;
      const std::string_view digits = uri.substr(i + 1, 2);
      const auto end = digits.data() + digits.size();
      if (digits.size() < 2 || std::from_chars(digits.data(), end, byte, kHexadecimal).ptr != end) {
        return std::nullopt;
      }
      c = static_cast<char>(byte);
      i += 2;
    }
    if (c == '\0') return std::nullopt;
    name += c;
  }
  return name;
}

}  // namespace

MeshFile::MeshFile(std::filesystem::path path, std::string extension, std::stop_token stop)
    : path_(std::move(path)), extension_(std::move(extension)), stop_(std::move(stop)) {
  base::InputFile file(path_, "mesh", kLargestFile, stop_);
  // Before much is read: what is no mesh may be large.
  file.read(bytes_, kHead);
  if (bytes_.empty()) refuse("the file is empty; export the mesh again");
  if (!mesh_format(extension_).begins_with_anything) {
    const DetectedType seeming = detected_type(bytes_);
    if (!seeming.name.empty() && seeming.extension != extension_) refuse_type("");
  }
  file.read_all(bytes_);
}

MeshFile::MeshFile(std::filesystem::path path, std::stop_token stop)
    : path_(std::move(path)), stop_(std::move(stop)) {
  base::InputFile(path_, "mesh", kLargestFile, stop_).read_all(bytes_);
}

std::string_view MeshFile::text() const {
  if (const auto encoding = base::wide_encoding(bytes_); !encoding.empty()) {
    refuse(fmt::format("it is {} text; save it as UTF-8 or ASCII", encoding));
  }
  return base::without_byte_order_mark(bytes_);
}

std::filesystem::path MeshFile::place_beside(const std::string& name) const {
  const auto refuse_name = [&](std::string_view why) {
    refuse(fmt::format("it names the file '{}', {}", base::to_utf8(name), why));
  };
  const auto decoded = from_uri(name);
  if (!decoded || decoded->empty()) refuse_name("which is not a file name; export it again");
  const std::filesystem::path beside(*decoded);
  // A colon ends the scheme of an address.
  const bool leaves = beside.is_absolute() || decoded->find_first_of(":\\") != std::string::npos ||
                      std::ranges::find(beside, "..") != beside.end();
  if (leaves) {
    refuse_name("and only files in its own folder are read; put the file there, or export as .glb");
  }
  return beside.lexically_normal();
}

std::string MeshFile::read_beside(const std::filesystem::path& place) const {
  std::string bytes;
  base::InputFile(path_.parent_path() / place, "mesh", kLargestFile, stop_).read_all(bytes);
  return bytes;
}

void MeshFile::refuse(std::string_view what) const {
  throw InputError(fmt::format("cannot read mesh '{}': {}", base::to_utf8(path_.string()), what));
}

void MeshFile::refuse_line(std::size_t line, std::string_view what) const {
  refuse(fmt::format("line {}: {}", line, base::to_utf8(what)));
}

void MeshFile::refuse_type(std::string_view what) const {
  const auto [name, extension, is_sure] = detected_type(std::string_view(bytes_).substr(0, kHead));
  if (name.empty() || extension == extension_) refuse(what);
  if (!extension.empty() && is_sure) {
    refuse(
        fmt::format("it seems to be {}; rename it so that its name ends in {}", name, extension));
  }
  refuse(fmt::format(
      "it seems to be {}{}", name,
      name.find(';') != std::string_view::npos
          ? ""
          : fmt::format("; export a mesh as {}",
                        base::extension_list(base::FileContent::mesh, base::FileUse::read))));
}

void MeshFile::poll() const { throw_if_stopped(stop_); }

void FaceList::add_vertex(const Eigen::Vector3f& x) {
  if (vertices.size() % kPolled == 0) file_.poll();
  constexpr std::size_t kMost = std::numeric_limits<std::int32_t>::max();
  if (vertices.size() == kMost) file_.refuse(fmt::format("it has more than {} vertices", kMost));
  vertices.push_back(x.cast<double>());
}

void FaceList::add_face(std::span<const std::uint32_t> corners) {
  if (faces_++ % kPolled == 0) file_.poll();
  const auto second = std::ranges::find_if(corners, [&](auto v) { return v != corners[0]; });
  if (std::all_of(second, corners.end(), [&](auto v) { return v == corners[0] || v == *second; })) {
    ++dropped_faces;
    return;
  }
  if (corners.size() > 3) polygons.push_back({triangles.size(), corners.size() - 2});
  for (std::size_t i = 2; i < corners.size(); ++i) {
    if (i % kPolled == 0) file_.poll();
    triangles.push_back({corners[0], corners[i - 1], corners[i]});
  }
}

Lines::Lines(std::string_view text, char comment)
    : rest_(text),
      comment_(comment),
      end_(text.find('\n') == std::string_view::npos ? '\r' : '\n') {}

std::optional<std::string_view> Lines::next() {
  while (!rest_.empty()) {
    const std::size_t end = rest_.find(end_);
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++number_;
    line = line.substr(0, line.find(comment_));
    while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    if (!line.empty()) return line;
  }
  return std::nullopt;
}

std::string_view take_word(std::string_view& text) {
  std::size_t start = 0;
  while (start < text.size() && is_blank(text[start])) ++start;
  std::size_t end = start;
  while (end < text.size() && !is_blank(text[end])) ++end;
  const std::string_view word = text.substr(start, end - start);
  text.remove_prefix(end);
  return word;
}

bool is_word(std::string_view word, std::string_view lower) {
  return std::ranges::equal(word, lower, [](char a, char b) {
    return a == b || (a >= 'A' && a <= 'Z' && a - 'A' + 'a' == b);
  });
}

std::optional<double> to_number(std::string_view word) {
  double value{};
  const std::errc error = parse(word, value).ec;
  if (error == std::errc::result_out_of_range) {
    const bool is_small =
        word.find("e-") != std::string_view::npos || word.find("E-") != std::string_view::npos;
    return is_small ? std::optional(0.0) : std::nullopt;
  }
  return error == std::errc() && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<long long> to_integer(std::string_view word) {
  long long value{};
  return parse(word, value).ec == std::errc() ? std::optional(value) : std::nullopt;
}

std::optional<Eigen::Vector3f> take_point(std::string_view& text) {
  Eigen::Vector3f point;
  for (float& coordinate : point) {
    const auto value = to_coordinate(take_word(text));
    if (!value) return std::nullopt;
    coordinate = *value;
  }
  return point;
}

}  // namespace qjulia::shape

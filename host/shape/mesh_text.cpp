#include "shape/mesh_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <limits>

#include "qjulia/error.hpp"

namespace qjulia {
namespace {

constexpr std::string_view kBlanks = " \t\r\n\v\f";

template <class T>
std::optional<T> whole_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  T value{};
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (error != std::errc() || stop != end) return std::nullopt;
  return value;
}

}  // namespace

void RawMeshFile::refuse(const std::string& what) const {
  throw InputError(fmt::format("cannot read mesh '{}': {}", path.string(), what));
}

void RawMeshFile::refuse_line(std::size_t line, const std::string& what) const {
  refuse(fmt::format("line {}: {}", line, what));
}

RawMeshFile load_mesh_file(const std::filesystem::path& path) {
  RawMeshFile file{path, {}};
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) file.refuse("there is no such file; check the name");
  if (std::filesystem::is_directory(status)) file.refuse("it is a folder; name a mesh file in it");
  std::ifstream in(path, std::ios::binary);
  if (!in) file.refuse("it cannot be opened; check its permissions");
  file.bytes.assign(std::istreambuf_iterator<char>(in), {});
  if (in.bad()) file.refuse("reading failed; check the disk");
  if (file.bytes.empty()) file.refuse("the file is empty; export the mesh again");
  return file;
}

std::optional<std::string_view> Lines::next() {
  while (!rest_.empty()) {
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++number_;
    line = line.substr(0, line.find(comment_));
    const std::size_t start = line.find_first_not_of(kBlanks);
    if (start == std::string_view::npos) continue;
    return line.substr(start, line.find_last_not_of(kBlanks) + 1 - start);
  }
  return std::nullopt;
}

std::string_view take_word(std::string_view& text) {
  const std::size_t start = std::min(text.find_first_not_of(kBlanks), text.size());
  const std::size_t end = std::min(text.find_first_of(kBlanks, start), text.size());
  const std::string_view word = text.substr(start, end - start);
  text.remove_prefix(end);
  return word;
}

std::optional<double> to_coordinate(std::string_view word) {
  const auto value = whole_number<double>(word);
  if (!value || !(std::abs(*value) <= std::numeric_limits<float>::max())) return std::nullopt;
  return value;
}

std::optional<long long> to_integer(std::string_view word) { return whole_number<long long>(word); }

bool take_point(std::string_view& text) {
  for (int axis = 0; axis < 3; ++axis) {
    if (!to_coordinate(take_word(text))) return false;
  }
  return true;
}

}  // namespace qjulia

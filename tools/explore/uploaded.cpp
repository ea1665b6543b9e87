#include "explore/uploaded.hpp"

#include <fmt/format.h>

#include <fstream>
#include <string_view>

#include "base/file_types.hpp"
#include "base/temporary_folder.hpp"
#include "base/text.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::explore {
namespace {

constexpr std::size_t kLongestFileName = 80;

/// What `read` makes of the file, which lies alone in a folder of its own as long as that takes:
/// a mesh that names other files finds none. Messages have the file's harmless name.
template <class Read>
auto read_upload(const Upload& upload, const Read& read) {
  const std::string name = harmless_name(upload.name);
  const base::TemporaryFolder folder("qjulia");
  const auto path = folder.path() / name;
  std::ofstream file(path, std::ios::binary);
  file << upload.bytes;
  file.close();
  if (!file) throw OutputError(fmt::format("cannot write '{}'; is the disk full?", path.string()));
  try {
    return read(path);
  } catch (const InputError& error) {
    std::string text = error.what();
    const std::string before = folder.path().string() + "/";
    for (auto at = text.find(before); at != std::string::npos; at = text.find(before)) {
      text.erase(at, before.size());
    }
    throw InputError(text);
  }
}

void expect(const Upload& upload, base::FileContent content) {
  const std::string name = harmless_name(upload.name);
  if (base::has_type(name, content, base::FileUse::read)) return;
  throw InputError(fmt::format("'{}' is no {}: give {}", name, base::to_string(content),
                               base::extension_list(content, base::FileUse::read)));
}

}  // namespace

std::string harmless_name(const std::string& name) {
  std::string made;
  for (const char c : name) {
    const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                          (c >= '0' && c <= '9') || c == '.' || c == '-' || c == '_';
    made += is_plain ? c : '_';
  }
  if (made.size() > kLongestFileName) made.erase(0, made.size() - kLongestFileName);
  const bool is_name = made.find_first_not_of('.') != std::string::npos;
  return is_name ? made : "file";
}

TriangleMesh uploaded_mesh(const Upload& upload, const std::stop_token& stop) {
  expect(upload, base::FileContent::mesh);
  return read_upload(upload, [&](const auto& path) { return read_mesh(path, stop); });
}

Map uploaded_map(const Upload& upload, const std::stop_token& stop) {
  expect(upload, base::FileContent::map);
  return read_upload(upload, [&](const auto& path) { return read_map(path, stop); });
}

}  // namespace qjulia::explore

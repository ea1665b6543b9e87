#include "batch/manifest_paths.hpp"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <array>

#include "base/text.hpp"
#include "qjulia/file_types.hpp"

namespace qjulia::batch {
bool is_glob(const std::string& path) { return path.find_first_of("*?[") != std::string::npos; }

std::vector<std::filesystem::path> find_meshes(const std::filesystem::path& folder,
                                               const std::string& pattern) {
  std::vector<std::filesystem::path> found;
  glob_t matches{};
  if (::glob((folder / pattern).c_str(), 0, nullptr, &matches) == 0) {
    for (std::size_t i = 0; i < matches.gl_pathc; ++i) found.emplace_back(matches.gl_pathv[i]);
  }
  ::globfree(&matches);
  std::erase_if(found, [](const std::filesystem::path& path) {
    return !has_type(path, FileContent::mesh, FileUse::read);
  });
  std::ranges::sort(found);
  return found;
}

std::string entry_name(const std::optional<std::string>& name, const std::filesystem::path& mesh) {
  std::string stem = base::to_utf8(mesh.stem().string());  // names stand in JSON
  if (!name) return stem;
  std::string result = *name;
  if (const auto star = result.find('*'); star != std::string::npos) result.replace(star, 1, stem);
  return result;
}

std::string name_problem(const std::string& name) {
  constexpr std::array kTaken = {"batch", "summary", "contact_sheet"};
  constexpr std::size_t kLongest = 200;
  if (name.empty() || name.front() == '.') return "it must not be empty or begin with a dot";
  if (name.size() > kLongest) return fmt::format("it is longer than {} bytes", kLongest);
  if (std::ranges::any_of(name, [](unsigned char c) { return c == '/' || c == '*' || c < ' '; })) {
    return "it must not have a slash, a second asterisk or control characters";
  }
  if (std::ranges::find(kTaken, name) != kTaken.end()) return "the batch's own files have it";
  return {};
}

}  // namespace qjulia::batch

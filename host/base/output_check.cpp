#include "base/output_check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>

#include "base/file_types.hpp"
#include "base/output_file.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::base {
namespace {

using Path = std::filesystem::path;

void check_name(const Output& output) {
  if (output.path.empty()) throw InputError(output.name + ": the name is empty; give a file");
  const auto& extensions = output.extensions;
  if (extensions.empty()) return;
  if (std::ranges::find(extensions, extension_of(output.path)) != extensions.end()) return;
  throw InputError(fmt::format("{}: '{}' must end in {}", output.name, output.path.string(),
                               fmt::join(extensions, ", ")));
}

[[noreturn]] void fail(const Output& output, const std::string& problem) {
  throw OutputError(
      fmt::format("{}: cannot write '{}': {}", output.name, output.path.string(), problem));
}

/// The folder as far as it exists, for outputs whose folder will be made.
Path existing_part(Path folder) {
  std::error_code ignored;
  while (!std::filesystem::exists(folder, ignored) && folder.has_relative_path()) {
    folder = folder.parent_path();
  }
  return folder.empty() ? Path(".") : folder;
}

/// Two names of one file share a key: the true name that it has or would have, or where it exists,
/// its device and number. Devices and pipes have none: they take whatever is written into them.
std::vector<std::string> keys_of(const Path& path) {
  struct stat info {};
  const bool exists = ::stat(path.c_str(), &info) == 0, is_file = exists && S_ISREG(info.st_mode);
  if (exists && !is_file && !S_ISDIR(info.st_mode)) return {};
  std::vector<std::string> keys;
  std::error_code failed;
  const Path whole = std::filesystem::absolute(link_target(path), failed);
  const Path name = failed ? Path() : std::filesystem::weakly_canonical(whole, failed);
  if (!name.empty()) keys.push_back(name.string());
  if (is_file) keys.push_back(fmt::format("{}:{}", info.st_dev, info.st_ino));
  return keys;
}

}  // namespace

void check_writable(const Output& output) {
  check_name(output);
  std::error_code ignored;
  if (output.must_be_new && std::filesystem::exists(output.path, ignored)) {
    throw InputError(
        fmt::format("{}: '{}' exists, and is replaced only if you name the output yourself",
                    output.name, output.path.string()));
  }
  const Path target = link_target(output.path);
  if (std::filesystem::is_directory(target, ignored) || !target.has_filename()) {
    fail(output, "it is a folder");
  }
  if (is_special(output.path)) {
    if (::access(output.path.c_str(), W_OK) != 0) fail(output, std::strerror(errno));
    return;
  }
  struct stat info {};
  if (::stat(target.c_str(), &info) != 0) {
    if (errno != ENOENT && errno != ENOTDIR) fail(output, std::strerror(errno));
  } else if (::access(target.c_str(), W_OK) != 0) {
    fail(output, std::strerror(errno));  // to replace it, its folder's permission would do
  }
  const Path folder = target.has_parent_path() ? target.parent_path() : Path(".");
  if (output.makes_folder && !std::filesystem::exists(folder, ignored)) {
    const Path above = existing_part(folder);
    if (!std::filesystem::is_directory(above, ignored)) {
      fail(output, fmt::format("'{}' is not a folder", above.string()));
    }
    if (::access(above.c_str(), W_OK | X_OK) != 0) {
      fail(output, fmt::format("'{}': {}", above.string(), std::strerror(errno)));
    }
    return;
  }
  if (!std::filesystem::is_directory(folder, ignored)) {
    fail(output, std::filesystem::exists(folder, ignored)
                     ? fmt::format("'{}' is not a folder", folder.string())
                     : fmt::format("there is no folder '{}'", folder.string()));
  }
  remove_leftovers(output.path);
  const OutputFile trial(output.path);
}

void check_distinct(std::span<const Path> inputs, std::span<const Output> outputs) {
  std::map<std::string, std::string> owners;  // by key
  for (const Path& input : inputs) {
    for (const std::string& key : keys_of(input)) {
      owners.try_emplace(key, fmt::format("the input '{}'", input.string()));
    }
  }
  for (const Output& output : outputs) {
    const std::string who = fmt::format("{} '{}'", output.name, output.path.string());
    for (const std::string& key : keys_of(output.path)) {
      const auto [owner, added] = owners.try_emplace(key, who);
      if (added) continue;
      throw InputError(
          fmt::format("{} would overwrite {}; give it another name", who, owner->second));
    }
  }
}

}  // namespace qjulia::base

#include "base/output_check.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <map>
#include <optional>
#include <utility>

#include "base/output_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"

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

/// Two names of one file have the same identity: device and number where it exists, else the true
/// name it would have.
struct FileIdentity {
  std::optional<std::pair<dev_t, ino_t>> file;
  Path name;

  explicit FileIdentity(const Path& path) {
    struct stat info {};
    const bool exists = ::stat(path.c_str(), &info) == 0;
    if (exists && S_ISREG(info.st_mode)) file = {info.st_dev, info.st_ino};
    // Devices and pipes take whatever is written into them.
    if (exists && !S_ISREG(info.st_mode) && !S_ISDIR(info.st_mode)) return;
    std::error_code failed;
    const Path whole = std::filesystem::absolute(link_target(path), failed);
    if (!failed) name = std::filesystem::weakly_canonical(whole, failed);
  }
};

/// Who has which identity.
class FileOwners {
 public:
  /// @return who had it before.
  const std::string* take(const FileIdentity& identity, const std::string& who) {
    const std::string* before = nullptr;
    if (identity.file) {
      const auto [at, added] = files_.try_emplace(*identity.file, who);
      if (!added) before = &at->second;
    }
    if (!identity.name.empty()) {
      const auto [at, added] = names_.try_emplace(identity.name, who);
      if (!added) before = &at->second;
    }
    return before;
  }

 private:
  std::map<std::pair<dev_t, ino_t>, std::string> files_;
  std::map<Path, std::string> names_;
};

}  // namespace

void check_writable(const Output& output) {
  check_name(output);
  std::error_code ignored;
  const Path target = link_target(output.path);
  if (std::filesystem::is_directory(target, ignored) || !target.has_filename()) {
    fail(output, "it is a folder");
  }
  if (is_special(output.path)) {
    if (::access(output.path.c_str(), W_OK) != 0) fail(output, std::strerror(errno));
    return;
  }
  struct stat info {};
  if (::stat(target.c_str(), &info) != 0 && errno != ENOENT && errno != ENOTDIR) {
    fail(output, std::strerror(errno));
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
  FileOwners owners;
  for (const Path& input : inputs) {
    owners.take(FileIdentity(input), fmt::format("the input '{}'", input.string()));
  }
  for (const Output& output : outputs) {
    const std::string who = fmt::format("{} '{}'", output.name, output.path.string());
    if (const std::string* before = owners.take(FileIdentity(output.path), who)) {
      throw InputError(fmt::format("{} would overwrite {}; give it another name", who, *before));
    }
  }
}

}  // namespace qjulia::base

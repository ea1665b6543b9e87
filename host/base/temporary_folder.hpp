#pragma once
/// Folders among the system's temporary files, which only this user can enter.

#include <fmt/format.h>
#include <stdlib.h>

#include <filesystem>
#include <string>

#include "qjulia/base/error.hpp"

namespace qjulia::base {

/// A new folder, which stays. @param prefix what its name begins with. @throws OutputError
inline std::filesystem::path new_temporary_folder(const std::string& prefix) {
  std::string path = (std::filesystem::temp_directory_path() / (prefix + "-XXXXXX")).string();
  if (::mkdtemp(path.data()) == nullptr) {
    throw OutputError(fmt::format(
        "cannot make a folder for temporary files: {}; TMPDIR names another place", path));
  }
  return path;
}

/// A folder that goes with this object, and with it what is in it.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(const std::string& prefix) : path_(new_temporary_folder(prefix)) {}
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace qjulia::base

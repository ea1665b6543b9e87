#pragma once
/// Outputs appear under their name only when they are complete.

#include <filesystem>
#include <fstream>
#include <string_view>

namespace qjulia {

/// A file written beside `path` under a temporary name. `commit` renames it to `path`; without a
/// commit the destructor removes it and `path` stays as it was.
class AtomicFile {
 public:
  /// @throws OutputError when the folder cannot be written.
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  std::ostream& stream() { return stream_; }
  const std::filesystem::path& temporary_path() const { return temporary_; }
  /// Flushes, checks and renames. @throws OutputError when anything could not be written.
  void commit();

 private:
  std::filesystem::path path_;
  std::filesystem::path temporary_;
  std::ofstream stream_;
  bool committed_ = false;
};

/// Writes `text` to `path` as one atomic file.
void write_file(const std::filesystem::path& path, std::string_view text);

}  // namespace qjulia

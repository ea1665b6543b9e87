#pragma once
/// Who owns a batch's folder.

#include <filesystem>
#include <string>

namespace qjulia::batch {

/// This machine's name.
std::string host_name();

/// Held by one process at a time in a folder, as long as it lives, or by several that share it. It
/// is a lock on the file `.lock` there, which says who holds it.
class FolderLock {
 public:
  enum class Kind { own, shared };
  /// @throws Error naming the holder when another process has it, OutputError when the folder
  /// cannot be written.
  explicit FolderLock(const std::filesystem::path& folder, Kind kind = Kind::own);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;
  ~FolderLock();

 private:
  int file_;
};

/// Whether a process holds the folder.
bool is_locked(const std::filesystem::path& folder);

}  // namespace qjulia::batch

#pragma once
/// Claim files: which process works on what, in a folder that several share.

#include <filesystem>
#include <optional>
#include <string>

namespace qjulia::batch {

/// This machine's name.
std::string host_name();

/// A file that only one process could create, with its host and process number in it. Removed when
/// the claim ends. Living processes of other hosts are told from dead ones by its age: `touch` it
/// more often than every two minutes.
class Claim {
 public:
  /// Nothing when the file is there already. @throws OutputError when it cannot be written.
  static std::optional<Claim> take(const std::filesystem::path& path);
  Claim(Claim&& other) noexcept;
  Claim& operator=(Claim&&) = delete;
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;
  ~Claim();

  void touch() const;

 private:
  explicit Claim(std::filesystem::path path) : path_(std::move(path)) {}
  std::filesystem::path path_;
};

enum class ClaimState { none, living, dead };
ClaimState claim_state(const std::filesystem::path& path);

/// Removes the claim of a process that is no more. Two processes that try at once do no harm.
/// @return whether the way is free now.
bool break_dead_claim(const std::filesystem::path& path);

/// Held by one process at a time in a folder; others wait for it.
class FolderLock {
 public:
  /// @throws OutputError when the folder cannot be written.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int file_;
};

}  // namespace qjulia::batch

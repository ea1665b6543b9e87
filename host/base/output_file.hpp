#pragma once
/// The one place where files are written. Outputs appear under their name only when they are
/// complete.

#include <filesystem>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>

namespace qjulia::base {

class FileBuffer;

/// A file written beside its target under a random temporary name, which `commit` renames. Without
/// a commit the destructor removes it and the target stays as it was.
/// A symbolic link stays, and what it points to is replaced. An existing file's permissions are
/// kept. What is no regular file (a device, a pipe, /dev/stdout) is written into by `commit`.
/// The temporary file is locked as long as it is in use, so that `remove_leftovers` leaves it
/// alone.
class OutputFile {
 public:
  /// @throws OutputError when the folder cannot be written.
  explicit OutputFile(std::filesystem::path path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Can be sought in. After an error it stays bad, and `commit` says why.
  std::ostream& stream() { return stream_; }
  /// Flushes to the disk, checks and renames. @throws OutputError when anything could not be
  /// written.
  void commit();

 private:
  void write_into_target();
  void replace_target();
  [[noreturn]] void fail(const char* what, int error) const;

  std::filesystem::path path_;       ///< as given, for messages
  std::filesystem::path target_;     ///< links followed
  std::filesystem::path temporary_;  ///< empty: nothing to remove
  bool special_ = false;             ///< the target is no regular file
  std::unique_ptr<FileBuffer> buffer_;
  std::ostream stream_{nullptr};
};

/// A file without a name, beside `path` or with the system's temporary files: written, then read.
class ScratchFile {
 public:
  /// @throws OutputError when it cannot be made.
  explicit ScratchFile(const std::filesystem::path& path);
  ~ScratchFile();
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;

  std::iostream& stream() { return stream_; }

 private:
  std::unique_ptr<FileBuffer> buffer_;
  std::iostream stream_{nullptr};
};

/// Writes `text` to `path`, all or nothing. @throws OutputError
void write_file(const std::filesystem::path& path, std::string_view text);

/// Makes the folder, with those above it. @throws OutputError where it is not there afterwards
void make_folder(const std::filesystem::path& folder);

/// Overwrites a regular file that exists and is at least as long as `text` with `text`, and blanks
/// after it. Most file systems need no space for this, so it works on a full disk. A reader at that
/// moment may see half of it, and a process that is killed then may leave half of it. @return
/// whether it is written.
bool overwrite_file(const std::filesystem::path& path, std::string_view text);

/// Removes temporary files of `path` that killed processes have left.
void remove_leftovers(const std::filesystem::path& path);
/// Removes those of all files of a folder.
void remove_all_leftovers(const std::filesystem::path& folder);

/// Where a path leads, through symbolic links, whether or not there is a file.
std::filesystem::path link_target(std::filesystem::path path);

/// Whether there is something at `path` that is neither a regular file nor a folder, or that a
/// process has open already (/dev/stdout): it can be written into, and not be replaced.
bool is_special(const std::filesystem::path& path);

}  // namespace qjulia::base

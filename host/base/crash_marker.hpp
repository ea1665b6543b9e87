#pragma once
/// A file that a process leaves behind where it ends in the middle of something, for the next one
/// to find.

#include <filesystem>
#include <string>
#include <string_view>

namespace qjulia::base {

/// A marker at a path. It is locked while it exists, so that what another process (or thread) is
/// doing at the moment is not mistaken for what one has left. Where there is no place for the file,
/// nothing is marked and nothing fails.
class CrashMarker {
 public:
  explicit CrashMarker(std::filesystem::path path);
  /// Removes the file, unless a process has left it and nothing has been marked since.
  ~CrashMarker();
  CrashMarker(const CrashMarker&) = delete;
  CrashMarker& operator=(const CrashMarker&) = delete;

  /// What a process that ended after `mark` has left; empty: none has.
  const std::string& left() const { return left_; }
  /// From here until destruction: a process that ends leaves `text`, which is not empty.
  void mark(std::string_view text);

  /// Removes all markers of this process, which ends on purpose.
  static void forget_all();

 private:
  void remove();

  std::filesystem::path path_;
  int file_ = -1;
  bool is_marked_ = false;
  std::string left_;
};

}  // namespace qjulia::base

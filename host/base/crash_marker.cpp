#include "base/crash_marker.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <mutex>
#include <set>

namespace qjulia::base {
namespace {

struct OpenMarkers {
  std::mutex mutex;
  std::set<std::filesystem::path> paths;
};

OpenMarkers& open_markers() {
  static OpenMarkers markers;
  return markers;
}

}  // namespace

CrashMarker::CrashMarker(std::filesystem::path path) : path_(std::move(path)) {
  constexpr mode_t kMode = 0600;
  file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kMode);
  if (file_ < 0) return;
  struct stat info {};
  const bool is_ours = ::flock(file_, LOCK_EX | LOCK_NB) == 0 && ::fstat(file_, &info) == 0 &&
                       S_ISREG(info.st_mode) && info.st_nlink > 0;
  if (!is_ours) {
    ::close(file_);
    file_ = -1;
    return;
  }
  std::array<char, 256> text{};
  const ssize_t bytes = ::pread(file_, text.data(), text.size(), 0);
  if (bytes > 0) left_.assign(text.data(), static_cast<std::size_t>(bytes));
}

CrashMarker::~CrashMarker() {
  if (file_ < 0) return;
  if (is_marked_ || left_.empty()) remove();
  ::close(file_);
}

void CrashMarker::mark(std::string_view text) {
  if (file_ < 0) return;
  is_marked_ = true;
  {
    const std::lock_guard lock(open_markers().mutex);
    open_markers().paths.insert(path_);
  }
  // Where this fails nothing is marked, and the work goes on.
  [[maybe_unused]] const int cut = ::ftruncate(file_, 0);
  [[maybe_unused]] const ssize_t written = ::pwrite(file_, text.data(), text.size(), 0);
}

/// Whoever has it open finds it empty.
void CrashMarker::remove() {
  [[maybe_unused]] const int cut = ::ftruncate(file_, 0);
  ::unlink(path_.c_str());
  const std::lock_guard lock(open_markers().mutex);
  open_markers().paths.erase(path_);
}

void CrashMarker::forget_all() {
  const std::lock_guard lock(open_markers().mutex);
  for (const auto& path : open_markers().paths) ::unlink(path.c_str());
}

}  // namespace qjulia::base

#include "batch/folder_lock.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>
#include <utility>

#include "batch/status.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::batch {
namespace {

using nlohmann::json;

std::filesystem::path lock_path(const std::filesystem::path& folder) { return folder / ".lock"; }

/// "process 7 on HOST since TIME", by the lock's file.
std::string holder(const std::filesystem::path& path) {
  std::ifstream file(path);
  const json lock = json::parse(file, nullptr, false);
  try {
    return fmt::format("process {} on {} since {}", lock.at("process").get<long>(),
                       lock.at("host").get<std::string>(), lock.at("since").get<std::string>());
  } catch (const json::exception&) {
    return "another process";
  }
}

/// The folder itself, which is locked, too: its file `.lock` may be removed while it is held. Some
/// file systems lock no folders, and there the file alone must do.
int open_folder(const std::filesystem::path& folder) {
  return ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
}

/// Tries for half a second: `is_locked` also takes the lock for a moment.
bool take_lock(int file, int how) {
  constexpr int kTries = 26;
  constexpr std::chrono::milliseconds kBetweenTries{20};
  for (int i = 0; i < kTries; ++i) {
    if (i > 0) std::this_thread::sleep_for(kBetweenTries);
    if (::flock(file, how | LOCK_NB) == 0) return true;
    if (errno != EWOULDBLOCK) return false;
  }
  return false;
}

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  throw OutputError(
      fmt::format("cannot lock '{}': {}; check the folder, its permissions and the space left",
                  path.string(), std::strerror(error)));
}

}  // namespace

std::string host_name() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

FolderLock::FolderLock(const std::filesystem::path& folder, Kind kind) {
  const auto path = lock_path(folder);
  const int how = kind == Kind::own ? LOCK_EX : LOCK_SH;
  const auto refuse = [&] {
    throw Error(fmt::format("'{}' is in use by {}; wait for it, or choose another folder",
                            folder.string(), holder(path)));
  };
  Descriptor place(open_folder(folder));
  if (place.is_open() && !take_lock(place.get(), how) && errno == EWOULDBLOCK) refuse();
  Descriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (!file.is_open()) fail(path, errno);
  if (!take_lock(file.get(), how)) {
    if (errno != EWOULDBLOCK) fail(path, errno);
    refuse();
  }
  folder_ = std::move(place);
  file_ = std::move(file);
  const std::string text =
      json({{"host", host_name()}, {"process", ::getpid()}, {"since", time_stamp()}}).dump() + '\n';
  // For people: the lock holds without it, also on a full disk.
  if (::ftruncate(file_.get(), 0) == 0) {
    [[maybe_unused]] const ssize_t written = ::pwrite(file_.get(), text.data(), text.size(), 0);
  }
}

FolderLock::Descriptor& FolderLock::Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

FolderLock::Descriptor::~Descriptor() {
  if (number_ >= 0) ::close(number_);
}

bool is_locked(const std::filesystem::path& folder) {
  const auto is_held = [](int opened) {
    const FolderLock::Descriptor file(opened);
    return file.is_open() && ::flock(opened, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  };
  return is_held(open_folder(folder)) ||
         is_held(::open(lock_path(folder).c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
}

}  // namespace qjulia::batch

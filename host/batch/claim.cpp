#include "batch/claim.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "qjulia/error.hpp"

namespace qjulia::batch {
namespace {

/// A claim of another host, or one that cannot be read, is dead when it is older.
constexpr double kSilence = 120;  // s

[[noreturn]] void fail(const std::filesystem::path& path) {
  throw OutputError(
      fmt::format("cannot write '{}': {}; check the folder, its permissions and the space left",
                  path.string(), std::strerror(errno)));
}

/// When a process started, in ticks since this machine did; 0 when there is no such process.
/// Process numbers are used again, pairs of number and start are not. proc(5), /proc/PID/stat.
std::uint64_t process_start(long process) {
  std::ifstream file(fmt::format("/proc/{}/stat", process));
  std::string text;
  std::getline(file, text);
  // The second field, the program's name, is in parentheses and may hold anything.
  const auto end = text.rfind(')');
  if (end == std::string::npos) return 0;
  std::istringstream fields(text.substr(end + 1));
  constexpr int kStartField = 22;
  std::string field;
  for (int i = 3; i <= kStartField; ++i) fields >> field;
  return field.empty() ? 0 : std::strtoull(field.c_str(), nullptr, 10);
}

/// Seconds since the file was last touched, by the clock of the folder's machine where it is ours.
double age(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return 0;
  return std::difftime(std::time(nullptr), info.st_mtime);
}

}  // namespace

std::string host_name() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

std::optional<Claim> Claim::take(const std::filesystem::path& path) {
  // Written first and linked to its name then, which only one process can do: a claim that is there
  // is whole, whenever its process is killed.
  const std::string temporary = fmt::format("{}.{}.{}.tmp", path.string(), host_name(), ::getpid());
  const nlohmann::json json = {
      {"host", host_name()}, {"process", ::getpid()}, {"process_start", process_start(::getpid())}};
  {
    std::ofstream file(temporary);
    file << json << std::endl;
    if (!file) {
      const int error = errno;
      ::unlink(temporary.c_str());
      errno = error;
      fail(path);
    }
  }
  const int result = ::link(temporary.c_str(), path.c_str());
  const int error = errno;
  ::unlink(temporary.c_str());
  if (result == 0) return Claim(path);
  if (error == EEXIST) return std::nullopt;
  errno = error;
  fail(path);
}

Claim::Claim(Claim&& other) noexcept : path_(std::exchange(other.path_, {})) {}

Claim::~Claim() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

void Claim::touch() const { ::utimensat(AT_FDCWD, path_.c_str(), nullptr, 0); }

ClaimState claim_state(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) return ClaimState::none;
  const auto json = nlohmann::json::parse(file, nullptr, false);
  const bool whole = json.is_object() && json.contains("host") && json.contains("process") &&
                     json.contains("process_start");
  if (!whole || json["host"] != host_name()) {
    return age(path) > kSilence ? ClaimState::dead : ClaimState::living;
  }
  const auto start = process_start(json["process"].get<long>());
  return start != 0 && start == json["process_start"].get<std::uint64_t>() ? ClaimState::living
                                                                           : ClaimState::dead;
}

bool break_dead_claim(const std::filesystem::path& path) {
  // Only the lock's holder removes claims that are not its own: a new one is never taken for dead.
  const FolderLock lock(path.parent_path());
  const ClaimState state = claim_state(path);
  if (state == ClaimState::dead) ::unlink(path.c_str());
  return state != ClaimState::living;
}

FolderLock::FolderLock(const std::filesystem::path& folder) {
  const auto path = folder / ".lock";
  file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file_ < 0) fail(path);
  while (::flock(file_, LOCK_EX) != 0) {
    if (errno == EINTR) continue;
    const int error = errno;
    ::close(file_);
    errno = error;
    fail(path);
  }
}

FolderLock::~FolderLock() { ::close(file_); }

}  // namespace qjulia::batch

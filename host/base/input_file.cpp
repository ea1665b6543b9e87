#include "base/input_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <limits>
#include <new>

#include "base/text.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::base {
namespace {

constexpr std::uint64_t kBlock = std::uint64_t{1} << 22;  ///< between two looks at a stop request

}  // namespace

InputFile::InputFile(std::filesystem::path path, std::string kind, std::uint64_t limit,
                     std::stop_token stop)
    : path_(std::move(path)), kind_(std::move(kind)), limit_(limit), stop_(std::move(stop)) {
  // Without O_NONBLOCK a pipe would be waited for here until somebody writes into it.
  descriptor_ = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (descriptor_ < 0) {
    if (errno == ENOENT || errno == ENOTDIR) refuse("there is no such file; check the name");
    if (errno == EACCES) refuse("it cannot be opened; check its permissions");
    refuse(fmt::format("it cannot be opened ({})", std::strerror(errno)));
  }
  try {
    struct stat status {};
    if (::fstat(descriptor_, &status) != 0) {
      refuse(fmt::format("asking for its size failed ({}); check the disk", std::strerror(errno)));
    }
    if (S_ISDIR(status.st_mode)) refuse(fmt::format("it is a folder; name a {} file in it", kind_));
    is_pipe_ = S_ISFIFO(status.st_mode);
    if (!is_pipe_ && !S_ISREG(status.st_mode)) refuse("it is a device, not a file");
    if (!is_pipe_) size_ = static_cast<std::uint64_t>(status.st_size);
    if (size_ > limit_) {
      refuse(fmt::format("it holds {}; a {} file may hold {} at most", size_text(size_), kind_,
                         size_text(limit_)));
    }
  } catch (...) {
    ::close(descriptor_);
    throw;
  }
}

InputFile::~InputFile() { ::close(descriptor_); }

void InputFile::refuse(std::string_view why) const {
  throw InputError(fmt::format("cannot read {} '{}': {}", kind_, to_utf8(path_.string()), why));
}

/// Until a pipe has something to read or has ended.
void InputFile::wait() const {
  constexpr int kMilliseconds = 100;
  pollfd waiting{descriptor_, POLLIN, 0};
  while (::poll(&waiting, 1, kMilliseconds) <= 0) {
    throw_if_stopped(stop_);
  }
}

void InputFile::read(std::string& bytes, std::uint64_t count) {
  try {
    if (size_ > 0) bytes.reserve(std::min(size_, count));
    while (bytes.size() < count) {
      throw_if_stopped(stop_);
      if (is_pipe_) wait();
      const std::size_t before = bytes.size();
      const std::uint64_t left = size_ > before ? size_ - before : 1U << 16U;
      bytes.resize(before + std::min({kBlock, left, count - before}));
      const ssize_t got = ::read(descriptor_, bytes.data() + before, bytes.size() - before);
      bytes.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
      if (got < 0 && errno != EINTR && errno != EAGAIN) {
        refuse(fmt::format("reading failed ({}); check the disk", std::strerror(errno)));
      }
      if (got == 0) break;
    }
  } catch (const std::bad_alloc&) {
    refuse(fmt::format("there is not enough memory for its {}", size_text(size_)));
  }
  if (bytes.size() > limit_) {
    refuse(fmt::format("it holds more than {}, the most that a {} file may hold", size_text(limit_),
                       kind_));
  }
}

void InputFile::skip(std::uint64_t count) {
  constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<off_t>::max());
  if (!is_pipe_ && ::lseek(descriptor_, static_cast<off_t>(std::min(count, kMost)), SEEK_CUR) >= 0)
    return;
  std::string part;
  for (; count > 0; count -= part.size()) {
    part.clear();
    read(part, std::min(count, kBlock));
    if (part.empty()) return;
  }
}

std::string read_text_file(const std::filesystem::path& path, const std::string& kind,
                           std::uint64_t limit, std::stop_token stop) {
  InputFile file(path, kind, limit, std::move(stop));
  std::string text;
  file.read_all(text);
  if (const auto encoding = wide_encoding(text); !encoding.empty()) {
    file.refuse(fmt::format("it is {} text; save it as UTF-8", encoding));
  }
  return std::string(without_byte_order_mark(text));
}

std::string size_text(std::uint64_t bytes) {
  constexpr const char* kUnits[] = {"bytes", "KiB", "MiB", "GiB", "TiB"};
  auto size = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; size >= 1024 && unit + 1 < std::size(kUnits); ++unit) size /= 1024;
  return fmt::format("{:.4g} {}", size, kUnits[unit]);
}

}  // namespace qjulia::base

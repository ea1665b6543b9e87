#include "files/atomic_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "qjulia/error.hpp"

namespace qjulia {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const char* what) {
  throw OutputError(
      fmt::format("cannot write '{}': {} ({}); check the folder, its permissions and "
                  "the space left",
                  path.string(), what, std::strerror(errno)));
}

}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path)
    : path_(std::move(path)),
      temporary_(path_.string() + fmt::format(".{}.tmp", ::getpid())),
      stream_(temporary_, std::ios::binary | std::ios::trunc) {
  if (!stream_) fail(path_, "it cannot be created");
}

AtomicFile::~AtomicFile() {
  if (committed_) return;
  stream_.close();
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void AtomicFile::commit() {
  stream_.close();
  if (!stream_) fail(path_, "writing failed");
  std::error_code error;
  std::filesystem::rename(temporary_, path_, error);
  if (error) {
    errno = error.value();
    fail(path_, "it cannot be replaced");
  }
  committed_ = true;
}

void write_file(const std::filesystem::path& path, std::string_view text) {
  AtomicFile file(path);
  file.stream() << text;
  file.commit();
}

}  // namespace qjulia

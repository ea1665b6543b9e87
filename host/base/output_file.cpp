#include "base/output_file.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <random>
#include <streambuf>
#include <vector>

#include "base/output_gate.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::base {

/// An open file's bytes, written and read at one position. It has its memory before there is a
/// file: a file that nobody owns for want of memory would be left behind.
class FileBuffer final : public std::streambuf {
 public:
  FileBuffer() : bytes_(kBytes) { start_writing(); }
  ~FileBuffer() override {
    if (file_ >= 0) ::close(file_);
  }
  FileBuffer(const FileBuffer&) = delete;
  FileBuffer& operator=(const FileBuffer&) = delete;

  /// Owns the descriptor from here on.
  void take(int file) noexcept { file_ = file; }
  int file() const { return file_; }
  /// errno of the first write that failed; 0: none has.
  int error() const { return error_; }

 protected:
  int sync() override {
    if (eback() != nullptr) return 0;  // nothing is waiting to be written
    const bool written = write_all(pbase(), static_cast<std::size_t>(pptr() - pbase()));
    start_writing();
    return written ? 0 : -1;
  }

  int_type overflow(int_type c) override {
    if (eback() != nullptr) {
      ::lseek(file_, gptr() - egptr(), SEEK_CUR);
      start_writing();
    }
    if (sync() != 0) return traits_type::eof();
    if (!traits_type::eq_int_type(c, traits_type::eof())) sputc(traits_type::to_char_type(c));
    return traits_type::not_eof(c);
  }

  int_type underflow() override {
    if (eback() == nullptr && sync() != 0) return traits_type::eof();
    setp(nullptr, nullptr);
    ssize_t count = 0;
    do {
      count = ::read(file_, bytes_.data(), bytes_.size());
    } while (count < 0 && errno == EINTR);
    setg(bytes_.data(), bytes_.data(), bytes_.data() + std::max<ssize_t>(count, 0));
    return count > 0 ? traits_type::to_int_type(bytes_.front()) : traits_type::eof();
  }

  pos_type seekoff(off_type offset, std::ios_base::seekdir from,
                   std::ios_base::openmode /*which*/) override {
    if (eback() != nullptr) {
      if (from == std::ios_base::cur) offset -= egptr() - gptr();
      start_writing();
    } else if (sync() != 0) {
      return pos_type(off_type(-1));
    }
    const int whence = from == std::ios_base::beg   ? SEEK_SET
                       : from == std::ios_base::cur ? SEEK_CUR
                                                    : SEEK_END;
    return {::lseek(file_, offset, whence)};
  }

  pos_type seekpos(pos_type position, std::ios_base::openmode which) override {
    return seekoff(off_type(position), std::ios_base::beg, which);
  }

 private:
  static constexpr std::size_t kBytes = 1 << 16;

  void start_writing() {
    setg(nullptr, nullptr, nullptr);
    setp(bytes_.data(), bytes_.data() + bytes_.size());
  }

  bool write_all(const char* bytes, std::size_t count) {
    while (error_ == 0 && count > 0) {
      const ssize_t written = ::write(file_, bytes, count);
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) {
        error_ = errno;
      } else {
        bytes += written;
        count -= static_cast<std::size_t>(written);
      }
    }
    return error_ == 0;
  }

  int file_ = -1;
  int error_ = 0;
  std::vector<char> bytes_;
};

namespace {

constexpr std::string_view kTag = ".qjulia-";
constexpr std::string_view kEnding = ".tmp";
constexpr std::size_t kDigits = 16;
/// Bytes of the target's name in that of its temporary file: a name has at most 255.
constexpr std::size_t kMostOfName = 200;

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

/// What temporary files of a target begin with.
std::string temporary_start(const std::filesystem::path& target) {
  return target.filename().string().substr(0, kMostOfName) + std::string(kTag);
}

/// Sixteen hexadecimal digits that nobody can predict.
std::string random_digits() {
  std::random_device device;
  return fmt::format("{:08x}{:08x}", device(), device());
}

bool is_temporary(const std::string& name) {
  const std::size_t tail = kTag.size() + kDigits + kEnding.size();
  if (name.size() <= tail || !name.ends_with(kEnding)) return false;
  const std::string_view rest = std::string_view(name).substr(name.size() - tail);
  return rest.starts_with(kTag) &&
         rest.substr(kTag.size(), kDigits).find_first_not_of("0123456789abcdef") ==
             std::string_view::npos;
}

/// Removes it unless a process has it in use.
void remove_if_left(const std::filesystem::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return;
  struct stat info {};
  const bool ours =
      ::fstat(file, &info) == 0 && S_ISREG(info.st_mode) && info.st_uid == ::geteuid();
  if (ours && ::flock(file, LOCK_EX | LOCK_NB) == 0) ::unlink(path.c_str());
  ::close(file);
}

/// Not by std::filesystem::directory_iterator, whose constructor ends the process when there is too
/// little memory (libstdc++ 12).
void remove_leftovers_if(const std::filesystem::path& folder, std::string_view start) {
  const auto close = [](DIR* opened) { ::closedir(opened); };
  const std::unique_ptr<DIR, decltype(close)> names(::opendir(folder.c_str()));
  if (!names) return;
  std::vector<std::filesystem::path> found;
  while (const dirent* entry = ::readdir(names.get())) {
    const std::string name = entry->d_name;
    if (name.starts_with(start) && is_temporary(name)) found.push_back(folder / name);
  }
  for (const auto& path : found) remove_if_left(path);
}

/// A new file that this process has locked. @return -1 and errno when it cannot be made.
int create_locked(const std::filesystem::path& path) {
  constexpr mode_t kMode = 0666;  // less the umask
  const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kMode);
  if (file < 0) return -1;
  // Between the two calls it may have been taken for a leftover.
  const bool taken = ::flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  struct stat info {};
  const bool known = ::fstat(file, &info) == 0;
  if (!taken && known && info.st_nlink > 0) return file;
  if (!taken && !known) ::unlink(path.c_str());
  ::close(file);
  errno = EEXIST;
  return -1;
}

/// A new temporary file for `target`. @param path becomes its name.
int create_temporary(const std::filesystem::path& target, std::filesystem::path& path) {
  constexpr int kTries = 16;
  for (int i = 0; i < kTries; ++i) {
    path = folder_of(target) /
           fmt::format("{}{}{}", temporary_start(target), random_digits(), kEnding);
    const int file = create_locked(path);
    if (file >= 0 || errno != EEXIST) return file;
  }
  return -1;
}

/// Creates a file without a name, beside `path` or with the system's temporary files.
int create_nameless(const std::filesystem::path& path) {
  const bool beside = !is_special(path);
  std::filesystem::path name;
  const int file = create_temporary(
      beside ? link_target(path) : std::filesystem::temp_directory_path() / "scratch", name);
  if (file >= 0) ::unlink(name.c_str());
  return file;
}

[[noreturn]] void fail_to_write(const std::filesystem::path& path, const char* what, int error) {
  throw OutputError(
      fmt::format("cannot write '{}': {} ({}); check the folder, its permissions and the space "
                  "left",
                  path.string(), what, std::strerror(error)));
}

}  // namespace

std::filesystem::path link_target(std::filesystem::path path) {
  constexpr int kMostLinks = 40;  // path_resolution(7)
  std::error_code failed;
  for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(path, failed); ++i) {
    const auto next = std::filesystem::read_symlink(path, failed);
    if (failed) break;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return path;
}

bool is_special(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || S_ISDIR(info.st_mode)) return false;
  if (!S_ISREG(info.st_mode)) return true;
  // Links of /proc lead to files that are open, whatever stands under their names now.
  std::error_code failed;
  auto at = path;
  while (std::filesystem::is_symlink(at, failed)) {
    const auto folder = std::filesystem::weakly_canonical(folder_of(at), failed);
    if (folder.string().starts_with("/proc/")) return true;
    const auto next = std::filesystem::read_symlink(at, failed);
    at = next.is_absolute() ? next : folder / next;
  }
  return false;
}

OutputFile::OutputFile(std::filesystem::path path)
    : path_(std::move(path)), target_(link_target(path_)), special_(is_special(path_)) {
  buffer_ = std::make_unique<FileBuffer>();
  const int file = special_ ? create_nameless(path_) : create_temporary(target_, temporary_);
  if (file < 0) {
    const int error = errno;
    temporary_.clear();
    fail("it cannot be created", error);
  }
  buffer_->take(file);
  stream_.rdbuf(buffer_.get());
}

OutputFile::~OutputFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void OutputFile::fail(const char* what, int error) const { fail_to_write(path_, what, error); }

void OutputFile::commit() {
  stream_.flush();
  if (buffer_->error() != 0) fail("writing failed", buffer_->error());
  if (!stream_) fail("writing failed", EIO);
  if (special_) {
    write_into_target();
  } else {
    replace_target();
  }
}

void OutputFile::write_into_target() {
  OutputGate::pass();
  FileBuffer target;
  // Without O_NONBLOCK a pipe would be waited for here until somebody reads it.
  const int file = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (file < 0) fail(errno == ENXIO ? "nobody reads it" : "it cannot be opened", errno);
  target.take(file);
  if (::fcntl(file, F_SETFL, O_WRONLY | O_APPEND) != 0) fail("it cannot be opened", errno);
  std::ostream out(&target);
  std::istream in(buffer_.get());
  in.seekg(0);
  if (in.peek() != std::char_traits<char>::eof()) out << in.rdbuf();
  out.flush();
  if (target.error() != 0) fail("writing failed", target.error());
}

void OutputFile::replace_target() {
  const int file = buffer_->file();
  struct stat old {};
  if (::stat(target_.c_str(), &old) == 0) {
    // Where the owner cannot be kept, the file becomes this user's.
    [[maybe_unused]] const int owner = ::fchown(file, old.st_uid, old.st_gid);
    constexpr mode_t kPermissions = 07777;
    if (::fchmod(file, old.st_mode & kPermissions) != 0) fail("its mode cannot be kept", errno);
  }
  // Some file systems have nothing to synchronise.
  if (::fsync(file) != 0 && errno != EINVAL && errno != ENOSYS) fail("writing failed", errno);
  OutputGate::pass();
  if (::rename(temporary_.c_str(), target_.c_str()) != 0) fail("it cannot be replaced", errno);
  temporary_.clear();
}

ScratchFile::ScratchFile(const std::filesystem::path& path) {
  buffer_ = std::make_unique<FileBuffer>();
  const int file = create_nameless(path);
  if (file < 0) fail_to_write(path, "a file beside it cannot be created", errno);
  buffer_->take(file);
  stream_.rdbuf(buffer_.get());
}

ScratchFile::~ScratchFile() = default;

void write_file(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.stream() << text;
  file.commit();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error, ignored;
  std::filesystem::create_directories(folder, error);
  if (std::filesystem::is_directory(folder, ignored)) return;
  throw OutputError(fmt::format("cannot make the folder '{}': {}", folder.string(),
                                error ? error.message() : "there is a file of that name"));
}

bool overwrite_file(const std::filesystem::path& path, std::string_view text) {
  FileBuffer buffer;
  const int file = ::open(path.c_str(), O_WRONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return false;
  buffer.take(file);
  struct stat info {};
  if (::fstat(file, &info) != 0 || !S_ISREG(info.st_mode)) return false;
  const auto size = static_cast<std::size_t>(info.st_size);
  if (text.size() > size) return false;
  OutputGate::pass();
  std::ostream out(&buffer);
  out << text << std::string(size - text.size(), ' ');
  out.flush();
  return buffer.error() == 0 && ::fsync(file) == 0;
}

void remove_leftovers(const std::filesystem::path& path) {
  if (is_special(path)) return;
  const auto target = link_target(path);
  remove_leftovers_if(folder_of(target), temporary_start(target));
}

void remove_all_leftovers(const std::filesystem::path& folder) { remove_leftovers_if(folder, ""); }

}  // namespace qjulia::base

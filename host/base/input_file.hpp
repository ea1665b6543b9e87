#pragma once
/// Files that users give, read without trust: bounded in size, and never waiting where a stop
/// request is not heard.

#include <cstdint>
#include <filesystem>
#include <stop_token>
#include <string>
#include <string_view>

namespace qjulia::base {

/// An open file. Regular files and pipes can be read, devices and folders cannot.
class InputFile {
 public:
  /// @param kind for messages, such as "mesh". @param limit bytes that it may hold at most.
  /// @param stop ends waiting and reading.
  /// @throws InputError "cannot read KIND 'path': why".
  InputFile(std::filesystem::path path, std::string kind, std::uint64_t limit,
            std::stop_token stop = {});
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  /// Bytes in a regular file, 0 for a pipe.
  std::uint64_t size() const { return size_; }

  /// Appends to `bytes` until it holds `count` bytes or the file ends.
  /// @throws InputError beyond the limit or where reading fails.
  void read(std::string& bytes, std::uint64_t count);
  /// Passes over the next `count` bytes, or what there is of them.
  void skip(std::uint64_t count);
  void read_all(std::string& bytes) { read(bytes, limit_ + 1); }

  [[noreturn]] void refuse(std::string_view why) const;

 private:
  void wait() const;

  std::filesystem::path path_;
  std::string kind_;
  std::uint64_t limit_;
  std::stop_token stop_;
  int descriptor_ = -1;
  bool is_pipe_ = false;
  std::uint64_t size_ = 0;
};

/// The whole file, which is text. A UTF-8 byte order mark is left out.
/// @throws InputError as `InputFile` does, and for UTF-16 and UTF-32.
std::string read_text_file(const std::filesystem::path& path, const std::string& kind,
                           std::uint64_t limit, std::stop_token stop = {});

/// "1.5 MiB" and the like.
std::string size_text(std::uint64_t bytes);

}  // namespace qjulia::base

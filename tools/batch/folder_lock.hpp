#pragma once
/// Who owns a batch's folder.

#include <filesystem>
#include <string>
#include <utility>

namespace qjulia::batch {

/// This machine's name.
std::string host_name();

/// Held by one process at a time in a folder, as long as it lives, or by several that share it. It
/// is a lock on the folder and on the file `.lock` there, which says who holds it.
class FolderLock {
 public:
  enum class Kind { own, shared };
  /// @throws Error naming the holder when another process has it, OutputError when the folder
  /// cannot be written.
  explicit FolderLock(const std::filesystem::path& folder, Kind kind = Kind::own);

  /// Of an open file, which it closes; below 0: none.
  class Descriptor {
   public:
    explicit Descriptor(int number = -1) : number_(number) {}
    Descriptor(Descriptor&& other) noexcept { *this = std::move(other); }
    Descriptor& operator=(Descriptor&& other) noexcept;
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor();
    int get() const { return number_; }
    bool is_open() const { return number_ >= 0; }

   private:
    int number_ = -1;
  };

 private:
  Descriptor folder_, file_;
};

/// Whether a process holds the folder.
bool is_locked(const std::filesystem::path& folder);

}  // namespace qjulia::batch

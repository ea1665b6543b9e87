#pragma once
/// Strict reading of numbers and words out of mesh files.

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace qjulia {

/// A mesh file in memory, with what is needed to complain about it.
struct RawMeshFile {
  std::filesystem::path path;
  std::string bytes;

  /// @throws InputError "cannot read 'path': what".
  [[noreturn]] void refuse(const std::string& what) const;
  [[noreturn]] void refuse_line(std::size_t line, const std::string& what) const;
};

/// @throws InputError when the file is missing, not a file, empty or unreadable.
RawMeshFile load_mesh_file(const std::filesystem::path& path);

/// Hands out lines without their ends, comments (from `comment` on) and outer blanks.
class Lines {
 public:
  explicit Lines(std::string_view text, char comment = '#') : rest_(text), comment_(comment) {}
  /// The next line that is not empty; none at the end.
  std::optional<std::string_view> next();
  std::size_t number() const { return number_; }   ///< of the last line, from 1
  std::string_view rest() const { return rest_; }  ///< what follows that line

 private:
  std::string_view rest_;
  char comment_;
  std::size_t number_ = 0;
};

/// Cuts the first word, up to blanks, off `text`; empty at the end.
std::string_view take_word(std::string_view& text);

/// The whole word as a finite number that single precision can hold.
std::optional<double> to_coordinate(std::string_view word);

/// The whole word as an integer.
std::optional<long long> to_integer(std::string_view word);

/// Three coordinates off the front of `text`; none when one is missing, no number or not finite.
bool take_point(std::string_view& text);

}  // namespace qjulia

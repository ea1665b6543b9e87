#pragma once
/// Outputs are checked before the work that fills them: nothing is computed in vain, and nothing of
/// the user's is overwritten.

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace qjulia::base {

/// A file that is to be written.
struct Output {
  std::string name;  ///< what the user calls it, such as an option; for messages
  std::filesystem::path path;
  std::vector<std::string> extensions{};  ///< its path must end in one, in any case; empty: any
  bool makes_folder = false;              ///< its folder will be made when it is missing
  bool must_be_new = false;               ///< nobody named it: a file that is there stays
};

/// Tries whether the output can be written, and leaves no trace but that temporary files of killed
/// processes are gone.
/// @throws InputError for an empty name, a wrong extension or a file that must stay, OutputError
/// when it cannot be written.
void check_writable(const Output& output);

/// @throws InputError when an output is an input or another output, by whatever names and links.
void check_distinct(std::span<const std::filesystem::path> inputs, std::span<const Output> outputs);

}  // namespace qjulia::base

#pragma once
/// Where settings, programs and results of tests are kept for this user.

#include <filesystem>
#include <string>

#include "qjulia/device/device.hpp"

namespace qjulia::device {

/// "qjulia" in the user's folder for caches. It need not exist.
/// @throws Error where the environment names no such folder.
std::filesystem::path cache_folder();

/// A hash of all embedded kernel files.
std::string kernels_hash();

/// One of the words of an environment variable, in any case; the first where it is not set.
/// @param meaning for the error, such as "on, to use what is kept, or off".
/// @throws InputError
std::string environment_word(const char* variable, std::initializer_list<const char*> words,
                             const char* meaning);

}  // namespace qjulia::device

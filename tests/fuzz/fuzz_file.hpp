#pragma once
/// Hands a fuzzer's bytes to a reader of files.

#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>

#include "qjulia/base/error.hpp"

namespace qjulia::test {

/// Calls `read` with a file that holds the bytes. It may refuse them with an InputError; anything
/// else that it throws ends the program.
template <class Read>
int fuzz_file(const std::uint8_t* data, std::size_t size, const std::string& extension, Read read) {
  static const std::filesystem::path file =
      "/dev/shm/qjulia_fuzz_" + std::to_string(::getpid()) + extension;
  std::ofstream(file, std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    read(file);
  } catch (const InputError&) {
  }
  return 0;
}

}  // namespace qjulia::test

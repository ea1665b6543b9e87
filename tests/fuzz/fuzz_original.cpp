// The papers' maps, .o3d and .poly4d: what is read is a valid map.

#include "fuzz_file.hpp"
#include "original/original_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return qjulia::test::fuzz_file(data, size, QJULIA_FUZZ_EXTENSION, [](const auto& file) {
    qjulia::original::read_original(file).validate();
  });
}

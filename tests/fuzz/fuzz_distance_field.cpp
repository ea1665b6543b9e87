// The papers' distance fields, .f3d.

#include "fuzz_file.hpp"
#include "original/original_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return qjulia::test::fuzz_file(
      data, size, ".f3d", [](const auto& file) { qjulia::original::read_sampled_distance(file); });
}

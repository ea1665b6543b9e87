// Maps within pictures and scenes: what is read is a valid map.

#include "fuzz_file.hpp"
#include "qjulia/map/map_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return qjulia::test::fuzz_file(data, size, QJULIA_FUZZ_EXTENSION,
                                 [](const auto& file) { qjulia::read_map(file).validate(); });
}

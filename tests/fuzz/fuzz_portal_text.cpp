// The papers' portals, as text.

#include "fuzz_file.hpp"
#include "original/original_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return qjulia::test::fuzz_file(data, size, ".txt", [](const auto& file) {
    qjulia::original::read_portal_text(file, qjulia::ShapeToMap{});
  });
}

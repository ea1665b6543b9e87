// Map files: what is read is a valid map, and comes back from its own text.

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "fuzz_file.hpp"
#include "qjulia/map/map_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return qjulia::test::fuzz_file(data, size, ".json", [](const auto& file) {
    const auto map = qjulia::read_map(file);
    map.validate();
    const auto text = qjulia::to_json(map);
    if (qjulia::to_json(qjulia::map_from_json(text, "again")) != text) std::abort();
  });
}

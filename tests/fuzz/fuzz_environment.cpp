// Radiance pictures (.hdr): what is read is twice as wide as high, and all of its light is finite.

#include <cstdlib>
#include <string_view>

#include "picture/environment.hpp"
#include "qjulia/base/error.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  // Run lengths let small files make large pictures. Those of 1000 columns or more are skipped:
  // they test nothing new.
  const std::size_t width = bytes.find("+X ");
  if (width != std::string_view::npos && bytes.substr(width + 3).find_first_of('\n') > 3) return 0;
  try {
    const auto made = qjulia::picture::environment_from_hdr(bytes);
    if (made.width != 2 * made.height) std::abort();
    if (made.radiance.size() != static_cast<std::size_t>(made.width) * made.height) std::abort();
    for (const auto& light : made.radiance) {
      if (!light.allFinite() || light.minCoeff() < 0) std::abort();
    }
  } catch (const qjulia::InputError&) {
  }
  return 0;
}

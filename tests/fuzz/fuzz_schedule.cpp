// Schedules of a user's own: what is read covers the budget in rising shares.

#include <cstdlib>

#include "fit/schedule.hpp"
#include "fuzz_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return qjulia::test::fuzz_file(data, size, ".toml", [](const auto& file) {
    const auto schedule = qjulia::fitting::find_schedule(file.string());
    double after = 0;
    for (const auto& level : schedule.levels) {
      if (!(level.until > after) || level.samples <= 0 || level.steps <= 0) std::abort();
      after = level.until;
    }
    if (after != 1 || schedule.evaluations <= 0) std::abort();
  });
}

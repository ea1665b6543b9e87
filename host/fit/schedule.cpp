#include "fit/schedule.hpp"

#include <fmt/format.h>

#include "qjulia/error.hpp"

namespace qjulia {
namespace {

/// The cell of the grid the stages' lengths are told in: 97 across a cube of side 4.
constexpr double kCell = 4.0 / 97;

const std::vector<Schedule>& schedules() {
  static const std::vector<Schedule> all = {
      // Regression to signed distance in a band that narrows about the surface.
      {"regression",
       6000,
       1e-3,
       {{"wide band", 1.0 / 3, 20000, 2 * kCell, 0.4, 60, 8},
        {"band", 0.55, 20000, kCell, 1.5, 60, 8},
        {"settling band", 2.0 / 3, 20000, kCell, 1.5, 60, 0},
        {"narrow band", 1.0, 40000, 0.6 * kCell, 4.0, 60, 0}}},
  };
  return all;
}

}  // namespace

const Schedule& find_schedule(const std::string& name) {
  std::string names;
  for (const Schedule& schedule : schedules()) {
    if (schedule.name == name) return schedule;
    names += ' ' + schedule.name;
  }
  throw InputError(
      fmt::format("--schedule: there is none named '{}'; choose from:{}", name, names));
}

}  // namespace qjulia

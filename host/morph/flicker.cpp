#include <algorithm>
#include <deque>
#include <utility>

#include "base/range_check.hpp"
#include "lattice/level_set.hpp"
#include "map/checks.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/morph/morph.hpp"

namespace qjulia {
namespace {

/// A step is judged by itself, the one before and two after it.
constexpr std::size_t kJudgedTogether = 4;

}  // namespace

struct FlickerMeter::Impl {
  Device device;
  surface::Grid grid;  ///< centres of the cells
  int iterations;
  std::deque<std::vector<bool>> sides{};  ///< of the last steps
  Flicker total{};                        ///< sums of shares

  void judge() {
    const std::vector<bool>&before = sides[0], &now = sides[1];
    std::size_t changed = 0, back = 0;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (now[i] == before[i]) continue;
      ++changed;
      if (sides[2][i] == before[i] || sides[3][i] == before[i]) ++back;
    }
    const auto cells = static_cast<double>(now.size());
    const double share = static_cast<double>(back) / cells;
    total.mean += share;
    total.worst = std::max(total.worst, share);
    total.changed += static_cast<double>(changed) / cells;
    ++total.steps;
  }
};

FlickerMeter::FlickerMeter(const Device& device, const Box& box, int cells, int iterations) {
  base::expect_between("cells", cells, kLeastFlickerCells, kMostFlickerCells);
  base::expect_between("iterations", iterations, 1, kMostIterations);
  map::expect_box(box);
  const double step = box.size().maxCoeff() / cells;
  const Eigen::Array3d counts = (box.size().array() / step).round().max(1.0);
  const surface::Grid grid{box.center() - 0.5 * step * (counts - 1).matrix(), step,
                           counts.cast<int>()};
  impl_ = std::make_unique<Impl>(Impl{device, grid, iterations});
}

FlickerMeter::~FlickerMeter() = default;
FlickerMeter::FlickerMeter(FlickerMeter&&) noexcept = default;
FlickerMeter& FlickerMeter::operator=(FlickerMeter&&) noexcept = default;

void FlickerMeter::add(const Map& map, const std::stop_token& stop) {
  map.validate();
  const StopRadii stops = find_stop_radii(impl_->device, map, {}, stop);
  const surface::LevelSet set(impl_->device, map, stops, impl_->iterations);
  const auto level = static_cast<float>(map.dynamics.surface_level);
  std::vector<bool> inside;
  const surface::Grid& grid = impl_->grid;
  const int at_once = surface::slices_at_once(grid);
  for (int z = 0; z < grid.points.z(); z += at_once) {
    throw_if_stopped(stop);
    const int count = std::min(at_once, grid.points.z() - z);
    for (const float f : set.over(grid, surface::slices(grid, z, count))) {
      inside.push_back(f < level);
    }
  }
  impl_->sides.push_back(std::move(inside));
  if (impl_->sides.size() < kJudgedTogether) return;
  impl_->judge();
  impl_->sides.pop_front();
}

Flicker FlickerMeter::flicker() const {
  Flicker flicker = impl_->total;
  if (flicker.steps > 0) {
    flicker.mean /= flicker.steps;
    flicker.changed /= flicker.steps;
  }
  return flicker;
}

}  // namespace qjulia

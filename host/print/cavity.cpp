#include "print/cavity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh/triangle_tree.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::surface {
namespace {

constexpr double kStepsAShell = 4;
constexpr std::size_t kMostCavityPoints = std::size_t{1} << 27;
/// Distances from the cavity are known up to so many steps.
constexpr float kCavityReach = 2;
/// Some part of a step, so that no line of the grid runs along the mesh's own.
constexpr double kCavityMargin = 3.4231;

/// The points that hang together with `start` by way of points below 0; marks them.
std::vector<std::size_t> part_from(const SlabField& field, std::size_t start,
                                   std::vector<bool>& seen) {
  std::vector<std::size_t> part{start};
  seen[start] = true;
  for (std::size_t next = 0; next < part.size(); ++next) {
    const Eigen::Vector3i index = index_of(part[next], field.points);
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        const Eigen::Vector3i at = index + step * Eigen::Vector3i::Unit(axis);
        if (at[axis] < 0 || at[axis] >= field.points[axis]) continue;
        const std::size_t number = number_of(at, field.points);
        if (seen[number] || field.values[number] >= 0) continue;
        seen[number] = true;
        part.push_back(number);
      }
    }
  }
  return part;
}

/// @throws OptionError when the grid would be too fine.
Grid cavity_grid(const Box& box, double shell) {
  const double step = shell / kStepsAShell;
  const double points = (box.size().array() / step + 2 * kCavityMargin + 2).prod();
  if (!(points <= static_cast<double>(kMostCavityPoints))) {
    throw OptionError("shell", fmt::format("{} is too thin for a mesh {} long; give a thicker one",
                                           shell, box.size().maxCoeff()));
  }
  return grid_around(box, step, kCavityMargin);
}

}  // namespace

Cavity::Cavity(const TriangleMesh& body, double shell, double drain, const std::stop_token& stop)
    : grid_(cavity_grid(body.box(), shell)) {
  const SlabField near = MeshInGrid(body, grid_).distances(0, grid_.points.z(), stop);
  const auto thick = static_cast<float>(kStepsAShell);
  values_ = depths(near, thick + kCavityReach, Grooves::all, stop);
  for (float& value : values_.values)
    value = std::clamp(thick - value, -kCavityReach, kCavityReach);
  measure_walls(body, stop);
  keep_largest_part();
  if (volume_ == 0) {
    throw OptionError("shell", fmt::format("{} leaves no cavity; give a thinner one", shell));
  }
  if (drain > 0) bore(near, shell, drain);
}

void Cavity::measure_walls(const TriangleMesh& body, const std::stop_token& stop) {
  const shape::TriangleTree surface(body, stop);
  for_each_point(values_, stop, [&](std::size_t number, const Eigen::Vector3i& index) {
    float& value = values_.values[number];
    if (std::abs(value) >= kCavityReach) return;
    const double wall = surface.nearest(grid_.point(index)).distance / grid_.step;
    value = static_cast<float>(kStepsAShell - wall);
  });
}

void Cavity::keep_largest_part() {
  std::vector<bool> seen(values_.values.size());
  std::vector<std::size_t> largest;
  for (std::size_t i = 0; i < values_.values.size(); ++i) {
    if (seen[i] || values_.values[i] >= 0) continue;
    auto part = part_from(values_, i, seen);
    auto& filled = part.size() > largest.size() ? largest : part;
    for (const std::size_t number : filled) values_.values[number] = kCavityReach;
    if (part.size() > largest.size()) largest = std::move(part);
  }
  volume_ = static_cast<double>(largest.size()) * std::pow(grid_.step, 3);
}

void Cavity::bore(const SlabField& near, double shell, double diameter) {
  const auto& values = values_.values;
  // The deepest of the points in the lowest slice that has any.
  const std::size_t slice = slices(grid_, 0, 1).size();
  const auto first = std::ranges::find_if(values, [](float value) { return value < 0; });
  const auto lowest = static_cast<std::size_t>(first - values.begin()) / slice;
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(lowest * slice);
  const auto start = std::min_element(begin, begin + static_cast<std::ptrdiff_t>(slice));
  const Eigen::Vector3i index =
      index_of(static_cast<std::size_t>(start - values.begin()), grid_.points);
  const Eigen::Vector3d from = grid_.point(index);
  axis_ = from.head<2>();
  radius_ = diameter / 2;
  top_ = from.z() + radius_;
  // Straight down from each point of the hole, the first one that is outside; what lies farther
  // down is another part of the body.
  const auto exit_from = [&](Eigen::Vector3i at) {
    while (at.z() > 0 && near.values[number_of(at, grid_.points)] < 0) --at.z();
    return grid_.point(at).z();
  };
  double lowest_exit = exit_from(index);
  const double least = lowest_exit - shell - diameter;  // along a steep wall there may be none
  const int reach = static_cast<int>(std::ceil(radius_ / grid_.step));
  for_around({grid_.points.x(), grid_.points.y(), 1}, {index.x(), index.y(), 0}, reach,
             [&](std::size_t, const Eigen::Vector3i& across) {
               const Eigen::Vector3i at(across.x(), across.y(), index.z());
               if ((grid_.point(at) - from).norm() > radius_ + grid_.step) return;
               lowest_exit = std::min(lowest_exit, exit_from(at));
             });
  bottom_ = std::max(lowest_exit - 0.5 * grid_.step, least);
}

double Cavity::at(const Eigen::Vector3d& x) const {
  const double limit = kCavityReach * grid_.step;
  double hole = limit;
  if (radius_ > 0) {
    hole = std::max({(x.head<2>() - axis_).norm() - radius_, x.z() - top_, bottom_ - x.z()});
  }
  const Eigen::Array3d place = (x - grid_.origin).array() / grid_.step;
  const Eigen::Array3i low = place.floor().cast<int>();
  if ((low < 0).any() || (low + 1 >= grid_.points.array()).any()) return std::min(hole, limit);
  const Eigen::Array3d part = place - low.cast<double>();
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Array3i bits(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
    const Eigen::Array3d weights = (bits == 1).select(part, 1 - part);
    sum += weights.prod() * double{values_.values[number_of(low + bits, grid_.points)]};
  }
  return std::min(hole, sum * grid_.step);
}

}  // namespace qjulia::surface

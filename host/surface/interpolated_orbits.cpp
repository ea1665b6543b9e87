#include "surface/interpolated_orbits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>

#include "device/point_batch.hpp"
#include "layout/settling.h"
#include "surface/grid_block.hpp"

namespace qjulia::surface {
namespace {

/// Fewer points than this are iterated at once.
constexpr std::size_t kFewest = 1024;
/// Points that the lattice's spacing is chosen by.
constexpr std::size_t kProbes = 128;
/// Where the versor turns t radians from a grid point to the next, as the median, nodes lie
/// (kTurn / t)^kTurnPower steps apart. Farther apart, more points are left to iterate; nearer,
/// there are more nodes, which matters the less the finer the grid. Measured at 512 and 1024 cells.
constexpr double kTurn = 0.65;
constexpr double kTurnPower = 0.7;
constexpr int kWidestSpacing = 32;
/// Points this near a factor's centre along each axis, in distances of nodes, are left out.
constexpr double kClearance = 1.5;

/// Fills the last work-item's lanes with its last number.
void fill_lanes(std::vector<std::int32_t>& numbers, std::size_t lanes) {
  numbers.resize((numbers.size() + lanes - 1) / lanes * lanes, numbers.back());
}

/// Both rising.
std::vector<std::int32_t> without(std::vector<std::int32_t> numbers,
                                  std::span<const std::int32_t> some) {
  if (some.empty()) return numbers;
  std::vector<std::int32_t> others;
  std::ranges::set_difference(numbers, some, std::back_inserter(others));
  return others;
}

}  // namespace

/// F and U of points, on the device.
template <class Real>
struct InterpolatedOrbits<Real>::Images {
  device::Buffer<Real> field;
  device::Buffer<Real> versors;  ///< four reals each
  device::Buffer<Real> change;   ///< by how much fewer nodes give others; interpolated ones only
};

template <class Real>
InterpolatedOrbits<Real>::InterpolatedOrbits(const map::DeviceMap& map, const Grid& grid,
                                             const GridBlock& block, double below, double level,
                                             double above)
    : map_(map),
      grid_(grid),
      block_(block),
      below_(static_cast<Real>(below)),
      level_(static_cast<Real>(level)),
      above_(static_cast<Real>(above)) {}

/// Of the points of these numbers in the block of every `spacing`-th point; point i in slot
/// slots[i] of `size`.
template <class Real>
auto InterpolatedOrbits<Real>::images(const GridBlock& block, int spacing,
                                      std::vector<std::int32_t> numbers,
                                      std::vector<std::int32_t> slots, std::size_t size) const
    -> Images {
  auto& context = map_.context();
  const auto kernel = map_.kernel("interpolated_orbit.cl", "block_images");
  fill_lanes(numbers, map_.lanes());
  fill_lanes(slots, map_.lanes());
  const auto from = context.upload<std::int32_t>(numbers);
  const auto to = context.upload<std::int32_t>(slots);
  Images made{context.allocate<Real>(size), context.allocate<Real>(4 * size), {}};
  const device::Argument points = grid_block(grid_, block, map_.precision());
  device::launch_in_parts(context, kernel, map_.groups(numbers.size()),
                          map_.step_cost() * map_.points_per_item(),
                          [&](std::size_t first, std::size_t count) {
                            return std::vector<device::Argument>{from,
                                                                 to,
                                                                 points,
                                                                 spacing,
                                                                 device::narrow(first),
                                                                 device::narrow(count),
                                                                 map_.buffer(),
                                                                 map_.factors(),
                                                                 made.field,
                                                                 made.versors};
                          });
  return made;
}

/// Where the lattice's columns meet the block's rows.
template <class Real>
auto InterpolatedOrbits<Real>::in_rows(const NodeLattice& lattice) const -> Images {
  auto& context = map_.context();
  const Images nodes = images(lattice.nodes, lattice.spacing, lattice.needed_nodes,
                              lattice.needed_nodes, lattice.nodes.size());
  std::vector<std::int32_t> numbers = lattice.needed_meetings;
  fill_lanes(numbers, map_.lanes());
  const auto sent = context.upload<std::int32_t>(numbers);
  const std::size_t size = lattice.meetings();
  Images made{context.allocate<Real>(size), context.allocate<Real>(4 * size),
              context.allocate<Real>(size)};
  const std::size_t groups = map_.groups(numbers.size());
  context.launch(
      map_.kernel("interpolated_orbit.cl", "interpolate_rows"), {{groups, 1, 1}},
      {sent, lattice.nodes.count[0], lattice.nodes.count[1], lattice.rows, lattice.spacing,
       nodes.field, nodes.versors, device::narrow(groups), made.field, made.versors, made.change});
  return made;
}

template <class Real>
std::vector<Real> InterpolatedOrbits<Real>::settled(const NodeLattice& lattice,
                                                    std::vector<std::int32_t> numbers) const {
  auto& context = map_.context();
  const Images rows = in_rows(lattice);
  std::vector<Real> found(numbers.size());
  fill_lanes(numbers, map_.lanes());
  const auto sent = context.upload<std::int32_t>(numbers);
  const auto values = context.allocate<Real>(numbers.size());
  const auto kernel = map_.kernel("interpolated_orbit.cl", "settle_points");
  const device::Argument points = grid_block(grid_, block_, map_.precision());
  const device::Argument settling = device::arguments(map_.precision(), [&](auto r) {
    using real = decltype(r);
    return qj_settling<real>{.below = real(below_),
                             .level = real(level_),
                             .above = real(above_),
                             .node_columns = lattice.nodes.count[0],
                             .spacing = lattice.spacing};
  });
  device::launch_in_parts(context, kernel, map_.groups(numbers.size()),
                          map_.modulus_cost() * map_.points_per_item(),
                          [&](std::size_t first, std::size_t count) {
                            return std::vector<device::Argument>{sent,
                                                                 points,
                                                                 settling,
                                                                 rows.field,
                                                                 rows.versors,
                                                                 rows.change,
                                                                 device::narrow(first),
                                                                 device::narrow(count),
                                                                 map_.buffer(),
                                                                 map_.factors(),
                                                                 values};
                          });
  context.read<Real>(values, found);
  return found;
}

/// Grid steps from node to node, by how the versor turns along x and y: from a sample of the points
/// to their neighbours.
template <class Real>
int InterpolatedOrbits<Real>::spacing(std::span<const std::int32_t> numbers) const {
  const std::int32_t row = block_.count[0];
  const std::int32_t slice = row * block_.count[1];
  std::vector<std::int32_t> points;
  for (std::size_t i = 0; i < kProbes; ++i) {
    const std::int32_t number = numbers[i * numbers.size() / kProbes];
    points.push_back(number);
    points.push_back(number % row + 1 < row ? number + 1 : number - 1);
    points.push_back(number % slice + row < slice ? number + row : number - row);
  }
  std::vector<std::int32_t> slots(points.size());
  std::iota(slots.begin(), slots.end(), 0);
  std::vector<Real> u(4 * points.size());
  map_.context().template read<Real>(images(block_, 1, points, slots, points.size()).versors, u);
  double widest = 0;
  for (const std::size_t neighbour : {std::size_t{4}, std::size_t{8}}) {
    std::array<double, kProbes> turns{};
    for (std::size_t i = 0; i < kProbes; ++i) {
      double dot = 0;
      for (std::size_t c = 12 * i; c < 12 * i + 4; ++c) {
        dot += static_cast<double>(u[c] * u[c + neighbour]);
      }
      turns[i] = std::acos(std::clamp(std::abs(dot), 0.0, 1.0));
    }
    std::ranges::nth_element(turns, turns.begin() + kProbes / 2);
    widest = std::max(widest, turns[kProbes / 2]);
  }
  const double steps = std::pow(kTurn / std::max(widest, 1e-6), kTurnPower);
  return static_cast<int>(std::lround(std::min<double>(kWidestSpacing, steps)));
}

/// Of these numbers those of points within kClearance node distances of a factor's centre, along
/// each axis.
template <class Real>
std::vector<std::int32_t> InterpolatedOrbits<Real>::near_factors(
    std::span<const std::int32_t> numbers, int spacing) const {
  const double reach = kClearance * spacing;  // grid steps
  std::vector<bool> marks;                    // of the block's points
  for (const Quaternion& c : map_.centers()) {
    if (std::abs(c.w - map_.slice()) > reach * grid_.step) continue;
    const Eigen::Vector3d center =
        (Eigen::Vector3d(c.x, c.y, c.z) - grid_.origin) / grid_.step -
        Eigen::Vector3d(block_.first[0], block_.first[1], block_.first[2]);
    // Points low … high − 1 along each axis.
    std::array<int, 3> low{}, high{};
    bool empty = false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double c_axis = center[static_cast<Eigen::Index>(axis)];
      const double last = block_.count[axis];
      low[axis] = static_cast<int>(std::clamp(std::ceil(c_axis - reach), 0.0, last));
      high[axis] = static_cast<int>(std::clamp(std::floor(c_axis + reach) + 1, 0.0, last));
      empty = empty || low[axis] >= high[axis];
    }
    if (empty) continue;
    marks.resize(block_.size());
    for (int z = low[2]; z < high[2]; ++z) {
      for (int y = low[1]; y < high[1]; ++y) {
        const std::ptrdiff_t row =
            (std::ptrdiff_t{z} * block_.count[1] + y) * std::ptrdiff_t{block_.count[0]};
        std::fill(marks.begin() + row + low[0], marks.begin() + row + high[0], true);
      }
    }
  }
  std::vector<std::int32_t> near;
  if (marks.empty()) return near;
  std::ranges::copy_if(numbers, std::back_inserter(near), [&](std::int32_t number) {
    return marks[static_cast<std::size_t>(number)];
  });
  return near;
}

template <class Real>
std::vector<std::int32_t> InterpolatedOrbits<Real>::settle(std::span<const std::int32_t> numbers,
                                                           std::span<float> values) {
  std::vector<std::int32_t> others(numbers.begin(), numbers.end());
  if (numbers.size() < kFewest || block_.count[0] < 2 || block_.count[1] < 2) return others;
  const int step = spacing(numbers);
  if (step < 2) return others;
  const std::vector<std::int32_t> near = near_factors(numbers, step);
  if (near.size() == numbers.size()) return others;
  std::vector<std::int32_t> asking = without(std::move(others), near);
  const NodeLattice lattice = node_lattice(block_, step, asking);
  nodes_ += lattice.needed_nodes.size();
  const std::vector<Real> found = settled(lattice, asking);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] < below_ || found[i] > above_) {
      values[static_cast<std::size_t>(asking[i])] = static_cast<float>(found[i]);
    } else {
      asking[kept++] = asking[i];
    }
  }
  asking.resize(kept);
  if (near.empty()) return asking;
  others.clear();
  std::ranges::merge(asking, near, std::back_inserter(others));
  return others;
}

template class InterpolatedOrbits<float>;
template class InterpolatedOrbits<double>;

}  // namespace qjulia::surface

#include "lattice/interpolated_orbits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "device/point_batch.hpp"
#include "lattice/level_set.hpp"
#include "lattice/node_lattice.hpp"
#include "layout/grid_block.h"
#include "layout/settling.h"

namespace qjulia::surface {
namespace {

/// Fewer points than this are iterated at once.
constexpr std::size_t kFewest = 1024;
/// How many points are iterated to choose the lattice's spacing.
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
void fill_lanes(const map::DeviceMap& map, std::vector<std::int32_t>& numbers) {
  numbers.resize(map.groups(numbers.size()) * map.lanes(), numbers.back());
}

/// What `settle_by_interpolation` does, with the map's reals.
template <class Real>
class InterpolatedOrbits {
 public:
  InterpolatedOrbits(const map::DeviceMap& map, const Grid& grid, const GridBlock& block,
                     double below, double level, double above)
      : map_(map),
        grid_(grid),
        block_(block),
        below_(static_cast<Real>(below)),
        level_(static_cast<Real>(level)),
        above_(static_cast<Real>(above)) {}

  Unsettled settle(std::span<const std::int32_t> numbers, std::span<float> values) {
    const auto all = [&] { return Unsettled{{numbers.begin(), numbers.end()}}; };
    if (numbers.size() < kFewest || block_.count[0] < 2 || block_.count[1] < 2) return all();
    const int step = spacing(numbers);
    if (step < 2) return all();
    const std::vector<std::int32_t> near = near_factors(numbers, step);
    if (near.size() == numbers.size()) return all();
    std::vector<std::int32_t> asking;
    asking.reserve(map_.groups(numbers.size()) * map_.lanes());
    if (near.empty()) {
      asking.assign(numbers.begin(), numbers.end());
    } else {
      std::ranges::set_difference(numbers, near, std::back_inserter(asking));
    }
    const NodeLattice lattice = node_lattice(block_, step, asking);
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
    Unsettled others{{}, lattice.needed_nodes.size()};
    std::ranges::merge(asking, near, std::back_inserter(others.numbers));
    return others;
  }

 private:
  /// F of so many points and U, four reals each, on the device.
  struct Images {
    device::Buffer<Real> field, versors;
  };
  Images images(std::size_t size) const {
    auto& context = map_.context();
    return {context.template allocate<Real>(size), context.template allocate<Real>(4 * size)};
  }

  /// F where that is certain. @param numbers its last work-item's lanes are filled.
  std::vector<Real> settled(const NodeLattice& lattice, std::vector<std::int32_t>& numbers) const {
    auto& context = map_.context();
    const Images nodes = images(lattice.nodes.size());
    block_images(map_, grid_, lattice.nodes, lattice.spacing, lattice.needed_nodes,
                 lattice.needed_nodes, nodes.field, nodes.versors);

    // Where the lattice's columns meet the block's rows.
    std::vector<std::int32_t> meetings = lattice.needed_meetings;
    fill_lanes(map_, meetings);
    const auto sent_meetings = context.upload<std::int32_t>(meetings);
    const Images rows = images(lattice.meetings());
    // How much the values change when fewer nodes are used.
    const auto change = context.allocate<Real>(lattice.meetings());
    const std::size_t groups = map_.groups(meetings.size());
    context.launch(map_.kernel("interpolated_orbit.cl", "interpolate_rows"), {{groups, 1, 1}},
                   {sent_meetings, lattice.nodes.count[0], lattice.nodes.count[1], lattice.rows,
                    lattice.spacing, nodes.field, nodes.versors, device::narrow(groups), rows.field,
                    rows.versors, change},
                   device::moving(36 * static_cast<double>(meetings.size())));

    std::vector<Real> found(numbers.size());
    fill_lanes(map_, numbers);
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
    const auto call = [&](std::size_t first, std::size_t count) {
      return device::PartCall{
          {sent, points, settling, rows.field, rows.versors, change, device::narrow(first),
           device::narrow(count), map_.buffer(), map_.factors(), values},
          device::moving(2 * static_cast<double>(count) * map_.points_per_item())};
    };
    device::launch_in_parts(context, kernel, map_.groups(numbers.size()),
                            map_.modulus_cost() * map_.points_per_item(), call);
    context.read<Real>(values, found);
    return found;
  }

  /// Grid steps from node to node, by how the versor turns along x and y: from a sample of the
  /// points to their neighbours.
  int spacing(std::span<const std::int32_t> numbers) const {
    const std::int32_t row = block_.count[0];
    const std::int32_t slice = row * block_.count[1];
    std::vector<std::int32_t> points;
    for (std::size_t i = 0; i < kProbes; ++i) {
      const std::int32_t number = numbers[i * numbers.size() / kProbes];
      points.push_back(number);
      points.push_back(number % row + 1 < row ? number + 1 : number - 1);
      points.push_back(number % slice + row < slice ? number + row : number - row);
    }
    std::vector<Real> u(4 * points.size());
    const Images made = images(points.size());
    block_images(map_, grid_, block_, 1, points, all_numbers(points.size()), made.field,
                 made.versors);
    map_.context().template read<Real>(made.versors, u);
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

  /// The numbers among these whose points lie within kClearance node distances of a factor's centre
  /// along each axis.
  std::vector<std::int32_t> near_factors(std::span<const std::int32_t> numbers, int spacing) const {
    const double reach = kClearance * spacing;  // grid steps
    std::vector<bool> marks;                    // one for each point of the block
    for (const Quaternion& c : map_.centers()) {
      if (std::abs(c.w - map_.slice()) > reach * grid_.step) continue;
      const Eigen::Array3d center = (Eigen::Vector3d(c.x, c.y, c.z) - grid_.origin) / grid_.step -
                                    block_.first.cast<double>();
      // Points low … high − 1 along each axis.
      const Eigen::Array3d last = block_.count.cast<double>();
      const Eigen::Array3i low = (center - reach).ceil().max(0.0).min(last).cast<int>();
      const Eigen::Array3i high = ((center + reach).floor() + 1).max(0.0).min(last).cast<int>();
      if ((low >= high).any()) continue;
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

  const map::DeviceMap& map_;
  const Grid& grid_;
  const GridBlock& block_;
  Real below_, level_, above_;
};

}  // namespace

device::Argument grid_block(const Grid& grid, const GridBlock& block, Precision precision) {
  return device::arguments(precision, [&](auto r) {
    using real = decltype(r);
    return qj_grid_block<real>{.origin_x = real(grid.origin.x()),
                               .origin_y = real(grid.origin.y()),
                               .origin_z = real(grid.origin.z()),
                               .step = real(grid.step),
                               .nx = block.count[0],
                               .ny = block.count[1],
                               .ix = block.first[0],
                               .iy = block.first[1],
                               .iz = block.first[2]};
  });
}

void block_images(const map::DeviceMap& map, const Grid& grid, const GridBlock& block, int spacing,
                  std::vector<std::int32_t> numbers, std::vector<std::int32_t> slots,
                  const device::Memory& field, const device::Memory& versors) {
  auto& context = map.context();
  fill_lanes(map, numbers);
  fill_lanes(map, slots);
  const auto from = context.upload<std::int32_t>(numbers);
  const auto to = context.upload<std::int32_t>(slots);
  const device::Argument points = grid_block(grid, block, map.precision());
  const auto call = [&](std::size_t first, std::size_t count) {
    return device::PartCall{{from, to, points, spacing, device::narrow(first),
                             device::narrow(count), map.buffer(), map.factors(), field, versors},
                            map.work(count * map.lanes(), cost::kStep, 7)};
  };
  device::launch_in_parts(context, map.kernel("interpolated_orbit.cl", "block_images"),
                          map.groups(numbers.size()), map.step_cost() * map.points_per_item(),
                          call);
}

Unsettled settle_by_interpolation(const map::DeviceMap& map, const Grid& grid,
                                  const GridBlock& block, double below, double level, double above,
                                  std::span<const std::int32_t> numbers, std::span<float> values) {
  const auto settle = [&](auto real) {
    return InterpolatedOrbits<decltype(real)>(map, grid, block, below, level, above)
        .settle(numbers, values);
  };
  return map.precision() == Precision::dbl ? settle(double{}) : settle(float{});
}

}  // namespace qjulia::surface

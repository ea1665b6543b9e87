#include "lattice/image_lattice.hpp"

#include <algorithm>
#include <cmath>

#include "device/point_batch.hpp"
#include "lattice/grid_layout.hpp"
#include "lattice/level_set.hpp"
#include "layout/image_lattice.h"
#include "qjulia/base/progress.hpp"

namespace qjulia::surface {
namespace {

/// Interpolation between nodes from one of which to the next U turns by h radians is off by about
/// kError h⁴, as the median.
constexpr double kError = 0.07;
/// Nodes that are computed between two looks at the stop token: about half a second's work.
constexpr std::size_t kNodesAtOnce = std::size_t{1} << 17;
/// Radians from node to node.
constexpr double kNearest = 0.1, kFarthest = 0.8;
/// A lattice whose nodes would lie more than this many times as far apart as they should serves too
/// few cells to be worth making.
constexpr double kCoarsest = 1.6;
/// A lattice made for this many times the displacement serves as well.
constexpr double kServedSlack = 1.5;
/// Nodes in the whole box: any number is affordable below the first, and memory limits it above the
/// second.
constexpr double kFewestNodes = 3e5, kMostNodes = 12e6;

/// The nodes that these cells are interpolated from.
std::vector<std::int32_t> nodes_of(const Grid& grid, const std::vector<std::int32_t>& cells) {
  std::vector<bool> needed(whole(grid).size());
  const int row = grid.points[0], slice = row * grid.points[1];
  for (const std::int32_t cell : cells) {
    for (int k = -1; k <= 2; ++k) {
      for (int j = -1; j <= 2; ++j) {
        const auto first = needed.begin() + (cell + k * slice + j * row - 1);
        std::fill(first, first + 4, true);
      }
    }
  }
  std::vector<std::int32_t> nodes;
  for (std::size_t i = 0; i < needed.size(); ++i) {
    if (needed[i]) nodes.push_back(device::narrow(i));
  }
  return nodes;
}

constexpr auto kPageNodes = static_cast<std::size_t>(int{QJ_LATTICE_PAGE_NODES});

/// Pages of a level (layout/image_lattice.h).
std::size_t pages_of(const Grid& grid) {
  return (whole(grid).size() + kPageNodes - 1) / kPageNodes;
}

/// Where the nodes of all levels are stored (layout/image_lattice.h).
class Storage {
 public:
  /// @param pages of all levels.
  explicit Storage(std::size_t pages)
      : empty_(device::narrow(pages)), places_(pages + QJ_LATTICE_PAGE) {
    std::fill_n(places_.begin(), pages, empty_);
  }

  /// The slots of the next level's nodes. @param nodes numbers of those to store, rising.
  std::vector<std::int32_t> add(const std::vector<std::int32_t>& nodes, std::size_t pages) {
    std::vector<std::int32_t> slots(nodes.size());
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const auto node = static_cast<std::size_t>(nodes[i]);
      const std::size_t page = first_ + node / kPageNodes;
      if (places_[page] == empty_) {
        places_[page] = device::narrow(places_.size());
        places_.resize(places_.size() + QJ_LATTICE_PAGE);
      }
      std::int32_t& group = places_[static_cast<std::size_t>(places_[page]) +
                                    node / QJ_LATTICE_GROUP % QJ_LATTICE_PAGE];
      const std::int32_t member = nodes[i] % QJ_LATTICE_GROUP;
      if (group == 0) {
        group = device::narrow(size_ << QJ_LATTICE_GROUP);
        size_ += QJ_LATTICE_GROUP;
      }
      group |= 1 << member;
      slots[i] = (group >> QJ_LATTICE_GROUP) + member;
    }
    first_ += pages;
    return slots;
  }
  /// The pages' first entries, then the places of groups of nodes.
  const std::vector<std::int32_t>& places() const { return places_; }
  /// How many slots there are, those that stay empty included.
  std::size_t size() const { return size_; }

 private:
  std::int32_t empty_;  ///< where the page without a node begins
  std::vector<std::int32_t> places_;
  std::size_t first_ = 0;  ///< the next level's first page
  std::size_t size_ = 0;
};

}  // namespace

std::vector<double> ImageLattice::layout_of(std::span<const Level> levels) {
  std::vector<double> layout;
  std::size_t pages = 0;
  for (const Level& level : levels) {
    const std::vector<double> grid = grid_layout(level.grid);
    const std::size_t first = layout.size();
    layout.resize(first + QJ_LEVEL_SIZE);
    std::ranges::copy(grid, layout.begin() + static_cast<std::ptrdiff_t>(first));
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (Eigen::Index c = 0; c < 3; ++c) {
        layout[first + QJ_LEVEL_AXES + static_cast<std::size_t>(3 * axis + c)] =
            level.axes(axis, c);
      }
    }
    layout[first + QJ_LEVEL_ITERATES] = level.iterates;
    layout[first + QJ_LEVEL_PAGES] = static_cast<double>(pages);
    layout[first + QJ_LEVEL_FOLLOWED] = &level == &levels.back() ? 0 : 1;
    pages += pages_of(level.grid);
  }
  return layout;
}

namespace {

/// Computes the images of these nodes of level number `number`.
void compute_images(const map::DeviceMap& map, const ImageLattice& lattice, int number,
                    int iterates, const std::vector<std::int32_t>& nodes,
                    const std::vector<std::int32_t>& slots, const std::stop_token& stop) {
  device::Context& context = map.context();
  const device::Kernel kernel = map.kernel("image_lattice.cl", "composed_images");
  for (std::size_t first = 0; first < nodes.size(); first += kNodesAtOnce) {
    throw_if_stopped(stop);
    const std::size_t last = std::min(first + kNodesAtOnce, nodes.size());
    const auto part = [&](const std::vector<std::int32_t>& all) {
      std::vector<std::int32_t> some(all.begin() + static_cast<std::ptrdiff_t>(first),
                                     all.begin() + static_cast<std::ptrdiff_t>(last));
      some.resize(map.groups(some.size()) * map.lanes(), some.back());
      return context.upload<std::int32_t>(some);
    };
    const auto from = part(nodes), to = part(slots);
    const auto call = [&](std::size_t begin, std::size_t count) {
      // A level's images go on from those of the level before, but for one iterate.
      return device::PartCall{{from, to, lattice.layout(), number * QJ_LEVEL_SIZE, lattice.places(),
                               lattice.trusted(), device::narrow(begin), device::narrow(count),
                               map.buffer(), map.factors(), lattice.field(), lattice.versors()},
                              map.work(count * map.lanes(), cost::kStep, 9)};
    };
    device::launch_in_parts(context, kernel, map.groups(last - first),
                            iterates * map.step_cost() * map.points_per_item(), call);
    context.finish();
  }
}

}  // namespace

ImageLattice::ImageLattice(const map::DeviceMap& map)
    : layout_(map.context().upload_real(std::vector<double>(QJ_LEVEL_SIZE), map.precision())),
      field_(map.context().allocate_real(1, map.precision())),
      versors_(map.context().allocate_real(1, map.precision())),
      places_(map.context().allocate<std::int32_t>(1)),
      trusted_(map.context().allocate<std::uint8_t>(1)) {}

ImageLattice::ImageLattice(const map::DeviceMap& map, const Box& box, const CellsOf& cells_of,
                           const Fineness& fineness, const std::stop_token& stop)
    : ImageLattice(map) {
  box_ = box;
  displacement_ = fineness.displacement;
  const double most_nodes = std::clamp(fineness.most_nodes, kFewestNodes, kMostNodes);
  const double finest = std::cbrt(box.size().prod() / most_nodes);
  const double right = step_for(fineness.typical, fineness.stretch);
  const double step = std::max(right, finest);
  if (step > kCoarsest * right) return;
  Level level;
  level.displacement = fineness.displacement;
  level.grid = grid_about(box, step);
  level.cells = cells_of(level.grid);
  // The image moves stretch · e^F times as far as the point, and interpolation is off by a share
  // of e^F.
  const Allowed allowed{fineness.displacement * fineness.stretch, 0};
  make(
      map, std::span(&level, 1), [&](const Level&) { return allowed; }, stop);
}

ImageLattice::ImageLattice(const map::DeviceMap& map, std::span<const Level> levels,
                           const std::stop_token& stop)
    : ImageLattice(map) {
  if (levels.empty()) return;
  // What points are displaced by follows from how far images move there.
  make(
      map, levels,
      [](const Level& level) {
        return Allowed{0, level.displacement / level.grid.step};
      },
      stop);
}

Grid ImageLattice::grid_about(const Box& box, double step) {
  // Cells about the box with the nodes that they are interpolated from.
  Grid grid = grid_around(box, step, 1.5);
  grid.points.x() += -grid.points.x() & (QJ_LATTICE_GROUP - 1);  // whole groups of nodes
  return grid;
}

double ImageLattice::step_for(double typical, double stretch) {
  return std::clamp(std::pow(typical * stretch / kError, 0.25), kNearest, kFarthest) / stretch;
}

void ImageLattice::make(const map::DeviceMap& map, std::span<const Level> levels,
                        const AllowedOf& allowed_of, const std::stop_token& stop) {
  device::Context& context = map.context();
  layout_ = context.upload_real(layout_of(levels), map.precision());
  std::size_t pages = 0;
  for (const Level& level : levels) pages += pages_of(level.grid);
  Storage storage(pages);
  std::vector<std::vector<std::int32_t>> nodes, slots;
  std::size_t cells = 0;
  for (const Level& level : levels) {
    nodes.push_back(nodes_of(level.grid, level.cells));
    slots.push_back(storage.add(nodes.back(), pages_of(level.grid)));
    nodes_ += nodes.back().size();
    cells += level.cells.size();
  }
  std::vector<std::uint8_t> trusted(storage.places().size() * QJ_LATTICE_GROUP);
  trusted_ = context.upload<std::uint8_t>(trusted);
  if (cells == 0) return;
  iterates_ = levels.front().iterates;
  places_ = context.upload<std::int32_t>(storage.places());
  field_ = context.allocate_real(storage.size(), map.precision());
  versors_ = context.allocate_real(4 * storage.size(), map.precision());
  // A level's images go on from those of the levels after it.
  for (std::size_t i = levels.size(); i-- > 0;) {
    const Level& level = levels[i];
    if (level.cells.empty()) continue;
    const int iterates =
        i + 1 < levels.size() ? level.iterates - levels[i + 1].iterates : level.iterates;
    compute_images(map, *this, device::narrow(i), iterates, nodes[i], slots[i], stop);
    const Allowed allowed = allowed_of(level);
    context.launch(map.kernel("image_lattice.cl", "trust_cells"), {{level.cells.size(), 1, 1}, {}},
                   {context.upload<std::int32_t>(level.cells), device::narrow(level.cells.size()),
                    layout_, device::narrow(i * QJ_LEVEL_SIZE), places_, field_, versors_,
                    map.real(allowed.least), map.real(allowed.moves), trusted_},
                   device::moving(8 * 5 * static_cast<double>(level.cells.size())));
  }
  context.read(trusted_, std::span(trusted));
  trusted_share_ = static_cast<double>(std::ranges::count(trusted, 1)) / static_cast<double>(cells);
}

bool ImageLattice::serves(const Box& box, double displacement) const {
  return kServedSlack * displacement >= displacement_ &&
         (box_.low.array() <= box.low.array()).all() &&
         (box_.high.array() >= box.high.array()).all();
}

}  // namespace qjulia::surface

#include "lattice/image_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/median.hpp"
#include "device/point_batch.hpp"
#include "lattice/image_probe.hpp"
#include "layout/image_table.h"
#include "qjulia/map/field.hpp"

namespace qjulia::surface {
namespace {

/// Distances of nodes, map units.
constexpr double kFinestStep = 0.065, kCoarsestStep = 0.13;
/// Bricks along an axis: for memory's sake.
constexpr int kMostBricks = 30;
/// Bricks with data, of 3,750 bytes each: some devices allocate no more than 64 MiB at once.
constexpr std::size_t kMostKept = 20000;
/// F is stored from so far below the inner level to so far above the outer one.
constexpr double kBelow = 4, kAbove = 4;
/// Points at which the table is compared with the map.
constexpr std::size_t kTableProbes = 60000;
/// How far off F may be, over the most that it was found to be.
constexpr double kOverFound = 1.5;
/// What a look-up costs, in factors' logarithms.
constexpr double kTableLookUpCost = 20;

constexpr int kCells = QJ_TABLE_CELLS, kNodesASide = QJ_TABLE_SIDE;

/// Four counts: of nodes from the lattice's origin, or of bricks.
using Place = std::array<int, 4>;

/// The number of a place among `side` along each axis, X fastest.
std::size_t place_number(const Place& at, int side) {
  std::size_t number = 0;
  for (std::size_t axis = 4; axis-- > 0;) {
    number = number * static_cast<std::size_t>(side) + static_cast<std::size_t>(at[axis]);
  }
  return number;
}

Place place_of(std::size_t number, int side) {
  Place at{};
  for (int& i : at) {
    i = static_cast<int>(number % static_cast<std::size_t>(side));
    number /= static_cast<std::size_t>(side);
  }
  return at;
}

struct Lattice {
  double origin, step;
  int bricks;  ///< along an axis

  double brick() const { return step * kCells; }  ///< its side

  Point4 node(const Place& at) const {
    Point4 p{};
    std::ranges::transform(at, p.begin(), [&](int i) { return origin + step * i; });
    return p;
  }
  Point4 middle_of_brick(const Place& at) const {
    Point4 p{};
    std::ranges::transform(at, p.begin(), [&](int i) { return origin + brick() * (i + 0.5); });
    return p;
  }
};

/// Nodes, each with a number: they come in the order in which they are added.
class NodeList {
 public:
  explicit NodeList(const Lattice& lattice)
      : lattice_(lattice),
        blocks_(static_cast<std::size_t>(std::pow(lattice.bricks + 1, 4)), kNone) {}

  std::size_t size() const { return places_.size(); }
  /// The place of the node with this number.
  Place place(std::size_t number) const {
    Place at{};
    std::ranges::copy(places_[number], at.begin());
    return at;
  }
  Point4 point(std::size_t number) const { return lattice_.node(place(number)); }

  /// The node's number; it is added where it has none.
  std::int32_t add(const Place& at) {
    std::int32_t& block = blocks_[block_of(at)];
    if (block == kNone) {
      block = device::narrow(numbers_.size() / kBlock);
      numbers_.resize(numbers_.size() + kBlock, kNone);
    }
    std::int32_t& number = numbers_[slot_of(block, at)];
    if (number == kNone) {
      number = device::narrow(places_.size());
      SmallPlace& stored = places_.emplace_back();
      std::ranges::transform(at, stored.begin(), [](int i) { return static_cast<std::int8_t>(i); });
    }
    return number;
  }
  /// Its number; negative where it was not added.
  std::int32_t find(const Place& at) const {
    if (std::ranges::any_of(at, [&](int i) { return i < 0 || i > kCells * lattice_.bricks; })) {
      return kNone;
    }
    const std::int32_t block = blocks_[block_of(at)];
    return block == kNone ? kNone : numbers_[slot_of(block, at)];
  }

 private:
  /// There are millions of nodes.
  using SmallPlace = std::array<std::int8_t, 4>;
  static_assert(kCells * kMostBricks <= std::numeric_limits<std::int8_t>::max());
  static constexpr std::int32_t kNone = -1;
  static constexpr std::size_t kBlock = std::size_t{kCells} * kCells * kCells * kCells;

  std::size_t block_of(Place at) const {
    for (int& i : at) i /= kCells;
    return place_number(at, lattice_.bricks + 1);
  }
  static std::size_t slot_of(std::int32_t block, Place at) {
    for (int& i : at) i %= kCells;
    return static_cast<std::size_t>(block) * kBlock + place_number(at, kCells);
  }

  Lattice lattice_;
  std::vector<std::int32_t> blocks_;   ///< of kCells nodes along each axis
  std::vector<std::int32_t> numbers_;  ///< of the nodes in each block
  std::vector<SmallPlace> places_;
};

/// What a table gives of points: F, and their images.
struct LookedUp {
  std::vector<double> fields;
  std::vector<Point4> images;
};
LookedUp looked_up(const map::DeviceMap& map, const ImageTable& table,
                   const std::vector<Point4>& points, const std::stop_token& stop) {
  LookedUp found{std::vector<double>(points.size()), std::vector<Point4>(points.size())};
  device::PointBatch batch(map.context(), map.kernel("image_table.cl", "table_images"),
                           map.precision(), map.lanes(), kTableLookUpCost);
  batch.run<4, 5>(
      points.size(), [&](std::size_t i) { return points[i]; },
      [&](const device::PointBatch::Part& part) {
        return device::PartCall{
            {part.in, device::narrow(part.stride), device::narrow(part.items), table.layout(),
             table.bricks(), table.fields(), table.versors(), part.out},
            device::moving(9 * static_cast<double>(part.stride))};
      },
      [&](std::size_t i, const std::array<double, 5>& values) {
        std::array<float, 4> versor{};
        std::transform(values.begin() + 1, values.end(), versor.begin(),
                       [](double c) { return static_cast<float>(c); });
        found.fields[i] = values[0];
        found.images[i] = image_of(values[0], versor);
      },
      0, stop);
  return found;
}

/// Values less a twelfth of their second differences along each axis, where both neighbours along
/// it are known: what is multilinear between these is right on average over a cell.
template <class Value, class Add>
std::vector<Value> fitted(const NodeList& nodes, const std::vector<Value>& values, const Add& add) {
  constexpr float kTwelfth = 1.0F / 12;
  std::vector<Value> result = values;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::size_t axis = 0; axis < 4; ++axis) {
      Place before = nodes.place(i), after = before;
      --before[axis], ++after[axis];
      const std::int32_t one = nodes.find(before), other = nodes.find(after);
      if (one < 0 || other < 0) continue;
      add(result[i], values[static_cast<std::size_t>(one)], -kTwelfth);
      add(result[i], values[static_cast<std::size_t>(other)], -kTwelfth);
      add(result[i], values[i], 2 * kTwelfth);
    }
  }
  return result;
}

using Versor4 = std::array<float, 4>;

/// Makes what a table holds, step by step.
class Builder {
 public:
  Builder(const map::DeviceMap& map, const std::stop_token& stop, const Lattice& lattice)
      : probe_(map, stop),
        lattice_(lattice),
        inner_(map.log_inner()),
        outer_(map.log_outer()),
        lowest_(inner_ - kBelow),
        step_((outer_ + kAbove - lowest_) / kMostStored),
        nodes_(lattice_) {}

  /// What each brick is. @return whether some have data, and not too many.
  bool make_directory() {
    const double radius = std::exp(outer_);
    const auto all = static_cast<std::size_t>(std::pow(lattice_.bricks, 4));
    directory_.assign(all, outside_state(outer_));
    std::vector<std::size_t> asked;
    std::vector<Point4> middles;
    for (std::size_t b = 0; b < all; ++b) {
      const Point4 middle = lattice_.middle_of_brick(place_of(b, lattice_.bricks));
      if (length(middle) > radius + lattice_.brick()) continue;  // half a brick's diagonal
      asked.push_back(b);
      middles.push_back(middle);
    }
    const auto bounds = probe_.bounds(middles, 0.5 * lattice_.brick());
    for (std::size_t i = 0; i < asked.size(); ++i) {
      const auto [least, most] = bounds[i];
      if (most < inner_) {
        directory_[asked[i]] = QJ_TABLE_INSIDE;
      } else if (least > outer_) {
        directory_[asked[i]] = outside_state(least);
      } else {
        directory_[asked[i]] = device::narrow(kept_.size());
        kept_.push_back(asked[i]);
      }
    }
    return !kept_.empty() && kept_.size() <= kMostKept;
  }

  /// F at the nodes of bricks with data, each node once.
  void make_fields() {
    node_of_.resize(kept_.size() * QJ_TABLE_NODES);
    for (std::size_t b = 0; b < kept_.size(); ++b) {
      const Place at = place_of(kept_[b], lattice_.bricks);
      for (std::size_t n = 0; n < QJ_TABLE_NODES; ++n) {
        Place node = place_of(n, kNodesASide);
        for (std::size_t axis = 0; axis < 4; ++axis) node[axis] += kCells * at[axis];
        node_of_[b * QJ_TABLE_NODES + n] = nodes_.add(node);
      }
    }
    const std::vector<float> values =
        fitted(nodes_, probe_.fields(nodes_.size(), [&](std::size_t i) { return nodes_.point(i); }),
               [](float& sum, float value, float weight) { sum += weight * value; });
    std::vector<std::uint16_t> stored(values.size());
    std::ranges::transform(values, stored.begin(), [&](float f) {
      return static_cast<std::uint16_t>(std::lround(std::clamp(steps(f), 0.0, kMostStored)));
    });
    fields_.resize(node_of_.size());
    std::ranges::transform(node_of_, fields_.begin(), [&](std::int32_t node) {
      return stored[static_cast<std::size_t>(node)];
    });
  }

  /// U at the corners of cells whose interpolated F may be undecided.
  void make_versors() {
    const NodeList turned = undecided_nodes();
    const std::vector<Versor4> values = fitted(
        turned, probe_.versors(turned.size(), [&](std::size_t i) { return turned.point(i); }),
        [](Versor4& sum, const Versor4& value, float weight) {
          for (std::size_t c = 0; c < 4; ++c) sum[c] += weight * value[c];
        });
    versors_.resize(4 * node_of_.size());
    for (std::size_t i = 0; i < node_of_.size(); ++i) {
      const std::int32_t number = turned.find(nodes_.place(static_cast<std::size_t>(node_of_[i])));
      if (number < 0) continue;
      const Versor4& u = values[static_cast<std::size_t>(number)];
      for (std::size_t c = 0; c < 4; ++c) {
        constexpr float kMost = 127;
        versors_[4 * i + c] = static_cast<std::int8_t>(
            std::lround(std::clamp(QJ_TABLE_VERSOR * u[c], -kMost, kMost)));
      }
    }
  }

  std::vector<double> layout() const {
    std::vector<double> layout(QJ_TABLE_SIZE);
    layout[QJ_TABLE_ORIGIN] = lattice_.origin;
    layout[QJ_TABLE_STEP] = lattice_.step;
    layout[QJ_TABLE_BRICKS] = lattice_.bricks;
    layout[QJ_TABLE_FIELD] = lowest_;
    layout[QJ_TABLE_FIELD_STEP] = step_;
    layout[QJ_TABLE_OUTER] = outer_;
    return layout;
  }
  const std::vector<std::int32_t>& directory() const { return directory_; }
  const std::vector<std::uint16_t>& fields() const { return fields_; }
  const std::vector<std::int8_t>& versors() const { return versors_; }

 private:
  static constexpr double kMostStored = 65535;

  double steps(double f) const { return (f - lowest_) / step_; }

  /// What the directory says of a brick outside, in which F is at least `least`.
  std::int32_t outside_state(double least) const {
    constexpr double kMostBound = 1000;
    const double bound = std::clamp(least - outer_, 0.0, kMostBound);
    return QJ_TABLE_OUTSIDE - static_cast<std::int32_t>(bound * QJ_TABLE_PER_BOUND);
  }

  NodeList undecided_nodes() const {
    std::vector<bool> is_needed(nodes_.size());
    for (std::size_t b = 0; b < kept_.size(); ++b) {
      for (int cell = 0; cell < kCells * kCells * kCells * kCells; ++cell) {
        const Place at = place_of(static_cast<std::size_t>(cell), kCells);
        std::array<std::size_t, 16> corners{};
        double least = kMostStored, most = 0;
        for (std::size_t c = 0; c < 16; ++c) {
          Place corner = at;
          for (std::size_t axis = 0; axis < 4; ++axis)
            corner[axis] += static_cast<int>(c >> axis & 1);
          corners[c] = b * QJ_TABLE_NODES + place_number(corner, kNodesASide);
          least = std::min(least, static_cast<double>(fields_[corners[c]]));
          most = std::max(most, static_cast<double>(fields_[corners[c]]));
        }
        if (most < steps(inner_) - 1 || least > steps(outer_) + 1) continue;
        for (const std::size_t corner : corners) {
          is_needed[static_cast<std::size_t>(node_of_[corner])] = true;
        }
      }
    }
    NodeList needed(lattice_);
    for (std::size_t i = 0; i < nodes_.size(); ++i) {
      if (is_needed[i]) needed.add(nodes_.place(i));
    }
    return needed;
  }

  ImageProbe probe_;
  Lattice lattice_;
  double inner_, outer_;
  double lowest_, step_;  ///< a stored field f is F = lowest_ + step_ f
  std::vector<std::int32_t> directory_;
  std::vector<std::size_t> kept_;  ///< bricks with data
  NodeList nodes_;
  std::vector<std::int32_t> node_of_;  ///< the numbers of each such brick's nodes
  std::vector<std::uint16_t> fields_;
  std::vector<std::int8_t> versors_;
};

}  // namespace

ImageTable::ImageTable(const map::DeviceMap& map)
    : layout_(map.context().upload_real(std::vector<double>(QJ_TABLE_SIZE), map.precision())),
      bricks_(map.context().allocate<std::int32_t>(1)),
      fields_(map.context().allocate<std::uint16_t>(1)),
      versors_(map.context().allocate<std::int8_t>(4)) {}

ImageTable ImageTable::of_ball(const map::DeviceMap& map, double displacement,
                               const std::stop_token& stop) {
  // A coarse table costs little and shows how fine another has to be.
  ImageTable coarse = with_step(map, kCoarsestStep, stop);
  if (coarse.is_empty() || coarse.displacement_ <= displacement) return coarse;
  // Displacements go about with the square of the step.
  constexpr double kShare = 0.95;
  const double step = kShare * kCoarsestStep * std::sqrt(displacement / coarse.displacement_);
  ImageTable table = with_step(map, std::max(step, kFinestStep), stop);
  return table.is_empty() ? coarse : table;
}

ImageTable ImageTable::with_step(const map::DeviceMap& map, double step,
                                 const std::stop_token& stop) {
  ImageTable table(map);
  const double brick = step * kCells;
  const double bricks = std::ceil(2 * std::exp(map.log_outer()) / brick) + 1;
  if (!map.has_cube_bounds() || !(bricks <= kMostBricks)) return table;
  Builder builder(map, stop, {-0.5 * bricks * brick, step, static_cast<int>(bricks)});
  if (!builder.make_directory()) return table;
  builder.make_fields();
  builder.make_versors();
  device::Context& context = map.context();
  table.layout_ = context.upload_real(builder.layout(), map.precision());
  table.bricks_ = context.upload<std::int32_t>(builder.directory());
  table.fields_ = context.upload<std::uint16_t>(builder.fields());
  table.versors_ = context.upload<std::int8_t>(builder.versors());
  table.step_ = step;
  table.measure(map, stop);
  return table;
}

void ImageTable::measure(const map::DeviceMap& map, const std::stop_token& stop) {
  const ImageProbe probe(map, stop);
  base::Random random(1);
  // Undecided points of the slice, then their images as far as these are undecided.
  const ImageProbe::Moved first = probe.first_images(kTableProbes, random);
  const ImageProbe::Moved second = probe.moved_images(first.images, 4, random);
  if (second.images.empty()) return;
  std::vector<Point4> asked;
  for (const std::size_t i : second.from) asked.push_back(first.images[i]);
  const LookedUp found = looked_up(map, *this, asked, stop);
  std::vector<double> errors, field_errors;
  std::vector<double> first_stretches = first.stretches, stretches = second.stretches;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    errors.push_back(distance(second.images[i], found.images[i]));
    field_errors.push_back(std::abs(found.fields[i] - std::log(length(second.images[i]))));
  }
  margin_ = kOverFound * *std::ranges::max_element(field_errors);
  stretch_ = std::max(base::median(stretches), 1.0);
  displacement_ = base::median(errors) / (std::max(base::median(first_stretches), 1.0) * stretch_);
}

bool ImageTable::is_finest() const { return step_ <= kFinestStep; }

int ImageTable::first_iterate(double displacement) const {
  if (is_empty()) return std::numeric_limits<int>::max();
  int iterate = 2;
  // Where images do not move farther than points, no later iterate does better.
  for (double seen = displacement_; seen > displacement; seen /= stretch_) {
    if (++iterate > kMostIterations) return std::numeric_limits<int>::max();
  }
  return iterate;
}

}  // namespace qjulia::surface

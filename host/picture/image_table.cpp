#include "picture/image_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

#include "base/random.hpp"
#include "device/point_batch.hpp"
#include "layout/image_table.h"

namespace qjulia::picture {
namespace {

using Point = std::array<double, 4>;

/// Distance of nodes, map units.
constexpr double kStep = 0.07;
/// Bricks along an axis: for memory's sake.
constexpr int kMostBricks = 30;
/// F is stored from so far below the inner level to so far above the outer one.
constexpr double kBelow = 4, kAbove = 4;
/// Points at which the table is compared with the map.
constexpr std::size_t kProbes = 4096;
/// How far points are moved to see how their images move, map units.
constexpr double kMove = 1e-4;
/// What a look-up costs, in factors' logarithms.
constexpr double kLookUpCost = 20;

constexpr int kCells = QJ_TABLE_CELLS, kNodesASide = QJ_TABLE_SIDE;

/// Four counts: of nodes from the lattice's origin, or of bricks.
using Place = std::array<int, 4>;

/// The number of a place among `side` along each axis, X fastest.
std::size_t number_of(const Place& at, int side) {
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

  Point node(const Place& at) const {
    Point p{};
    std::ranges::transform(at, p.begin(), [&](int i) { return origin + step * i; });
    return p;
  }
  Point middle_of_brick(const Place& at) const {
    Point p{};
    std::ranges::transform(at, p.begin(),
                           [&](int i) { return origin + step * kCells * (i + 0.5); });
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
  const std::vector<Place>& places() const { return places_; }

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
      places_.push_back(at);
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
  std::vector<Point> points() const {
    std::vector<Point> points(places_.size());
    std::ranges::transform(places_, points.begin(),
                           [&](const Place& at) { return lattice_.node(at); });
    return points;
  }

 private:
  static constexpr std::int32_t kNone = -1;
  static constexpr std::size_t kBlock = kCells * kCells * kCells * kCells;

  std::size_t block_of(Place at) const {
    for (int& i : at) i /= kCells;
    return number_of(at, lattice_.bricks + 1);
  }
  static std::size_t slot_of(std::int32_t block, Place at) {
    for (int& i : at) i %= kCells;
    return static_cast<std::size_t>(block) * kBlock + number_of(at, kCells);
  }

  Lattice lattice_;
  std::vector<std::int32_t> blocks_;   ///< of kCells nodes along each axis
  std::vector<std::int32_t> numbers_;  ///< of the nodes in each block
  std::vector<Place> places_;
};

double length(const Point& p) {
  return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3]);
}

Point times(double scale, const std::array<float, 4>& q) {
  Point p{};
  std::ranges::transform(q, p.begin(), [&](float c) { return scale * c; });
  return p;
}

double distance(const Point& a, const Point& b) {
  return length({a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]});
}

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// What a table says of a point.
struct Looked {
  double field;
  std::array<float, 4> versor;
};

/// The map's F and U at points, computed on the device.
class Probe {
 public:
  Probe(const map::DeviceMap& map, const std::stop_token& stop) : map_(map), stop_(stop) {}

  std::vector<float> fields(const std::vector<Point>& points) const {
    std::vector<float> fields(points.size());
    run<1>("node_fields", points, {}, [&](std::size_t i, const std::array<double, 1>& f) {
      fields[i] = static_cast<float>(f[0]);
    });
    return fields;
  }
  std::vector<std::array<float, 4>> versors(const std::vector<Point>& points) const {
    std::vector<std::array<float, 4>> versors(points.size());
    run<4>("node_versors", points, {}, [&](std::size_t i, const Point& u) {
      std::ranges::transform(u, versors[i].begin(), [](double c) { return static_cast<float>(c); });
    });
    return versors;
  }
  /// Least and greatest F over cubes about the points.
  std::vector<std::array<double, 2>> bounds(const std::vector<Point>& points,
                                            double half_side) const {
    std::vector<std::array<double, 2>> bounds(points.size());
    run<2>("cube_bounds", points, {map_.real(half_side)},
           [&](std::size_t i, const std::array<double, 2>& found) { bounds[i] = found; });
    return bounds;
  }
  std::vector<Looked> looked_up(const ImageTable& table, const std::vector<Point>& points) const {
    std::vector<Looked> looked(points.size());
    device::PointBatch batch(map_.context(), map_.kernel("image_table.cl", "table_images"),
                             map_.precision(), map_.lanes(), kLookUpCost);
    batch.run<4, 5>(
        points.size(), [&](std::size_t i) { return points[i]; },
        [&](const device::PointBatch::Part& part) {
          return std::vector<device::Argument>{part.in,
                                               device::narrow(part.stride),
                                               device::narrow(part.items),
                                               table.layout(),
                                               table.bricks(),
                                               table.fields(),
                                               table.versors(),
                                               part.out};
        },
        [&](std::size_t i, const std::array<double, 5>& found) {
          looked[i].field = found[0];
          std::transform(found.begin() + 1, found.end(), looked[i].versor.begin(),
                         [](double c) { return static_cast<float>(c); });
        },
        0, stop_);
    return looked;
  }

 private:
  template <std::size_t kOutputs, class Take>
  void run(const char* name, const std::vector<Point>& points,
           const std::vector<device::Argument>& more, const Take& take) const {
    device::PointBatch batch(map_.context(), map_.kernel("image_table.cl", name), map_.precision(),
                             map_.lanes(), map_.step_cost());
    batch.run<4, kOutputs>(
        points.size(), [&](std::size_t i) { return points[i]; },
        [&](const device::PointBatch::Part& part) {
          std::vector<device::Argument> list = {part.in, device::narrow(part.stride),
                                                device::narrow(part.items)};
          list.insert(list.end(), more.begin(), more.end());
          list.insert(list.end(), {map_.buffer(), map_.factors(), part.out});
          return list;
        },
        take, 0, stop_);
  }

  const map::DeviceMap& map_;
  const std::stop_token& stop_;
};

/// Values less a twelfth of their second differences along each axis, where both neighbours along
/// it are known: what is multilinear between these is right on average over a cell.
template <class Value, class Add>
std::vector<Value> fitted(const NodeList& nodes, const std::vector<Value>& values, const Add& add) {
  constexpr float kTwelfth = 1.0F / 12;
  std::vector<Value> result = values;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (std::size_t axis = 0; axis < 4; ++axis) {
      Place before = nodes.places()[i], after = before;
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

std::int32_t outside_state(double lowest, double outer) {
  constexpr double kMostBound = 1000;
  const double bound = std::clamp(lowest - outer, 0.0, kMostBound);
  return QJ_TABLE_OUTSIDE - static_cast<std::int32_t>(bound * QJ_TABLE_PER_BOUND);
}

}  // namespace

ImageTable::ImageTable(const map::DeviceMap& map)
    : layout_(map.context().upload_real(std::vector<double>(QJ_TABLE_SIZE), map.precision())),
      bricks_(map.context().allocate<std::int32_t>(1)),
      fields_(map.context().allocate<std::uint16_t>(1)),
      versors_(map.context().allocate<std::int8_t>(4)) {}

ImageTable ImageTable::of_ball(const map::DeviceMap& map, const std::stop_token& stop) {
  ImageTable table(map);
  const double inner = map.log_inner(), outer = map.log_outer(), radius = std::exp(outer);
  const double brick = kStep * kCells;
  const double along = std::ceil(2 * radius / brick) + 1;
  if (!map.has_cube_bounds() || !(along <= kMostBricks)) return table;
  const int bricks = static_cast<int>(along);
  const Lattice lattice{-0.5 * bricks * brick, kStep, bricks};
  const Probe probe(map, stop);

  // What the directory says.
  const std::size_t all = static_cast<std::size_t>(std::pow(bricks, 4));
  std::vector<std::int32_t> directory(all, outside_state(outer, outer));
  std::vector<std::size_t> asked;
  std::vector<Point> middles;
  for (std::size_t b = 0; b < all; ++b) {
    const Point middle = lattice.middle_of_brick(place_of(b, bricks));
    if (length(middle) > radius + brick) continue;  // half its diagonal is a side
    asked.push_back(b);
    middles.push_back(middle);
  }
  const auto bounds = probe.bounds(middles, 0.5 * brick);
  std::vector<std::size_t> kept;
  for (std::size_t i = 0; i < asked.size(); ++i) {
    const auto [lowest, highest] = bounds[i];
    if (highest < inner) {
      directory[asked[i]] = QJ_TABLE_INSIDE;
    } else if (lowest > outer) {
      directory[asked[i]] = outside_state(lowest, outer);
    } else {
      directory[asked[i]] = device::narrow(kept.size());
      kept.push_back(asked[i]);
    }
  }
  if (kept.empty()) return table;

  // Nodes of the others, each once.
  NodeList nodes(lattice);
  std::vector<std::int32_t> node_of(kept.size() * QJ_TABLE_NODES);
  for (std::size_t b = 0; b < kept.size(); ++b) {
    const Place at = place_of(kept[b], bricks);
    for (std::size_t n = 0; n < QJ_TABLE_NODES; ++n) {
      Place node = place_of(n, kNodesASide);
      for (std::size_t axis = 0; axis < 4; ++axis) node[axis] += kCells * at[axis];
      node_of[b * QJ_TABLE_NODES + n] = nodes.add(node);
    }
  }
  const std::vector<float> field =
      fitted(nodes, probe.fields(nodes.points()),
             [](float& sum, float value, float weight) { sum += weight * value; });
  const double lowest = inner - kBelow, step = (outer + kAbove - lowest) / 65535;
  std::vector<std::uint16_t> stored(nodes.size());
  std::ranges::transform(field, stored.begin(), [&](float f) {
    return static_cast<std::uint16_t>(std::lround(std::clamp((f - lowest) / step, 0.0, 65535.0)));
  });
  std::vector<std::uint16_t> fields(node_of.size());
  std::ranges::transform(node_of, fields.begin(), [&](std::int32_t number) {
    return stored[static_cast<std::size_t>(number)];
  });

  // Versors at the corners of cells whose interpolated F may be undecided.
  const auto level = [&](double f) { return (f - lowest) / step; };
  std::vector<bool> is_needed(nodes.size());
  for (std::size_t b = 0; b < kept.size(); ++b) {
    for (int cell = 0; cell < kCells * kCells * kCells * kCells; ++cell) {
      const Place at = place_of(static_cast<std::size_t>(cell), kCells);
      std::array<std::size_t, 16> corners{};
      double least = 65535, most = 0;
      for (std::size_t c = 0; c < 16; ++c) {
        Place corner = at;
        for (std::size_t axis = 0; axis < 4; ++axis)
          corner[axis] += static_cast<int>(c >> axis & 1);
        corners[c] = b * QJ_TABLE_NODES + number_of(corner, kNodesASide);
        least = std::min(least, static_cast<double>(fields[corners[c]]));
        most = std::max(most, static_cast<double>(fields[corners[c]]));
      }
      if (most < level(inner) - 1 || least > level(outer) + 1) continue;
      for (const std::size_t corner : corners) {
        is_needed[static_cast<std::size_t>(node_of[corner])] = true;
      }
    }
  }
  NodeList turned(lattice);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (is_needed[i]) turned.add(nodes.places()[i]);
  }
  using Versor4 = std::array<float, 4>;
  const std::vector<Versor4> versor = fitted(turned, probe.versors(turned.points()),
                                             [](Versor4& sum, const Versor4& value, float weight) {
                                               for (std::size_t c = 0; c < 4; ++c)
                                                 sum[c] += weight * value[c];
                                             });
  std::vector<std::int8_t> versors(4 * node_of.size());
  for (std::size_t i = 0; i < node_of.size(); ++i) {
    const std::int32_t slot = turned.find(nodes.places()[static_cast<std::size_t>(node_of[i])]);
    if (slot < 0) continue;
    for (std::size_t c = 0; c < 4; ++c) {
      versors[4 * i + c] = static_cast<std::int8_t>(std::lround(std::clamp(
          QJ_TABLE_VERSOR * versor[static_cast<std::size_t>(slot)][c], -127.0F, 127.0F)));
    }
  }

  device::Context& context = map.context();
  std::vector<double> layout(QJ_TABLE_SIZE);
  layout[QJ_TABLE_ORIGIN] = lattice.origin;
  layout[QJ_TABLE_STEP] = lattice.step;
  layout[QJ_TABLE_BRICKS] = bricks;
  layout[QJ_TABLE_FIELD] = lowest;
  layout[QJ_TABLE_FIELD_STEP] = step;
  layout[QJ_TABLE_OUTER] = outer;
  table.layout_ = context.upload_real(layout, map.precision());
  table.bricks_ = context.upload<std::int32_t>(directory);
  table.fields_ = context.upload<std::uint16_t>(fields);
  table.versors_ = context.upload<std::int8_t>(versors);
  table.is_empty_ = false;
  table.measure(map, stop);
  return table;
}

void ImageTable::measure(const map::DeviceMap& map, const std::stop_token& stop) {
  const Probe probe(map, stop);
  base::Random random(1);
  const double radius = std::exp(map.log_outer());
  std::vector<Point> points, moved;
  const auto direction = [&] {
    for (;;) {
      Point p{};
      for (double& c : p) c = random.uniform(-1, 1);
      if (const double size = length(p); size > 0.1 && size < 1) return std::pair(p, size);
    }
  };
  for (std::size_t i = 0; i < kProbes; ++i) {
    Point p = direction().first;
    for (double& c : p) c *= radius;
    points.push_back(p);
    const auto [way, size] = direction();
    for (std::size_t c = 0; c < 4; ++c) p[c] += kMove * way[c] / size;
    moved.push_back(p);
  }
  const auto fields = probe.fields(points), moved_fields = probe.fields(moved);
  const auto versors = probe.versors(points), moved_versors = probe.versors(moved);
  const std::vector<Looked> looked = probe.looked_up(*this, points);
  std::vector<double> errors, stretches;
  for (std::size_t i = 0; i < kProbes; ++i) {
    if (fields[i] < map.log_inner() || fields[i] > map.log_outer()) continue;
    const Point image = times(std::exp(fields[i]), versors[i]);
    errors.push_back(distance(image, times(std::exp(looked[i].field), looked[i].versor)));
    stretches.push_back(distance(image, times(std::exp(moved_fields[i]), moved_versors[i])) /
                        kMove);
  }
  if (errors.empty()) return;
  error_ = median(errors);
  stretch_ = std::max(median(stretches), 1.0);
  if (std::getenv("QJ_DEBUG"))
    std::fprintf(stderr, "table: error %.4f stretch %.1f, %zu undecided of %zu; %.1f MB\n", error_,
                 stretch_, errors.size(), kProbes,
                 double(bricks_.bytes() + fields_.bytes() + versors_.bytes()) / 1e6);
}

int ImageTable::first_iterate(double displacement) const {
  if (is_empty_) return std::numeric_limits<int>::max();
  int iterate = 2;
  for (double seen = error_ / (stretch_ * stretch_); seen > displacement; seen /= stretch_)
    ++iterate;
  return iterate;
}

}  // namespace qjulia::picture

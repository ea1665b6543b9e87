#include "qjulia/self_test.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <span>

#include "base/larger_error.hpp"
#include "base/random.hpp"
#include "check/lane_probe.hpp"
#include "check/unit_ball.hpp"
#include "device/point_batch.hpp"
#include "energy/curvature.hpp"
#include "energy/evaluator.hpp"
#include "layout/image_lattice.h"
#include "layout/image_table.h"
#include "map/reference_iteration.hpp"
#include "picture/band_grid.hpp"
#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "profile/workload.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/shape.hpp"
#include "qjulia/surface.hpp"
#include "surface/grid.hpp"
#include "surface/grid_layout.hpp"
#include "surface/level_set.hpp"

namespace qjulia {
namespace {

using base::larger_error;
using check::LaneFunction;
using check::unit_ball;
using Eigen::Vector3d;
using profiling::kNoEscape;
using profiling::largest_difference;
using profiling::Workload;

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr int kIterations = 4;
constexpr int kBallCells = 48;

/// 300 samples and 24 factors: no number is a multiple of a group.
Workload small_work() { return profiling::make_workload({.samples = 300, .factors = 24}); }

std::vector<double> fields(energy::Evaluator& evaluator, const Map& map) {
  return evaluator.field(map);
}

std::vector<double> gradient(energy::Evaluator& evaluator, const Map& map) {
  return evaluator.evaluate(map, true).gradient;
}

std::vector<double> gauss_newton(energy::Evaluator& evaluator, const Map& map) {
  const Eigen::MatrixXd h = evaluator.gauss_newton(map);
  return {h.data(), h.data() + h.size()};
}

/// What both evaluators make of the work, compared.
template <auto kCompute, int kOrbit>
double evaluated(const Device& device, Precision precision) {
  const Workload work = small_work();
  const energy::EnergySettings options{energy::Loss::distance, kOrbit, 1, kNoEscape};
  const auto found = energy::make_device_evaluator(device, work.samples, options, precision);
  const auto right = energy::make_reference_evaluator(work.samples, options);
  return largest_difference(kCompute(*found, work.map), kCompute(*right, work.map));
}

/// Sums of whole numbers, which are exact.
double reduced(const Device& device, Precision precision) {
  constexpr std::size_t kRows = 70, kColumns = 37, kBlock = 32;
  constexpr std::size_t kBlocks = (kRows + kBlock - 1) / kBlock;
  std::vector<double> rows(kRows * kColumns), right(kBlocks * kColumns), found(right.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    rows[i] = static_cast<double>((i * 7) % 101) - 50;
    right[i / kColumns / kBlock * kColumns + i % kColumns] += rows[i];
  }
  device::Context& context = device.context();
  const auto sums = context.allocate_real(right.size(), precision);
  context.launch(
      context.kernel("reduce.cl", "sum_row_blocks", {device.lane_width(precision), precision, {}}),
      {{kColumns, kBlocks, 1}},
      {context.upload_real(rows, precision), device::narrow(kRows), device::narrow(kColumns),
       device::narrow(kBlock), sums});
  context.read(sums, found);
  return largest_difference(found, right);
}

/// Cell centres of [−1.5, 1.5]³, x fastest.
surface::Grid small_grid() {
  constexpr int kSide = 9;
  return {Vector3d::Constant(-1.4), 2.8 / (kSide - 1), {kSide, kSide, kSide}};
}

std::vector<Quaternion> grid_points(const surface::Grid& grid, double slice) {
  std::vector<Vector3d> points;
  surface::for_points(grid.points, [&](std::size_t, const Eigen::Vector3i& index) {
    points.push_back(grid.point(index));
  });
  return on_slice(points, slice);
}

double field(const Device& device, Precision precision) {
  const Map map = small_work().map;
  const auto points = grid_points(small_grid(), map.dynamics.slice);
  return largest_difference(
      Field(device, map, precision, {0, 0, kNoEscape}).at(points, kIterations),
      reference::field(map, points, kIterations, kNoEscape));
}

std::vector<double> flat(const std::vector<Quaternion>& all) {
  std::vector<double> numbers;
  for (const Quaternion& q : all) {
    const auto c = coordinates(q);
    numbers.insert(numbers.end(), c.begin(), c.end());
  }
  return numbers;
}

/// Versors, images, numbers of iterates and gradients. Twice iterated, rounding has not grown.
double field_queries(const Device& device, Precision precision) {
  constexpr int kTwice = 2;
  const Map map = small_work().map;
  const auto points = grid_points(small_grid(), map.dynamics.slice);
  const Field field(device, map, precision);
  std::vector<Quaternion> versors, images;
  std::vector<double> counts;
  for (const Quaternion& q : points) {
    const auto [log_norm, versor] = reference::step(map, q);
    versors.push_back(versor);
    images.push_back(norm(q) < kUsualEscape ? std::exp(log_norm) * versor : q);
    counts.push_back(norm(q) >= kUsualEscape ? 0 : norm(images.back()) < kUsualEscape ? 2 : 1);
  }
  const auto found = field.escape_counts_at(points, kTwice);
  return std::max(
      {largest_difference(flat(field.versors_at(points)), flat(versors)),
       largest_difference(flat(field.images_at(points)), flat(images)),
       largest_difference({found.begin(), found.end()}, counts),
       largest_difference(flat(field.gradient_at(points, kTwice)),
                          flat(reference::point_gradients(map, points, kTwice, kUsualEscape)))});
}

double level_set(const Device& device, Precision precision) {
  const Map map = small_work().map;
  const surface::Grid grid = small_grid();
  const surface::LevelSet set(device, map, {0, 0, kNoEscape}, kIterations, precision);
  const auto found = set.over(grid, {{0, 0, 0}, grid.points});
  return largest_difference(
      {found.begin(), found.end()},
      reference::field(map, grid_points(grid, map.dynamics.slice), kIterations, kNoEscape));
}

/// A mesh of the ball.
/// @param tries to place each vertex; with 0, vertices are where the field is interpolated.
TriangleMesh surface_of_ball(const Device& device, Precision precision, int tries, bool dense) {
  SurfaceOptions options;
  options.resolution = kBallCells;
  options.precision = precision;
  options.refine = tries;
  options.dense = dense;
  return extract_surface(device, unit_ball(), options);
}

/// How far vertices are from the ball, in cells.
double cells_off_ball(const TriangleMesh& mesh) {
  constexpr double kCell = 2.1 / kBallCells;
  double worst = mesh.vertices.empty() ? kInfinite : 0;
  for (const Vector3d& vertex : mesh.vertices) {
    worst = larger_error(worst, std::abs(vertex.norm() - 1) / kCell);
  }
  return worst;
}

/// Interpolated orbits give the same mesh as orbits that are run.
double interpolated_surface(const Device& device, Precision precision) {
  const TriangleMesh found = surface_of_ball(device, precision, 0, false);
  const TriangleMesh dense = surface_of_ball(device, precision, 0, true);
  if (found.vertices != dense.vertices || found.triangles != dense.triangles) return kInfinite;
  return cells_off_ball(found);
}

/// Vertices that are placed by tries on their edges lie on the ball.
double placed_vertices(const Device& device, Precision precision) {
  constexpr int kTries = 12;
  return cells_off_ball(surface_of_ball(device, precision, kTries, false));
}

/// The cube [−1, 1]³ in triangles of which none is larger than a sixteenth of a face.
TriangleMesh cube() {
  constexpr int kSteps = 8;
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      for (int i = 0; i < kSteps; ++i) {
        for (int j = 0; j < kSteps; ++j) {
          const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
          for (const auto& [u, v] : {std::pair{i, j}, {i + 1, j}, {i + 1, j + 1}, {i, j + 1}}) {
            Vector3d at;
            at[axis] = side;
            at[(axis + 1) % 3] = 2.0 * u / kSteps - 1;
            at[(axis + 2) % 3] = side * (2.0 * v / kSteps - 1);
            mesh.vertices.push_back(at);
          }
          mesh.triangles.push_back({first, first + 1, first + 2});
          mesh.triangles.push_back({first, first + 2, first + 3});
        }
      }
    }
  }
  return mesh;
}

double signed_distance(const Device& device, Precision precision) {
  base::Random random(3);
  std::vector<Vector3d> points(500);
  std::vector<double> right;
  for (Vector3d& x : points) {
    for (double& coordinate : x) coordinate = random.uniform(-2, 2);
    const Vector3d beyond = x.cwiseAbs() - Vector3d::Ones();
    right.push_back(beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0));
  }
  return largest_difference(SignedDistance(device, cube(), precision).at(points), right);
}

/// Depths of the ball along parallel rays that meet it well inside its outline, where a ray's own
/// tolerance is the unit.
template <bool kCoarse>
double depths(const Device& device, Precision precision) {
  constexpr double kLeastSlope = 0.447;  // cosine of the angle between the ray and the normal
  const auto source = picture::march_source(device, {unit_ball(), 6, {}, {}, precision});
  picture::View view = picture::parallel_view(Vector3d::UnitZ(), *unit_ball().frame.box, 48);
  view.coarse_will_do = kCoarse;
  const auto found = source->depths(view, 0, view.rows);
  double worst = 0;
  std::size_t hits = 0;
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.columns; ++column) {
      const double right = check::sphere_depth(view, column, row);
      if (right < 0) continue;
      const Vector3d normal =
          check::ray_start(view, column, row) + right * check::ray_direction(view, column, row);
      const double slope = -normal.dot(check::ray_direction(view, column, row));
      if (slope < kLeastSlope) continue;
      const double depth = found[picture::index(column, row, view.columns)];
      worst = larger_error(worst, depth < 0 ? kInfinite : std::abs(depth - right) * slope);
      ++hits;
    }
  }
  return hits > 0 ? worst / view.tolerance : kInfinite;
}

/// Compares traits of points just inside the unit sphere. A point at an angle t to the real axis
/// has iterates at 2t and 4t.
double orbit_trait(const Device& device, Precision precision) {
  const auto source =
      picture::march_source(device, {unit_ball(), 6, {}, {}, precision, Material::trap});
  std::vector<Vector3d> points;
  std::vector<double> right;
  for (int i = 0; i < 100; ++i) {
    const double t = 0.1 + 0.02 * i;
    constexpr double kRadius = 0.998;
    points.push_back(kRadius * Vector3d(std::cos(t), 0.6 * std::sin(t), 0.8 * std::sin(t)));
    right.push_back(std::min(std::abs(std::cos(2 * t)), std::abs(std::cos(4 * t))));
  }
  constexpr double kWidth = 1e-4;
  const auto found = source->traits(points, std::span(&kWidth, 1));
  return largest_difference({found.begin(), found.end()}, right);
}

/// Normals of a picture of the ball, which its positions are too, away from its outline.
double shade(const Device& device, Precision precision) {
  PictureOptions options;
  options.width = 64;
  options.height = 48;
  options.samples_per_axis = 1;
  options.precision = precision;
  const PictureLayers layers = layered_render(device, unit_ball(), options).layers;
  constexpr int kMargin = 3;
  const auto pixel = [&](int column, int row) {
    return picture::index(column, row, options.width);
  };
  const auto is_inside = [&](int column, int row) {
    for (int y = row - kMargin; y <= row + kMargin; ++y) {
      for (int x = column - kMargin; x <= column + kMargin; ++x) {
        if (std::isinf(layers.depth[pixel(x, y)])) return false;
      }
    }
    return true;
  };
  const auto vector = [&](const std::vector<float>& layer, std::size_t at) {
    return Vector3d(layer[3 * at], layer[3 * at + 1], layer[3 * at + 2]);
  };
  double worst = 0;
  std::size_t hits = 0;
  for (int row = kMargin; row < options.height - kMargin; ++row) {
    for (int column = kMargin; column < options.width - kMargin; ++column) {
      if (!is_inside(column, row)) continue;
      const std::size_t at = pixel(column, row);
      const Vector3d right = vector(layers.position, at).normalized();
      worst = larger_error(worst, (vector(layers.normal, at) - right).norm());
      ++hits;
    }
  }
  return hits > 100 ? worst : kInfinite;
}

/// Copied reals, and a sum of chains of multiply-adds.
double limits(const Device& device, Precision precision) {
  device::Context& context = device.context();
  const int width = device.lane_width(precision);
  const auto kernel = [&](const char* name) {
    return context.kernel("limits.cl", name, {width, precision, {}});
  };
  const std::vector<double> seed{0.5, 0.25};
  constexpr std::int32_t kRounds = 3, kChains = 16;
  const auto sums = context.allocate_real(1, precision);
  context.launch(kernel("fma_chains"), {{1, 1, 1}, {1, 1, 1}},
                 {context.upload_real(seed, precision), kRounds, sums});
  std::vector<double> found(1);
  context.read(sums, found);
  double right = 0;
  for (int c = 0; c < kChains; ++c) {
    double chain = c;
    for (int r = 0; r < kRounds; ++r) chain = chain * seed[0] + seed[1];
    right += width * chain;
  }
  std::vector<double> numbers(static_cast<std::size_t>(width) * 6), copied(numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<double>(i);
  const auto to = context.allocate_real(numbers.size(), precision);
  context.launch(kernel("copy_reals"), {{3, 1, 1}},
                 {context.upload_real(numbers, precision), 2, 3, to});
  context.read(to, copied);
  return larger_error(largest_difference(found, {right}), largest_difference(copied, numbers));
}

double lane_math(const Device& device, Precision precision) {
  constexpr std::size_t kCount = 256;  // a multiple of every width
  const check::LaneProbe probe(device, device.lane_width(precision), precision);
  std::vector<double> x(kCount), right(kCount);
  for (std::size_t i = 0; i < kCount; ++i) x[i] = 0.25 + static_cast<double>(i) / 64;
  double worst = 0;
  for (const LaneFunction function : {LaneFunction::log2, LaneFunction::exp, LaneFunction::tanh,
                                      LaneFunction::sine, LaneFunction::rsqrt}) {
    std::ranges::transform(x, right.begin(),
                           [&](double v) { return check::on_host(function, v, v); });
    worst = larger_error(worst, largest_difference(probe(function, x, x), right));
  }
  return worst;
}

/// L of a matrix whose entries fall off from the diagonal, with the host's.
double cholesky(const Device& device, Precision /*precision*/) {
  constexpr Eigen::Index kOrder = 500;
  constexpr double kDamping = 0.01;
  const Eigen::MatrixXf h =
      Eigen::MatrixXf::NullaryExpr(kOrder, kOrder, [](Eigen::Index i, Eigen::Index j) {
        const auto apart = static_cast<float>(i - j);
        return 1 / (1 + apart * apart);
      });
  std::vector<std::int32_t> place(kOrder);
  std::iota(place.begin(), place.end(), 0);
  const auto rows = device.context().upload_real({h.data(), static_cast<std::size_t>(h.size())});
  const auto found =
      energy::factorised(device, {rows, kOrder, place, Eigen::VectorXd::Ones(kOrder)}, kDamping);
  if (!found) return kInfinite;
  const Eigen::MatrixXf difference = found->lower.topLeftCorner(kOrder, kOrder) -
                                     energy::factorised(h.cast<double>(), kDamping).lower;
  double worst = 0;
  for (Eigen::Index j = 0; j < kOrder; ++j) {
    for (Eigen::Index i = j; i < kOrder; ++i)
      worst = larger_error(worst, std::abs(difference(i, j)));
  }
  return worst;
}

/// How many cells are trusted or distrusted wrongly. F and U are linear, and their fourth
/// differences vanish, but for a few nodes at which one of them is wrong. Some others are not
/// stored.
double image_lattice(const Device& device, Precision precision) {
  const surface::Grid grid{Vector3d(-1, 0.5, 2), 0.25, {12, 8, 7}};
  constexpr std::size_t kEveryNode = 97;
  const auto is_wrong = [](std::size_t number) { return number % kEveryNode == 50; };
  const auto is_stored = [](std::size_t number) { return number % kEveryNode != 40; };
  std::vector<double> field, versors;
  surface::for_points(grid.points, [&](std::size_t number, const Eigen::Vector3i& at) {
    const Vector3d p = grid.point(at);
    field.push_back(p.dot(Vector3d(1, -2, 0.5)));
    for (const double slope : {0.5, 1.0, -1.0, 2.0}) versors.push_back(slope * p.sum());
    if (is_wrong(number)) (number % 2 == 0 ? field : versors).back() += 1;
  });
  // How many nodes are wrong of the five that lie about one along an axis; negative if one of these
  // is not stored.
  const auto wrong_about = [&](const Eigen::Vector3i& node, int axis) {
    Eigen::Vector3i at = node;
    int wrong = 0;
    for (at[axis] = node[axis] - 2; at[axis] <= node[axis] + 2; ++at[axis]) {
      if (at[axis] < 0 || at[axis] >= grid.points[axis]) return -1;
      const std::size_t number = surface::number_of(at, grid.points);
      if (!is_stored(number)) return -1;
      wrong += is_wrong(number) ? 1 : 0;
    }
    return wrong;
  };
  std::vector<std::int32_t> cells;
  std::vector<std::uint8_t> right(field.size()), found(field.size());
  surface::for_points(grid.points.array() - 3, [&](std::size_t, const Eigen::Vector3i& inner) {
    const Eigen::Vector3i low = inner.array() + 1, high = low.array() + 1;
    const std::size_t number = surface::number_of(low, grid.points);
    cells.push_back(device::narrow(number));
    right[number] = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3i along = Eigen::Vector3i::Unit(axis);
      const int most = std::max({wrong_about(low, axis), wrong_about(low + along, axis),
                                 wrong_about(high, axis), wrong_about(high - along, axis)});
      if (most != 0) right[number] = 0;
    }
  });
  std::vector<std::int32_t> places(field.size() / QJ_LATTICE_GROUP);
  for (std::size_t number = 0; number < field.size(); ++number) {
    std::int32_t& group = places[number / QJ_LATTICE_GROUP];
    const auto member = device::narrow(number % QJ_LATTICE_GROUP);
    if (member == 0) group = device::narrow(number) << QJ_LATTICE_GROUP;
    if (is_stored(number)) group |= 1 << member;
  }
  device::Context& context = device.context();
  const auto kernel = context.kernel("image_lattice.cl", "trust_cells",
                                     {device.lane_width(precision), precision, {}});
  const auto trusted = context.upload<std::uint8_t>(found);
  const auto sent = [&](const std::vector<double>& reals) {
    return context.upload_real(reals, precision);
  };
  context.launch(kernel, {{cells.size(), 1, 1}},
                 {context.upload<std::int32_t>(cells), device::narrow(cells.size()),
                  sent(surface::grid_layout(grid)), context.upload<std::int32_t>(places),
                  sent(field), sent(versors), device::Argument::real(1e-3, precision), trusted});
  context.read<std::uint8_t>(trusted, found);
  return static_cast<double>(field.size()) -
         std::transform_reduce(found.begin(), found.end(), right.begin(), 0.0, std::plus<>(),
                               std::equal_to<>());
}

/// A table of one brick, over the cube from -1 to 1. Its F is linear, and its U is 1.
struct SmallTable {
  device::RealBuffer layout;
  device::Buffer<std::int32_t> bricks;
  device::Buffer<std::uint16_t> fields;
  device::Buffer<std::int8_t> versors;

  SmallTable(device::Context& context, Precision precision) {
    std::vector<double> reals(QJ_TABLE_SIZE);
    reals[QJ_TABLE_ORIGIN] = -1;
    reals[QJ_TABLE_STEP] = 0.5;
    reals[QJ_TABLE_BRICKS] = 1;
    reals[QJ_TABLE_FIELD] = -2;
    reals[QJ_TABLE_FIELD_STEP] = 0.25;
    std::vector<std::uint16_t> f;
    std::vector<std::int8_t> u;
    for (int node = 0; node < QJ_TABLE_NODES; ++node) {
      const int x = node % 5, y = node / 5 % 5, z = node / 25 % 5, w = node / 125;
      f.push_back(static_cast<std::uint16_t>(x + 2 * y + 3 * z + 4 * w));
      u.insert(u.end(), {QJ_TABLE_VERSOR, 0, 0, 0});
    }
    layout = context.upload_real(reals, precision);
    bricks = context.upload<std::int32_t>(std::vector<std::int32_t>{0});
    fields = context.upload<std::uint16_t>(f);
    versors = context.upload<std::int8_t>(u);
  }

  static double field_at(const Quaternion& q) {
    return 0.25 * (q.x + 1 + 2 * (q.y + 1) + 3 * (q.z + 1) + 4 * (q.w + 1)) / 0.5 - 2;
  }
};

constexpr std::size_t kTablePoints = 64;  // a multiple of every width

/// Four arrays of coordinates, each between -0.99 and 0.99.
std::vector<double> table_points() {
  base::Random random(5);
  std::vector<double> points(4 * kTablePoints);
  for (double& c : points) c = random.uniform(-0.99, 0.99);
  return points;
}

Quaternion table_point(const std::vector<double>& points, std::size_t i) {
  return {points[i], points[kTablePoints + i], points[2 * kTablePoints + i],
          points[3 * kTablePoints + i]};
}

/// F and U at points.
double image_table(const Device& device, Precision precision) {
  const std::vector<double> points = table_points();
  std::vector<double> right(5 * kTablePoints), found(right.size());
  for (std::size_t i = 0; i < kTablePoints; ++i) {
    right[i] = SmallTable::field_at(table_point(points, i));
    right[kTablePoints + i] = 1;
  }
  device::Context& context = device.context();
  const SmallTable table(context, precision);
  const int width = device.lane_width(precision);
  const std::size_t groups = kTablePoints / static_cast<std::size_t>(width);
  const auto images = context.allocate_real(found.size(), precision);
  context.launch(
      context.kernel("image_table.cl", "table_images", {width, precision, {}}), {{groups, 1, 1}},
      {context.upload_real(points, precision), device::narrow(kTablePoints), device::narrow(groups),
       table.layout, table.bricks, table.fields, table.versors, images});
  context.read(images, found);
  return largest_difference(found, right);
}

/// F_2 of orbits whose second iterate is looked up: the ball's map takes q to q², and here to
/// e^F (q / |q|)² with an F that is given.
double looked_up(const Device& device, Precision precision) {
  constexpr double kFirst = -0.3;
  constexpr int kDone = 1, kLast = 2;
  const std::vector<double> points = table_points();
  std::vector<double> right, found(kTablePoints);
  for (std::size_t i = 0; i < kTablePoints; ++i) {
    const Quaternion q = table_point(points, i);
    right.push_back(SmallTable::field_at(std::exp(kFirst) / (norm(q) * norm(q)) * (q * q)));
  }
  const map::DeviceMap map(device, unit_ball(), {}, precision);
  device::Context& context = device.context();
  const SmallTable table(context, precision);
  const std::size_t groups = map.groups(kTablePoints);
  const auto ends = context.allocate_real(found.size(), precision);
  context.launch(map.kernel("look_up.cl", "look_up_rest"), {{groups, 1, 1}},
                 {context.upload_real(points, precision),
                  context.upload_real(std::vector<double>(kTablePoints, kFirst), precision),
                  device::narrow(kTablePoints),
                  context.upload<std::int32_t>(surface::all_numbers(kTablePoints)), 0,
                  device::narrow(groups), map.buffer(), map.factors(), kDone, kLast, table.layout,
                  table.bricks, table.fields, table.versors, ends});
  context.read(ends, found);
  return largest_difference(found, right);
}

/// For a tolerance: the program is built in double precision only.
constexpr double kNotBuilt = -1;

struct Check {
  const char* program;
  const char* compared;
  double in_single, in_double;  ///< tolerances
  double (*difference)(const Device& device, Precision precision);
};

/// Every program there is: those first that others build on.
constexpr std::array kChecks{
    Check{"limits.cl", "copies and multiply-adds", 1e-6, 1e-14, limits},
    Check{"lane_math_probe.cl", "elementary functions, with the host's", 1e-6, 1e-14, lane_math},
    Check{"reduce.cl", "sums of whole numbers", 0, 0, reduced},
    Check{"field.cl", "F_4 at points, with the reference", 1e-4, 1e-10, field},
    Check{"field_queries.cl", "images and gradients at points, with the reference", 1e-4, 1e-10,
          field_queries},
    Check{"energy.cl", "F_4 at samples, with the reference", 1e-4, 1e-10,
          evaluated<fields, kIterations>},
    Check{"gradient_potential.cl", "gradient at n = 1, with the reference", 1e-4, 1e-10,
          evaluated<gradient, 1>},
    Check{"gradient_orbit.cl", "gradient at n = 4, with the reference", 1e-4, 1e-10,
          evaluated<gradient, kIterations>},
    Check{"gauss_newton.cl", "Gauss-Newton matrix, with the reference", 1e-4, 1e-10,
          evaluated<gauss_newton, 1>},
    Check{"cholesky.cl", "a factorised matrix, with the host's", kNotBuilt, 1e-5, cholesky},
    Check{"signed_distance.cl", "distances from a cube", 1e-5, 1e-12, signed_distance},
    Check{"level_set.cl", "F_4 on a grid, with the reference", 1e-4, 1e-6, level_set},
    Check{"interpolated_orbit.cl", "surface of a ball, in cells", 0.5, 0.5, interpolated_surface},
    Check{"place_vertices.cl", "vertices of a ball, in cells", 0.011, 0.011, placed_vertices},
    Check{"image_lattice.cl", "cells that are wrong", 0, 0, image_lattice},
    Check{"image_table.cl", "images from a table", 1e-5, 1e-12, image_table},
    Check{"look_up.cl", "ends of orbits that are looked up", 1e-5, 1e-12, looked_up},
    Check{"ray_march.cl", "depths of a ball, in a ray's tolerance", 1, 1, depths<false>},
    Check{"ray_grid.cl", "coarse depths of a ball, in the same", 2, 2, depths<true>},
    Check{"orbit_trait.cl", "angles of a ball's orbits", 1e-4, 1e-6, orbit_trait},
    Check{"shade.cl", "normals of a ball", 0.1, 0.1, shade},
};

double tolerance_of(const Check& check, Precision precision) {
  return precision == Precision::dbl ? check.in_double : check.in_single;
}

ProgramCheck run(const Check& check, const Device& device, Precision precision) {
  const double tolerance = tolerance_of(check, precision);
  ProgramCheck result{check.program, precision, check.compared, kInfinite, tolerance, {}};
  try {
    result.difference = check.difference(device, precision);
  } catch (const KernelBuildError& error) {
    result.is_built = false;
    result.problem = error.what();
  } catch (const Error& error) {
    result.problem = error.what();
  }
  return result;
}

}  // namespace

bool SelfTestReport::has_passed() const {
  return !checks.empty() && std::ranges::all_of(checks, &ProgramCheck::has_passed);
}

SelfTestReport self_test(const Device& device, const ProgressMonitor& monitor) {
  SelfTestReport report{device.info(), device.layout(), {}};
  std::vector<Precision> precisions{Precision::single};
  if (device.info().has_double) precisions.push_back(Precision::dbl);
  const double all = static_cast<double>(precisions.size() * std::size(kChecks));
  for (const Precision precision : precisions) {
    for (const Check& check : kChecks) {
      if (tolerance_of(check, precision) == kNotBuilt) continue;
      throw_if_stopped(monitor.stop);
      monitor.report({"checking", static_cast<double>(report.checks.size()) / all, -1,
                      std::string(check.program)});
      report.checks.push_back(run(check, device, precision));
    }
  }
  monitor.report({"checking", 1, 0, ""});
  return report;
}

nlohmann::json to_json(const SelfTestReport& report) {
  nlohmann::json checks = nlohmann::json::array();
  for (const ProgramCheck& c : report.checks) {
    checks.push_back(
        {{"program", c.program},
         {"precision", to_string(c.precision)},
         {"passed", c.has_passed()},
         {"built", c.is_built},
         {"compared", c.compared},
         {"difference",
          std::isfinite(c.difference) ? nlohmann::json(c.difference) : nlohmann::json(nullptr)},
         {"tolerance", c.tolerance},
         {"problem", c.problem.empty() ? nlohmann::json(nullptr) : nlohmann::json(c.problem)}});
  }
  return {
      {"layout", to_string(report.layout)}, {"passed", report.has_passed()}, {"programs", checks}};
}

}  // namespace qjulia

#include "qjulia/edit/painting.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "base/range_check.hpp"
#include "lattice/level_set.hpp"
#include "mesh/mesh_report.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/paint_settings.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia {
namespace {

using Eigen::Vector3d;

/// Cells of a paint beyond the shape's box at each end.
constexpr int kAround = 2;
/// Shapes are sampled at no more points than this, and steps along their longest side, to find
/// their thickness.
constexpr double kMostSamples = 3e6;
constexpr int kMostSteps = 384;

/// What one cell has gathered.
struct Gathered {
  double sum = 0, weight = 0;
};

/// A paint with the finest cells that are allowed over the box; map units.
Paint empty_paint(const Box& box) {
  Paint paint;
  Eigen::Map<Eigen::Array3i> cells(paint.cells.data());
  paint.step = box.size().maxCoeff() / (Paint::kMostCells - 2 * kAround);
  for (;; paint.step *= 1.01) {
    cells = (box.size().array() / paint.step).ceil().cast<int>() + 2 * kAround;
    if (cells.maxCoeff() <= Paint::kMostCells && paint.size() <= Paint::kMostInAll) break;
  }
  paint.origin = box.center() - 0.5 * paint.step * cells.cast<double>().matrix();
  paint.shares.resize(paint.size());
  paint.validate();
  return paint;
}

Eigen::Vector3i cells_of(const Paint& paint) { return Eigen::Vector3i(paint.cells.data()); }

/// Calls `visit(number, center)` for each cell.
template <class Visit>
void for_cells(const Paint& paint, const Visit& visit) {
  surface::for_points(cells_of(paint), [&](std::size_t number, const Eigen::Vector3i& at) {
    visit(number, paint.center(at.x(), at.y(), at.z()));
  });
}

/// Adds a value to what the cell that holds `x` has gathered; not beyond the grid.
void gather(const Paint& paint, const Vector3d& x, double value, double weight,
            std::vector<Gathered>& gathered) {
  const Eigen::Array3d at = ((x - paint.origin) / paint.step).array().floor();
  const Eigen::Vector3i cells = cells_of(paint);
  if (!(at >= 0).all() || !(at < cells.cast<double>().array()).all()) return;
  Gathered& cell = gathered[surface::number_of(at.cast<int>(), cells)];
  cell.sum += weight * value;
  cell.weight += weight;
}

/// The means of what cells have gathered; from these on outwards, layer by layer, those of the
/// neighbours that have a value, until all have one.
std::vector<double> spread(const Paint& paint, const std::vector<Gathered>& gathered) {
  constexpr double kUnknown = -1;
  std::vector<double> values(gathered.size(), kUnknown);
  for (std::size_t i = 0; i < gathered.size(); ++i) {
    if (gathered[i].weight > 0) values[i] = gathered[i].sum / gathered[i].weight;
  }
  const Eigen::Vector3i cells = cells_of(paint);
  std::vector<std::pair<std::size_t, double>> found;
  do {
    found.clear();
    surface::for_points(cells, [&](std::size_t number, const Eigen::Vector3i& at) {
      if (values[number] != kUnknown) return;
      double sum = 0, count = 0;
      surface::for_around(cells, at, 1, [&](std::size_t neighbor, const Eigen::Vector3i&) {
        if (values[neighbor] == kUnknown) return;
        sum += values[neighbor];
        ++count;
      });
      if (count > 0) found.emplace_back(number, sum / count);
    });
    for (const auto& [number, value] : found) values[number] = value;
  } while (!found.empty());
  std::ranges::replace(values, kUnknown, 1.0);  // nothing was gathered anywhere
  return values;
}

/// Shares of a mesh's vertices, at points of its triangles nearer to each other than cells.
std::vector<double> paint_by_mesh(const Paint& paint, const PaintedMesh& mesh,
                                  const ShapeToMap& to_map, const ProgressMonitor& monitor) {
  std::vector<Gathered> gathered(paint.size());
  constexpr int kMostParts = 512;  // a triangle's side is cut into
  std::size_t number = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    if (++number % 4096 == 0) throw_if_stopped(monitor.stop);
    const std::array corners{to_map.to_map(mesh.vertices[a]), to_map.to_map(mesh.vertices[b]),
                             to_map.to_map(mesh.vertices[c])};
    const Vector3d ab = corners[1] - corners[0], ac = corners[2] - corners[0];
    const double area = ab.cross(ac).norm();
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    const int parts =
        std::clamp(static_cast<int>(std::ceil(3 * longest / paint.step)), 1, kMostParts);
    for (int i = 0; i < parts; ++i) {
      for (int j = 0; i + j < parts; ++j) {
        // The middle of a part, of those that stand upright.
        const double u = (i + 1.0 / 3) / parts, v = (j + 1.0 / 3) / parts;
        const double share = (1 - u - v) * static_cast<double>(mesh.shares[a]) +
                             u * static_cast<double>(mesh.shares[b]) +
                             v * static_cast<double>(mesh.shares[c]);
        gather(paint, corners[0] + u * ab + v * ac, share, (area + 1e-12) / (parts * parts),
               gathered);
      }
    }
  }
  return spread(paint, gathered);
}

/// Radii are rounded to a geometric series with this ratio.
constexpr double kRatio = 1.15;
/// A ball holds places this share of its radius beyond it: corners, and bumps of its own size.
constexpr double kBeyondBall = 0.1;
/// Stands for no point anywhere; its sums stay finite.
constexpr float kFar = 1e12F;

/// Lower envelope of parabolas (Felzenszwalb and Huttenlocher 2012): squares[i] becomes the least
/// (i − j)² + squares[j].
class EnvelopeAlong {
 public:
  explicit EnvelopeAlong(std::size_t most) : values_(most), place_(most), begins_(most + 1) {}

  void apply(float* squares, std::size_t stride, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) values_[i] = squares[i * stride];
    std::size_t last = 0;
    place_[0] = 0;
    begins_[0] = -std::numeric_limits<float>::infinity();
    begins_[1] = std::numeric_limits<float>::infinity();
    for (std::size_t i = 1; i < count; ++i) {
      float at = meeting(i, place_[last]);
      while (at <= begins_[last]) at = meeting(i, place_[--last]);
      place_[++last] = i;
      begins_[last] = at;
      begins_[last + 1] = std::numeric_limits<float>::infinity();
    }
    std::size_t part = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto x = static_cast<float>(i);
      while (begins_[part + 1] < x) ++part;
      const float away = x - static_cast<float>(place_[part]);
      squares[i * stride] = away * away + values_[place_[part]];
    }
  }

 private:
  /// Where the parabola of i becomes lower than that of j < i.
  float meeting(std::size_t i, std::size_t j) const {
    const auto a = static_cast<float>(i), b = static_cast<float>(j);
    return ((values_[i] - values_[j]) / (a - b) + a + b) / 2;
  }

  std::vector<float> values_;
  std::vector<std::size_t> place_;
  std::vector<float> begins_;
};

/// Squares of distances to the nearest point where `squares` is 0; elsewhere it is kFar. Steps.
void to_distances(const surface::Grid& grid, std::vector<float>& squares) {
  const auto nx = static_cast<std::size_t>(grid.points[0]);
  const auto ny = static_cast<std::size_t>(grid.points[1]);
  const auto nz = static_cast<std::size_t>(grid.points[2]);
  EnvelopeAlong envelope(std::max({nx, ny, nz}));
  for (std::size_t row = 0; row < ny * nz; ++row) envelope.apply(&squares[row * nx], 1, nx);
  for (std::size_t k = 0; k < nz; ++k) {
    for (std::size_t i = 0; i < nx; ++i) envelope.apply(&squares[k * nx * ny + i], nx, ny);
  }
  for (std::size_t i = 0; i < nx * ny; ++i) envelope.apply(&squares[i], nx * ny, nz);
}

/// A place just within the surface, and the radius of the largest ball in the shape that holds it
/// (its local thickness: Hildebrand and Rüegsegger 1997); map units.
struct ThicknessAt {
  Vector3d x;
  double radius = 0;
};

/// The thickness of the map's own shape (n = 1, without portals) at those points of the grid that
/// are inside and have a neighbour outside. Radii above `most` are `most`.
std::vector<ThicknessAt> local_thickness(const Device& device, const Map& map,
                                         const surface::Grid& grid, double most,
                                         const ProgressMonitor& monitor) {
  const Map plain = without_paint(without_portals(map));
  const surface::LevelSet set(device, plain, {}, 1);
  const std::vector<float> field = set.over(grid, surface::whole(grid));
  const auto level = static_cast<float>(map.dynamics.surface_level);
  // From a point inside to the nearest point outside: to the surface it is half a step less.
  std::vector<float> depth(field.size());
  std::ranges::transform(field, depth.begin(), [&](float f) { return f < level ? kFar : 0.0F; });
  to_distances(grid, depth);
  std::vector<std::size_t> rim;
  for (std::size_t i = 0; i < depth.size(); ++i) {
    if (depth[i] > 0 && depth[i] < 1.5F) rim.push_back(i);
    depth[i] = std::sqrt(depth[i]) - 0.5F;
  }
  // The opening by a ball of each radius: what lies within the radius of places so deep.
  std::vector<float> radii(rim.size(), 0.5F);
  std::vector<float> squares(depth.size());
  const double last = std::min(most / grid.step, double{*std::ranges::max_element(depth)});
  for (double radius = 1; radius < kRatio * last; radius *= kRatio) {
    throw_if_stopped(monitor.stop);
    const double used = std::min(radius, last);
    std::ranges::transform(depth, squares.begin(),
                           [&](float d) { return double{d} >= used ? 0.0F : kFar; });
    to_distances(grid, squares);
    const double reach = (1 + kBeyondBall) * used + 0.5;
    for (std::size_t i = 0; i < rim.size(); ++i) {
      if (double{squares[rim[i]]} <= reach * reach) radii[i] = static_cast<float>(used);
    }
  }
  std::vector<ThicknessAt> found;
  found.reserve(rim.size());
  for (std::size_t i = 0; i < rim.size(); ++i) {
    found.push_back(
        {grid.point(surface::index_of(rim[i], grid.points)), grid.step * double{radii[i]}});
  }
  return found;
}

/// min(1, c τ / δ) with τ the thickness of the shape there.
std::vector<double> of_thickness(const Device& device, const Map& map, const Paint& paint,
                                 const Box& box, double factor, const ProgressMonitor& monitor) {
  const double shell =
      *map.frame.detail * map.frame.own_diagonal().value() * map.frame.shape_to_map.scale;
  const Vector3d size = box.size();
  const double step = std::max(std::cbrt(size.prod() / kMostSamples), size.maxCoeff() / kMostSteps);
  // A layer of points outside all around.
  const surface::Grid grid = surface::grid_around(box, step, 1.5);
  const auto thickness = local_thickness(device, map, grid, shell / factor, monitor);
  std::vector<Gathered> gathered(paint.size());
  for (const auto& [x, radius] : thickness) {
    gather(paint, x, std::min(1.0, factor * radius / shell), 1, gathered);
  }
  return spread(paint, gathered);
}

/// How much of a mark a place gets: all of it within, none from two cells beyond on.
double weight_of(double beyond, double step) {
  const double t = std::clamp(1 - beyond / (2 * step), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

double beyond(const Box& box, const Vector3d& x) {
  return (box.low - x).cwiseMax(x - box.high).cwiseMax(0.0).norm();
}

/// The share at a place with a ball over it. @param step of the cells; shape units, as all here.
double under_ball(double share, const PaintBall& ball, const Vector3d& at, double step) {
  const double out = std::max(0.0, (at - ball.center).norm() - ball.radius);
  return std::lerp(share, ball.share, weight_of(out, step));
}

/// A paint of the map's own box, which says nothing yet.
Paint empty_paint_of(const Map& map) {
  if (!map.frame.box)
    throw InputError("the map does not say its \"box\": nothing says where to paint");
  return empty_paint(map.frame.shape_to_map.to_map(*map.frame.box));
}

void expect_share(const char* field, double share) {
  base::expect_between(field, share, 0.0, 1.0, "of the detail");
}

void expect_few(const char* field, std::size_t marks) {
  if (marks <= PaintOptions::kMostMarks) return;
  throw OptionError(field, fmt::format("at most {} are allowed", PaintOptions::kMostMarks));
}

}  // namespace

void PaintOptions::validate() const {
  expect_in_ranges(paint_settings(), *this);
  if (ramp) {
    if (ramp->axis < 0 || ramp->axis > 2) throw OptionError("ramp", "its axis is none of 0, 1, 2");
    expect_share("ramp", ramp->low);
    expect_share("ramp", ramp->high);
  }
  expect_few("balls", balls.size());
  expect_few("blocks", blocks.size());
  for (const PaintBall& ball : balls) {
    expect_share("balls", ball.share);
    if (!ball.center.allFinite()) throw OptionError("balls", "a center is not finite");
    if (!(ball.radius > 0 && std::isfinite(ball.radius))) {
      throw OptionError("balls",
                        fmt::format("a radius is {}; give a positive number", ball.radius));
    }
  }
  for (const PaintBlock& block : blocks) {
    expect_share("blocks", block.share);
    if (!(block.box.size().array() > 0).all() || !block.box.size().allFinite()) {
      throw OptionError("blocks", "a block is empty: give its low corner first");
    }
  }
  if (mesh && mesh->shares.size() != mesh->vertices.size()) {
    throw OptionError("mesh", "it must have a share for each vertex");
  }
  if (mesh) {
    shape::check_triangles(mesh->vertices, mesh->triangles);
    for (const float share : mesh->shares) expect_share("mesh", share);
  }
}

Paint painted(const Device& device, const Map& map, const PaintOptions& options,
              const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  Paint paint = empty_paint_of(map);
  if (options.thickness && !map.frame.detail) {
    throw InputError("the map does not say its \"detail\", which the thickness bounds");
  }
  const ShapeToMap& to_map = map.frame.shape_to_map;
  const Box box = to_map.to_map(*map.frame.box);
  std::vector<double> shares(paint.size(), options.elsewhere);
  if (options.ramp) {
    const PaintRamp& ramp = *options.ramp;
    for_cells(paint, [&](std::size_t number, const Vector3d& x) {
      const double t = std::clamp(
          (x[ramp.axis] - box.low[ramp.axis]) / std::max(1e-12, box.size()[ramp.axis]), 0.0, 1.0);
      shares[number] *= std::lerp(ramp.low, ramp.high, t);
    });
  }
  if (options.mesh) {
    const auto by = paint_by_mesh(paint, *options.mesh, to_map, monitor);
    std::ranges::transform(shares, by, shares.begin(), std::multiplies<>());
  }
  for_cells(paint, [&](std::size_t number, const Vector3d& x) {
    double& share = shares[number];
    const Vector3d at = to_map.to_shape(x);
    const double step = paint.step / to_map.scale;
    for (const PaintBlock& block : options.blocks) {
      share = std::lerp(share, block.share, weight_of(beyond(block.box, at), step));
    }
    for (const PaintBall& ball : options.balls) share = under_ball(share, ball, at, step);
  });
  if (options.thickness) {
    const auto most = of_thickness(device, map, paint, box, *options.thickness, monitor);
    std::ranges::transform(shares, most, shares.begin(),
                           [](double share, double bound) { return std::min(share, bound); });
  }
  std::ranges::transform(shares, paint.shares.begin(), painted_share);
  paint.validate();
  return paint;
}

Paint painted_over(const Map& map, const std::vector<PaintBall>& balls) {
  PaintOptions{.balls = balls}.validate();
  map.validate();
  Paint paint;
  if (map.layers.paint) {
    paint = *map.layers.paint;
  } else {
    paint = empty_paint_of(map);
    std::ranges::fill(paint.shares, std::uint8_t{Paint::kWhole});
  }
  const ShapeToMap& to_map = map.frame.shape_to_map;
  for_cells(paint, [&](std::size_t number, const Vector3d& x) {
    double share = (paint.shares[number] + 1.0) / (Paint::kWhole + 1);
    for (const PaintBall& ball : balls) {
      share = under_ball(share, ball, to_map.to_shape(x), paint.step / to_map.scale);
    }
    paint.shares[number] = painted_share(share);
  });
  return paint;
}

}  // namespace qjulia

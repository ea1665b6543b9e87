#include "qjulia/painting.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "base/range_check.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"
#include "surface/local_thickness.hpp"

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
  const auto cells_of = [&](double step) {
    std::array<int, 3> cells{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double side = box.size()[static_cast<Eigen::Index>(axis)];
      cells[axis] = static_cast<int>(std::ceil(side / step)) + 2 * kAround;
    }
    return cells;
  };
  Paint paint;
  paint.step = box.size().maxCoeff() / (Paint::kMostCells - 2 * kAround);
  for (;; paint.step *= 1.01) {
    paint.cells = cells_of(paint.step);
    const bool fits = *std::ranges::max_element(paint.cells) <= Paint::kMostCells;
    if (fits && paint.size() <= Paint::kMostInAll) break;
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto row = static_cast<Eigen::Index>(axis);
    paint.origin[row] = box.center()[row] - 0.5 * paint.step * paint.cells[axis];
  }
  paint.shares.resize(paint.size());
  return paint;
}

/// Calls `visit(number, center)` for each cell.
template <class Visit>
void for_cells(const Paint& paint, const Visit& visit) {
  std::size_t number = 0;
  for (int k = 0; k < paint.cells[2]; ++k) {
    for (int j = 0; j < paint.cells[1]; ++j) {
      for (int i = 0; i < paint.cells[0]; ++i) visit(number++, paint.center(i, j, k));
    }
  }
}

/// The cell that holds a place; none beyond the grid.
std::optional<std::size_t> cell_at(const Paint& paint, const Vector3d& x) {
  std::size_t number = 0;
  for (std::size_t i = 3; i-- > 0;) {
    const auto row = static_cast<Eigen::Index>(i);
    const double u = std::floor((x[row] - paint.origin[row]) / paint.step);
    if (!(u >= 0 && u < paint.cells[i])) return std::nullopt;
    number = number * static_cast<std::size_t>(paint.cells[i]) + static_cast<std::size_t>(u);
  }
  return number;
}

/// The means of what cells have gathered; from these on outwards, layer by layer, those of the
/// neighbours that have a value, until all have one.
std::vector<double> spread(const Paint& paint, const std::vector<Gathered>& gathered) {
  const auto [nx, ny, nz] = paint.cells;
  constexpr double kUnknown = -1;
  std::vector<double> values(gathered.size(), kUnknown);
  for (std::size_t i = 0; i < gathered.size(); ++i) {
    if (gathered[i].weight > 0) values[i] = gathered[i].sum / gathered[i].weight;
  }
  for (bool has_grown = true; has_grown;) {
    has_grown = false;
    std::vector<std::pair<std::size_t, double>> found;
    std::size_t number = 0;
    for (int k = 0; k < nz; ++k) {
      for (int j = 0; j < ny; ++j) {
        for (int i = 0; i < nx; ++i, ++number) {
          if (values[number] != kUnknown) continue;
          double sum = 0, count = 0;
          for (int c = std::max(0, k - 1); c <= std::min(nz - 1, k + 1); ++c) {
            for (int b = std::max(0, j - 1); b <= std::min(ny - 1, j + 1); ++b) {
              for (int a = std::max(0, i - 1); a <= std::min(nx - 1, i + 1); ++a) {
                const int neighbor = (c * ny + b) * nx + a;
                const double value = values[static_cast<std::size_t>(neighbor)];
                if (value == kUnknown) continue;
                sum += value;
                ++count;
              }
            }
          }
          if (count > 0) found.emplace_back(number, sum / count);
        }
      }
    }
    for (const auto& [at, value] : found) values[at] = value;
    has_grown = !found.empty();
  }
  for (double& value : values) {
    if (value == kUnknown) value = 1;  // nothing was gathered anywhere
  }
  return values;
}

/// Shares of a mesh's vertices, at points of its triangles nearer to each other than cells.
std::vector<double> of_mesh(const Paint& paint, const PaintedMesh& mesh, const ShapeToMap& to_map,
                            const ProgressMonitor& monitor) {
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
        const auto cell = cell_at(paint, corners[0] + u * ab + v * ac);
        if (!cell) continue;
        const double share = (1 - u - v) * static_cast<double>(mesh.shares[a]) +
                             u * static_cast<double>(mesh.shares[b]) +
                             v * static_cast<double>(mesh.shares[c]);
        const double weight = (area + 1e-12) / (parts * parts);
        gathered[*cell].sum += weight * share;
        gathered[*cell].weight += weight;
      }
    }
  }
  return spread(paint, gathered);
}

/// min(1, c τ / δ) with τ the thickness of the shape there.
std::vector<double> of_thickness(const Device& device, const RationalMap& map, const Paint& paint,
                                 const Box& box, double factor, const ProgressMonitor& monitor) {
  const double shell = *map.detail * box.diagonal();
  surface::Grid grid;
  const Vector3d size = box.size();
  grid.step = std::max(std::cbrt(size.prod() / kMostSamples), size.maxCoeff() / kMostSteps);
  // A layer of points outside all around.
  grid.origin = box.low.array() - 1.5 * grid.step;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    grid.points[axis] =
        static_cast<int>(std::ceil(size[static_cast<Eigen::Index>(axis)] / grid.step)) + 4;
  }
  const auto thickness = surface::local_thickness(device, map, grid, shell / factor, monitor);
  std::vector<Gathered> gathered(paint.size());
  for (const auto& [x, radius] : thickness) {
    const auto cell = cell_at(paint, x);
    if (!cell) continue;
    gathered[*cell].sum += std::min(1.0, factor * radius / shell);
    gathered[*cell].weight += 1;
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

void expect_share(const char* field, double share) {
  base::expect_between(field, share, 0.0, 1.0, "of the detail");
}

}  // namespace

void PaintOptions::validate() const {
  expect_share("elsewhere", elsewhere);
  if (ramp) {
    if (ramp->axis < 0 || ramp->axis > 2) throw OptionError("ramp", "its axis is none of 0, 1, 2");
    expect_share("ramp", ramp->low);
    expect_share("ramp", ramp->high);
  }
  if (balls.size() > kMostMarks) {
    throw OptionError("balls", fmt::format("at most {} are allowed", kMostMarks));
  }
  if (blocks.size() > kMostMarks) {
    throw OptionError("blocks", fmt::format("at most {} are allowed", kMostMarks));
  }
  for (const PaintBall& ball : balls) {
    expect_share("balls", ball.share);
    if (!ball.center.allFinite()) throw OptionError("balls", "a center is not finite");
    base::expect_positive("balls", ball.radius);
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
  if (thickness) base::expect_between("thickness", *thickness, 0.01, 2.0, "of the shape's own");
}

Paint painted(const Device& device, const RationalMap& map, const PaintOptions& options,
              const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  if (!map.box) throw InputError("the map does not say its \"box\": nothing says where to paint");
  if (options.thickness && !map.detail) {
    throw InputError("the map does not say its \"detail\", which the thickness bounds");
  }
  const ShapeToMap& to_map = map.shape_to_map;
  const Box box = to_map.to_map(*map.box);
  Paint paint = empty_paint(box);
  std::vector<double> shares(paint.size(), options.elsewhere);
  const auto multiply = [&](const std::vector<double>& by) {
    std::ranges::transform(shares, by, shares.begin(), std::multiplies<>());
  };
  if (options.ramp) {
    const PaintRamp& ramp = *options.ramp;
    for_cells(paint, [&](std::size_t number, const Vector3d& x) {
      const double t = std::clamp(
          (x[ramp.axis] - box.low[ramp.axis]) / std::max(1e-12, box.size()[ramp.axis]), 0.0, 1.0);
      shares[number] *= std::lerp(ramp.low, ramp.high, t);
    });
  }
  if (options.mesh) multiply(of_mesh(paint, *options.mesh, to_map, monitor));
  for_cells(paint, [&](std::size_t number, const Vector3d& x) {
    double& share = shares[number];
    const Vector3d at = to_map.to_shape(x);
    const double step = paint.step / to_map.scale;
    for (const PaintBlock& block : options.blocks) {
      share = std::lerp(share, block.share, weight_of(beyond(block.box, at), step));
    }
    for (const PaintBall& ball : options.balls) {
      const double out = std::max(0.0, (at - ball.center).norm() - ball.radius);
      share = std::lerp(share, ball.share, weight_of(out, step));
    }
  });
  if (options.thickness) {
    const auto most = of_thickness(device, map, paint, box, *options.thickness, monitor);
    std::ranges::transform(shares, most, shares.begin(),
                           [](double share, double bound) { return std::min(share, bound); });
  }
  std::ranges::transform(shares, paint.shares.begin(), painted_share);
  return paint;
}

}  // namespace qjulia

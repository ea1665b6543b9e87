#include "surface/local_thickness.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "qjulia/field.hpp"
#include "surface/level_set.hpp"

namespace qjulia::surface {
namespace {

/// Radii that are told apart, each so many times the one before.
constexpr double kRatio = 1.15;
/// A ball holds places this share of its radius beyond it: corners, and bumps of its own size.
constexpr double kBeyond = 0.1;
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
void to_distances(const Grid& grid, std::vector<float>& squares) {
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

}  // namespace

std::vector<ThicknessAt> local_thickness(const Device& device, const RationalMap& map,
                                         const Grid& grid, double most,
                                         const ProgressMonitor& monitor) {
  const RationalMap plain = without_paint(without_portals(map));
  const LevelSet set(device, plain, {}, 1);
  const std::vector<float> field = set.over(grid, whole(grid));
  const auto level = static_cast<float>(map.surface_level);
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
    const double reach = (1 + kBeyond) * used + 0.5;
    for (std::size_t i = 0; i < rim.size(); ++i) {
      if (double{squares[rim[i]]} <= reach * reach) radii[i] = static_cast<float>(used);
    }
  }
  std::vector<ThicknessAt> found;
  found.reserve(rim.size());
  const auto nx = static_cast<std::size_t>(grid.points[0]);
  const auto ny = static_cast<std::size_t>(grid.points[1]);
  for (std::size_t i = 0; i < rim.size(); ++i) {
    const std::size_t row = rim[i] / nx, layer = row / ny;
    const Eigen::Vector3d index(static_cast<double>(rim[i] % nx), static_cast<double>(row % ny),
                                static_cast<double>(layer));
    found.push_back({grid.at(index), grid.step * static_cast<double>(radii[i])});
  }
  return found;
}

}  // namespace qjulia::surface

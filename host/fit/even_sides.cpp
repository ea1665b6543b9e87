#include "fit/even_sides.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "map/sphere_directions.hpp"

namespace qjulia::fitting {
namespace {

constexpr int kMostSweeps = 4;
/// Factors times points: takes about half a second for all sweeps.
constexpr Eigen::Index kPairs = Eigen::Index{20} << 20;
constexpr Eigen::Index kMostDirections = 2048, kLeastDirections = 128;

/// Radii at which F₁ is taken in each direction, over e^L.
constexpr std::array<float, 9> kRadii{0.5F, 0.65F, 0.8F, 0.9F, 1.0F, 1.1F, 1.25F, 1.5F, 2.0F};
constexpr auto kRows = static_cast<Eigen::Index>(kRadii.size());
constexpr Eigen::Index kMiddleRow = 4;

/// A row for each radius, a column for each direction.
using Values = Eigen::ArrayXXf;

/// ln of the radius at which a column first reaches the level, between two radii by interpolation.
float log_crossing(const Eigen::Ref<const Eigen::ArrayXf>& column, float level) {
  const auto log_radius = [](Eigen::Index row) {
    return std::log(kRadii[static_cast<std::size_t>(row)]);
  };
  Eigen::Index row = 0;
  while (row < kRows && column(row) < level) ++row;
  if (row == 0 || row == kRows) return log_radius(std::min(row, kRows - 1));
  const float share = (level - column(row - 1)) / (column(row) - column(row - 1));
  return std::lerp(log_radius(row - 1), log_radius(row), share);
}

double unevenness(const Values& field) {
  std::vector<float> middle(static_cast<std::size_t>(field.cols()));
  Eigen::Map<Eigen::ArrayXf>(middle.data(), field.cols()) = field.row(kMiddleRow).transpose();
  const auto median = middle.begin() + field.cols() / 2;
  std::ranges::nth_element(middle, median);
  double sum = 0;
  for (const auto& column : field.colwise()) sum += std::abs(log_crossing(column, *median));
  return sum / static_cast<double>(field.cols());
}

/// Points about the origin.
class Surroundings {
 public:
  explicit Surroundings(const RationalMap& map) {
    const auto factors = std::max(std::ssize(map.factors), std::ptrdiff_t{1});
    const auto directions = map::sphere_directions(static_cast<std::size_t>(
        std::clamp(kPairs / kRows / factors, kLeastDirections, kMostDirections)));
    for (Values& values : points_) values.resize(kRows, std::ssize(directions));
    for (Eigen::Index column = 0; column < std::ssize(directions); ++column) {
      const Quaternion u =
          std::exp(map.surface_level) * directions[static_cast<std::size_t>(column)];
      const std::array coordinates{u.x, u.y, u.z, u.w};
      for (std::size_t i = 0; i < points_.size(); ++i) {
        points_[i].col(column) = static_cast<float>(coordinates[i]) *
                                 Eigen::Map<const Eigen::ArrayXf>(kRadii.data(), kRows);
      }
    }
  }

  /// Squared distances.
  Values distances2(const Quaternion& center) const {
    constexpr float kTiny = 1e-12F;
    const auto to = [](const Values& values, double c) {
      return (values - static_cast<float>(c)).square();
    };
    return to(points_[0], center.x) + to(points_[1], center.y) + to(points_[2], center.z) +
           to(points_[3], center.w) + kTiny;
  }

  /// F₁ less S.
  Values field(const RationalMap& map) const {
    Values sum = Values::Zero(points_[0].rows(), points_[0].cols());
    for (const auto& [center, exponent] : map.factors) {
      sum += static_cast<float>(0.5 * exponent) * distances2(center).log();
    }
    return sum;
  }

 private:
  std::array<Values, 4> points_;
};

}  // namespace

double unevenness(const RationalMap& map) { return unevenness(Surroundings(map).field(map)); }

RationalMap with_even_sides(const RationalMap& given) {
  RationalMap map = given;
  const Surroundings points(map);
  const auto mirrored = [&map](Quaternion center) {
    center.w = 2 * map.slice - center.w;
    return center;
  };
  for (Factor& factor : map.factors) {
    if (factor.center.w < map.slice) factor.center = mirrored(factor.center);
  }
  Values field = points.field(map);
  double least = unevenness(field);
  Values tried;
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    bool moved = false;
    for (auto& [center, exponent] : map.factors) {
      const Quaternion other = mirrored(center);
      tried = field + static_cast<float>(0.5 * exponent) *
                          (points.distances2(other) / points.distances2(center)).log();
      const double value = unevenness(tried);
      if (!(value < least)) continue;
      least = value;
      field.swap(tried);
      center = other;
      moved = true;
    }
    if (!moved) break;
  }
  return least < unevenness(points.field(given)) ? map : given;
}

}  // namespace qjulia::fitting

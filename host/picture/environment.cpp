#include "picture/environment.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "layout/picture_layout.h"

namespace qjulia::picture {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kPi = std::numbers::pi;
constexpr int kSharpest = 1024;  ///< columns of what is seen behind the set and in mirrors
constexpr int kBlurredWide = QJ_ENVIRONMENT_WIDTH, kBlurredHigh = QJ_ENVIRONMENT_HEIGHT;

double luminance_of(const Vector3d& c) { return c.dot(Vector3d(0.2126, 0.7152, 0.0722)); }
double luminance_of(const Vector3f& c) { return luminance_of(Vector3d(c.cast<double>())); }

/// Texels with directions and solid angles, for sums over all of them.
struct Texel {
  Vector3f towards, light;  ///< radiance · steradians
  float steradians;
};

std::vector<Texel> texels_of(const Environment& map) {
  std::vector<Texel> texels;
  for (int row = 0; row < map.height; ++row) {
    const auto steradians = static_cast<float>(map.steradians(row));
    for (int column = 0; column < map.width; ++column) {
      texels.push_back(
          {map.towards(column, row).cast<float>(), steradians * map.at(column, row), steradians});
    }
  }
  return texels;
}

/// The mean of the sky over directions about each direction of a map, by a weight of the cosine
/// that is 0 below `least`.
template <class Weight>
void add_blurred(const std::vector<Texel>& sky, double least, const Weight& weight,
                 std::vector<float>& out) {
  const auto least_cosine = static_cast<float>(least);
  const Environment shape{kBlurredWide, kBlurredHigh, {}};
  for (int row = 0; row < kBlurredHigh; ++row) {
    for (int column = 0; column < kBlurredWide; ++column) {
      const Vector3f axis = shape.towards(column, row).cast<float>();
      Vector3f sum = Vector3f::Zero();
      float weights = 0;
      for (const Texel& texel : sky) {
        const float cosine = axis.dot(texel.towards);
        if (cosine <= least_cosine) continue;
        const float share = weight(cosine);
        sum += share * texel.light;
        weights += share * texel.steradians;
      }
      sum /= weights;
      out.insert(out.end(), sum.data(), sum.data() + 3);
    }
  }
}

/// What a surface of this roughness shows of even surroundings' parts: GGX's distribution of
/// half-vectors, by the cosine, as seen along the normal (Karis 2013).
void add_reflected(const std::vector<Texel>& sky, double roughness, std::vector<float>& out) {
  constexpr double kLeastShare = 1e-3;  // of the distribution's peak
  const double a2 = std::min(std::pow(roughness, 4), 0.999);
  // Where 1 / (c² (a² − 1) + 1)² has fallen to this share of 1 / a⁴.
  const double half_cos2 = (a2 / std::sqrt(kLeastShare) - 1) / (a2 - 1);
  const double least = std::max(2 * half_cos2 - 1, 0.0);
  add_blurred(
      sky, least,
      [a2 = static_cast<float>(a2)](float cosine) {
        const float bottom = 0.5F * (1 + cosine) * (a2 - 1) + 1;
        return cosine / (bottom * bottom);
      },
      out);
}

void add_texels(const Environment& map, std::vector<float>& out) {
  for (const Vector3f& c : map.radiance) out.insert(out.end(), c.data(), c.data() + 3);
}

/// A rectangle of texels, columns and rows from `first` to before `end`.
struct Part {
  int first_column, end_column, first_row, end_row;
  double light = 0;   ///< luminance
  double extent = 0;  ///< radians

  bool can_be_halved() const {
    return light > 0 && (end_column - first_column > 1 || end_row - first_row > 1);
  }
};

/// Sums of luminance over rectangles.
class LightSums {
 public:
  explicit LightSums(const Environment& map)
      : map_(map), wide_(static_cast<std::size_t>(map.width) + 1) {
    sums_.assign(wide_ * (static_cast<std::size_t>(map.height) + 1), 0);
    for (int row = 0; row < map.height; ++row) {
      double line = 0;
      for (int column = 0; column < map.width; ++column) {
        line += map.steradians(row) * luminance_of(map.at(column, row));
        at(column + 1, row + 1) = at(column + 1, row) + line;
      }
    }
  }

  Part part(int first_column, int end_column, int first_row, int end_row) {
    Part made{first_column, end_column, first_row, end_row};
    made.light = at(end_column, end_row) - at(first_column, end_row) - at(end_column, first_row) +
                 at(first_column, first_row);
    made.light = std::max(made.light, 0.0);  // rounding
    made.extent = std::max(wide(made), high(made));
    return made;
  }

  /// The halves.
  std::pair<Part, Part> halved(const Part& whole) {
    const bool is_by_columns =
        whole.end_row - whole.first_row < 2 ||
        (whole.end_column - whole.first_column > 1 && wide(whole) > high(whole));
    const int first = is_by_columns ? whole.first_column : whole.first_row;
    const int end = is_by_columns ? whole.end_column : whole.end_row;
    const auto before = [&](int cut) {
      return is_by_columns ? part(whole.first_column, cut, whole.first_row, whole.end_row)
                           : part(whole.first_column, whole.end_column, whole.first_row, cut);
    };
    int best = first + 1;
    for (int cut = first + 1; cut < end; ++cut) {
      if (std::abs(2 * before(cut).light - whole.light) <
          std::abs(2 * before(best).light - whole.light)) {
        best = cut;
      }
    }
    return {before(best), is_by_columns
                              ? part(best, whole.end_column, whole.first_row, whole.end_row)
                              : part(whole.first_column, whole.end_column, best, whole.end_row)};
  }

 private:
  double& at(int column, int row) {
    return sums_[static_cast<std::size_t>(row) * wide_ + static_cast<std::size_t>(column)];
  }
  double high(const Part& part) const {
    return kPi * (part.end_row - part.first_row) / map_.height;
  }
  double wide(const Part& part) const {
    const double middle = kPi * (part.first_row + part.end_row) / (2.0 * map_.height);
    return 2 * kPi * std::sin(middle) * (part.end_column - part.first_column) / map_.width;
  }

  const Environment& map_;
  std::size_t wide_;
  std::vector<double> sums_;
};

/// The light of some texels together.
class ConeSum {
 public:
  void add(const Environment& map, int column, int row) {
    const double steradians = map.steradians(row);
    const Vector3d light = steradians * map.at(column, row).cast<double>();
    cone_.towards += luminance_of(light) * map.towards(column, row);
    cone_.color += light / kPi;
    cone_.steradians += steradians;
  }
  Cone cone() const {
    Cone made = cone_;
    made.towards.normalize();
    return made;
  }

 private:
  Cone cone_{Vector3d::Zero(), Vector3d::Zero(), 0};
};

}  // namespace

Vector3d Environment::direction(double u, double v) {
  const double turn = 2 * kPi * (u - 0.5), fall = kPi * v;
  return {std::sin(turn) * std::sin(fall), std::cos(fall), -std::cos(turn) * std::sin(fall)};
}

double Environment::steradians(int row) const {
  const double band = std::cos(kPi * row / height) - std::cos(kPi * (row + 1) / height);
  return 2 * kPi * band / width;
}

Environment Environment::of_width(int columns) const {
  Environment made{columns, columns / 2, {}};
  const int steps = (columns + width - 1) / width;  // within a texel of this one
  const auto wide = static_cast<std::size_t>(columns);
  std::vector<Vector3d> sums(wide * wide / 2, Vector3d::Zero());
  std::vector<double> weights(sums.size());
  const auto cell = [steps](int place, int from, int to) {
    return static_cast<std::size_t>((2L * place + 1) * to / (2L * from * steps));
  };
  for (int row = 0; row < steps * height; ++row) {
    const double weight = steradians(row / steps);
    for (int column = 0; column < steps * width; ++column) {
      const std::size_t i = cell(row, height, made.height) * wide + cell(column, width, made.width);
      sums[i] += weight * at(column / steps, row / steps).cast<double>();
      weights[i] += weight;
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    made.radiance.emplace_back((sums[i] / weights[i]).cast<float>());
  }
  return made;
}

EnvironmentLight light_of(Environment whole) {
  // A sun is a spot about the brightest texel.
  constexpr double kSunShare = 1.0 / 9, kWidest = 0.14, kEdge = 0.05;  // radians, of the peak
  Environment sky = whole.reduced(kSharpest);
  const auto brightest =
      std::ranges::max_element(sky.radiance, {}, [](const Vector3f& c) { return luminance_of(c); });
  const auto place = static_cast<int>(brightest - sky.radiance.begin());
  const Vector3d middle = sky.towards(place % sky.width, place / sky.width);
  const double edge = kEdge * luminance_of(*brightest);
  ConeSum spot, all, around;
  std::vector<std::size_t> in_spot;
  for (int row = 0; row < sky.height; ++row) {
    for (int column = 0; column < sky.width; ++column) {
      all.add(sky, column, row);
      if (middle.dot(sky.towards(column, row)) < std::cos(kWidest)) continue;
      if (luminance_of(sky.at(column, row)) < edge) {
        around.add(sky, column, row);
        continue;
      }
      spot.add(sky, column, row);
      in_spot.push_back(static_cast<std::size_t>(row) * static_cast<std::size_t>(sky.width) +
                        static_cast<std::size_t>(column));
    }
  }
  constexpr double kSmall = 0.5 * kPi * kWidest * kWidest;
  const Cone found = spot.cone(), left = around.cone();
  EnvironmentLight light{std::move(whole), {}, {}};
  if (found.steradians < kSmall &&
      luminance_of(found.color) > kSunShare * luminance_of(all.cone().color)) {
    light.sun = found;
    // Where it was, the sky is as around it.
    const Vector3d radiance = kPi / left.steradians * left.color;
    light.sun->color -= found.steradians / kPi * radiance;
    for (const std::size_t i : in_spot) sky.radiance[i] = radiance.cast<float>();
  }
  light.sky = std::move(sky);
  return light;
}

std::vector<Cone> cones_of(const Environment& sky, int count) {
  const Environment map = sky.reduced(kBlurredWide);
  LightSums sums(map);
  std::vector<Part> parts{sums.part(0, map.width, 0, map.height)};
  const auto weight = [](const Part& part) {
    return part.can_be_halved() ? part.light * part.extent : 0;
  };
  while (static_cast<int>(parts.size()) < count) {
    const auto next = std::ranges::max_element(parts, {}, weight);
    if (weight(*next) <= 0) break;
    const auto [one, other] = sums.halved(*next);
    *next = one;
    parts.push_back(other);
  }
  std::vector<Cone> cones;
  for (const Part& part : parts) {
    if (part.light <= 0) continue;
    ConeSum sum;
    for (int row = part.first_row; row < part.end_row; ++row) {
      for (int column = part.first_column; column < part.end_column; ++column) {
        sum.add(map, column, row);
      }
    }
    cones.push_back(sum.cone());
  }
  return cones;
}

EnvironmentMaps environment_maps(const EnvironmentLight& light, const Vector3d& color) {
  const Environment whole = light.whole.reduced(kSharpest);
  EnvironmentMaps maps{whole.width, whole.height, {}};
  add_texels(whole, maps.texels);
  add_texels(light.sky, maps.texels);
  // Narrow lobes need a fine map, and wide ones have many texels in a coarse one.
  constexpr int kNarrow = 2;
  const std::vector<Texel> fine = texels_of(light.sky.of_width(kBlurredWide)),
                           coarse = texels_of(light.sky.of_width(kBlurredWide / 2));
  for (int level = 1; level <= QJ_ENVIRONMENT_LEVELS; ++level) {
    add_reflected(level <= kNarrow ? fine : coarse, double(level) / QJ_ENVIRONMENT_LEVELS,
                  maps.texels);
  }
  add_blurred(
      coarse, 0, [](float cosine) { return cosine; }, maps.texels);
  for (std::size_t i = 0; i < maps.texels.size(); ++i) {
    maps.texels[i] *= static_cast<float>(color[static_cast<Eigen::Index>(i % 3)]);
  }
  return maps;
}

}  // namespace qjulia::picture

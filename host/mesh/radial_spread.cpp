#include "qjulia/mesh/radial_spread.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

constexpr double kWantedCells = 256;  // along the longest side of the grid that roughness is for
constexpr double kThickest = 0.03;
/// A triangle is halved until its sides are at most this share of its distance from the origin.
constexpr double kLongestSide = 0.25;
constexpr int kMostHalvings = 16;

/// Part of a surface as seen from the origin.
struct Patch {
  double log_radius;
  double share;  ///< of the sphere, as far as it covers that; negative where its outer side faces
                 ///< the origin
};

/// Solid angle over 4π (van Oosterom & Strackee 1983).
double share_of_sphere(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                       const Eigen::Vector3d& c) {
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return std::atan2(a.dot(b.cross(c)),
                    la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) /
         (2 * std::numbers::pi);
}

void add_patches(Eigen::Vector3d a, Eigen::Vector3d b, Eigen::Vector3d c, int halvings,
                 std::vector<Patch>& patches) {
  double ab = (b - a).squaredNorm();
  const double bc = (c - b).squaredNorm(), ca = (a - c).squaredNorm();
  const Eigen::Vector3d middle = (a + b + c) / 3;
  const double longest = std::max({ab, bc, ca});
  if (halvings == 0 || longest <= kLongestSide * kLongestSide * middle.squaredNorm()) {
    patches.push_back({std::log(middle.norm()), share_of_sphere(a, b, c)});
    return;
  }
  // Renames the corners so that the longest side is from a to b.
  for (; ab < longest; ab = (b - a).squaredNorm()) {
    const Eigen::Vector3d first = a;
    a = b, b = c, c = first;
  }
  const Eigen::Vector3d half = (a + b) / 2;
  add_patches(a, half, c, halvings - 1, patches);
  add_patches(half, b, c, halvings - 1, patches);
}

/// How many times the detail of `automatic` it is.
double of_automatic(DetailWord word) {
  switch (word) {
    case DetailWord::automatic:
      return 1;
    case DetailWord::smooth:
      return 0.125;
    case DetailWord::clear:
      return 0.5;
    case DetailWord::wild:
      break;
  }
  return 2;
}

}  // namespace

RadialSpread radial_spread(const TriangleMesh& mesh, const Eigen::Vector3d& origin) {
  mesh.validate();
  std::vector<Patch> patches;
  patches.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    add_patches(mesh.vertices[a] - origin, mesh.vertices[b] - origin, mesh.vertices[c] - origin,
                kMostHalvings, patches);
  }
  double whole = 0;
  for (const Patch& patch : patches) whole += patch.share;
  if (!(std::abs(whole) > 0.5)) {
    throw InputError("the origin is not inside the mesh: close it, or turn its parts outward");
  }
  std::ranges::sort(patches, {}, [](const Patch& p) { return std::pair(p.log_radius, p.share); });
  RadialSpread spread;
  double inside = 1;
  for (std::size_t i = 0; i + 1 < patches.size(); ++i) {
    inside -= patches[i].share / whole;
    const double share = std::clamp(inside, 0.0, 1.0);
    spread.of_log_radii +=
        share * (1 - share) * (patches[i + 1].log_radius - patches[i].log_radius);
  }
  const Box box = mesh.box();
  spread.longest_side = (box.high - box.low).maxCoeff() / box.diagonal();
  return spread;
}

double chosen_detail(const DetailChoice& detail, const RadialSpread& spread,
                     const DetailRule& rule) {
  if (const auto* number = std::get_if<double>(&detail)) return *number;
  const double automatic =
      rule.cells / kWantedCells * spread.longest_side / std::pow(spread.of_log_radii, rule.power);
  return of_automatic(std::get<DetailWord>(detail)) * std::min(automatic, kThickest);
}

}  // namespace qjulia

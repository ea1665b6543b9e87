#include "qjulia/detail_choice.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace qjulia {
namespace {

constexpr double kThinnessOfBall = 6 * std::numbers::sqrt3;
constexpr double kThickest = 0.02;
/// x is capped at kThinnest, or at kBearable x where that is larger (x > 70).
constexpr double kThinnest = 30, kBearable = 3.0 / 7;

struct Meaning {
  const char* name;
  double of_automatic;
};

Meaning meaning(DetailWord word) {
  switch (word) {
    case DetailWord::automatic:
      return {"auto", 1};
    case DetailWord::smooth:
      return {"smooth", 0.125};
    case DetailWord::clear:
      return {"clear", 0.5};
    case DetailWord::wild:
      break;
  }
  return {"wild", 2};
}

}  // namespace

std::string to_string(const DetailChoice& detail) {
  if (const auto* word = std::get_if<DetailWord>(&detail)) return meaning(*word).name;
  return fmt::format("{}", std::get<double>(detail));
}

double thinness(const TriangleMesh& mesh) {
  mesh.validate();
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& p = mesh.vertices[a];
    area += 0.5 * (mesh.vertices[b] - p).cross(mesh.vertices[c] - p).norm();
  }
  return mesh.box().diagonal() * area / signed_volume(oriented_outward(mesh));
}

double chosen_detail(const DetailChoice& detail, double thinness, double share) {
  if (const auto* number = std::get_if<double>(&detail)) return *number;
  const double beyond = std::max(thinness - kThinnessOfBall, share / kThickest);
  return meaning(std::get<DetailWord>(detail)).of_automatic * share /
         std::min(beyond, std::max(kThinnest, kBearable * beyond));
}

}  // namespace qjulia

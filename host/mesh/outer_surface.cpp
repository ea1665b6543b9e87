#include <Eigen/Geometry>
#include <algorithm>
#include <array>

#include "qjulia/base/progress.hpp"
#include "qjulia/mesh/shape.hpp"

namespace qjulia {
namespace {

/// How far before and behind a surface its sides are looked at, in the box's longest sides.
constexpr double kOffset = 1e-4;
constexpr std::size_t kProbes = 4096;
constexpr std::uint64_t kProbeSeed = 1;
constexpr double kLeastHidden = 2e-3;  ///< share of the probes; below it the mesh stays as it is
constexpr int kMostCuts = 5;
constexpr std::size_t kPiecesAtOnce = std::size_t{1} << 16;  ///< pieces looked at together

/// A triangle, or what is left of one that was cut in four.
struct Piece {
  std::array<Eigen::Vector3d, 3> corners;
  int cuts = 0;

  Eigen::Vector3d at(double a, double b, double c) const {
    return a * corners[0] + b * corners[1] + c * corners[2];
  }
};

/// Whether the inside, or what is inside out, lies on both sides of each point. Windings of a
/// sheet's two sides differ by one: fractions, as at the rims of holes, are left alone.
std::vector<bool> are_hidden(const std::vector<SurfacePoint>& points,
                             const SignedDistance& distance, double offset,
                             const std::stop_token& stop) {
  std::vector<Eigen::Vector3d> sides;
  sides.reserve(2 * points.size());
  for (const auto& [position, normal] : points) {
    sides.emplace_back(position - offset * normal);
    sides.emplace_back(position + offset * normal);
  }
  const std::vector<double> windings = distance.winding_numbers(sides, stop);
  std::vector<bool> hidden(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [least, most] = std::minmax(windings[2 * i], windings[2 * i + 1]);
    hidden[i] = least > 0.75 || (least < -0.75 && most < 0.25);
  }
  return hidden;
}

/// Four points of each piece: its middle and near its corners.
constexpr std::size_t kPointsOfPiece = 4;
std::vector<SurfacePoint> points_of(const std::vector<Piece>& pieces) {
  std::vector<SurfacePoint> points;
  for (const Piece& p : pieces) {
    const Eigen::Vector3d normal =
        (p.corners[1] - p.corners[0]).cross(p.corners[2] - p.corners[0]).normalized();
    points.push_back({p.at(1.0 / 3, 1.0 / 3, 1.0 / 3), normal});
    points.push_back({p.at(0.96, 0.02, 0.02), normal});
    points.push_back({p.at(0.02, 0.96, 0.02), normal});
    points.push_back({p.at(0.02, 0.02, 0.96), normal});
  }
  return points;
}

void add(TriangleMesh& mesh, const Piece& piece) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), piece.corners.begin(), piece.corners.end());
  mesh.triangles.push_back({first, first + 1, first + 2});
}

void cut(const Piece& p, std::vector<Piece>& pieces) {
  const Eigen::Vector3d ab = p.at(0.5, 0.5, 0), bc = p.at(0, 0.5, 0.5), ca = p.at(0.5, 0, 0.5);
  const auto& [a, b, c] = p.corners;
  for (const auto& corners : {std::array{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}}) {
    pieces.push_back({corners, p.cuts + 1});
  }
}

bool hides_parts(const TriangleMesh& mesh, const SignedDistance& distance, double offset,
                 const std::stop_token& stop) {
  const auto probes = are_hidden(sample_surface(mesh, kProbes, kProbeSeed), distance, offset, stop);
  return static_cast<double>(std::ranges::count(probes, true)) >= kLeastHidden * kProbes;
}

TriangleMesh without_hidden(const TriangleMesh& mesh, const SignedDistance& distance, double offset,
                            const std::stop_token& stop) {
  std::vector<Piece> waiting;
  for (const auto& [a, b, c] : mesh.triangles) {
    waiting.push_back({{mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]}});
  }
  TriangleMesh outer;
  while (!waiting.empty()) {
    throw_if_stopped(stop);
    const auto first =
        waiting.end() - static_cast<std::ptrdiff_t>(std::min(kPiecesAtOnce, waiting.size()));
    const std::vector<Piece> pieces(first, waiting.end());
    waiting.erase(first, waiting.end());
    const auto hidden = are_hidden(points_of(pieces), distance, offset, stop);
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      const auto begin = hidden.begin() + static_cast<std::ptrdiff_t>(kPointsOfPiece * i);
      const auto count = std::count(begin, begin + kPointsOfPiece, true);
      if (count == 0 || (count <= 2 && pieces[i].cuts == kMostCuts)) {
        add(outer, pieces[i]);
      } else if (count < 4 && pieces[i].cuts < kMostCuts) {
        cut(pieces[i], waiting);
      }
    }
  }
  return outer;
}

}  // namespace

OuterSurface outer_surface(const Device& device, const TriangleMesh& mesh, std::stop_token stop) {
  const double offset = kOffset * mesh.box().size().maxCoeff();
  TriangleMesh outward = oriented_outward(mesh, stop);
  const SignedDistance distance(device, outward, Precision::single, stop);
  if (!hides_parts(outward, distance, offset, stop)) return {std::move(outward), distance, false};
  const TriangleMesh outer = without_hidden(outward, distance, offset, stop);
  return {outer, SignedDistance(device, outer, Precision::single, stop), true};
}

}  // namespace qjulia

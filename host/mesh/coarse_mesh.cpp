#include "mesh/coarse_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "mesh/parts.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia::shape {
namespace {

/// Cells along an axis; the numbers of three fit in 63 bits.
constexpr double kMostCells = 1 << 21;

/// The number of each vertex's cell. Cells are numbered in the order of their first vertices.
/// @param means gets the mean of each cell's vertices.
std::vector<std::uint32_t> cells_of(const TriangleMesh& mesh, double cell,
                                    std::vector<Eigen::Vector3d>& means) {
  const Eigen::Vector3d low = mesh.box().low;
  std::unordered_map<std::uint64_t, std::uint32_t> numbers;
  std::vector<std::uint32_t> cell_of;
  std::vector<double> members;
  cell_of.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& x : mesh.vertices) {
    const Eigen::Vector3d place = ((x - low) / cell).array().floor().min(kMostCells - 1);
    std::uint64_t key = 0;
    for (const double coordinate : place) key = key << 21 | static_cast<std::uint64_t>(coordinate);
    const auto number = static_cast<std::uint32_t>(numbers.size());
    const auto [found, is_new] = numbers.try_emplace(key, number);
    if (is_new) {
      means.push_back(Eigen::Vector3d::Zero());
      members.push_back(0);
    }
    cell_of.push_back(found->second);
    means[found->second] += x;
    ++members[found->second];
  }
  for (std::size_t i = 0; i < means.size(); ++i) means[i] /= members[i];
  return cell_of;
}

TriangleMesh clustered(const TriangleMesh& mesh, double cell, const std::stop_token& stop) {
  TriangleMesh result;
  const std::vector<std::uint32_t> cell_of = cells_of(mesh, cell, result.vertices);
  struct Side {
    Triangle cells;  // rising
    bool is_turned;
  };
  std::vector<Side> sides;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % kTrianglesPolled == 0) throw_if_stopped(stop);
    Triangle cells;
    std::ranges::transform(mesh.triangles[t], cells.begin(),
                           [&](std::uint32_t v) { return cell_of[v]; });
    const auto& [a, b, c] = cells;
    if (a == b || b == c || c == a) continue;
    const bool is_turned = (a < b) + (b < c) + (c < a) != 2;
    std::ranges::sort(cells);
    sides.push_back({cells, is_turned});
  }
  std::ranges::sort(sides, {}, &Side::cells);
  for (auto first = sides.begin(); first != sides.end();) {
    int winding = 0;
    auto last = first;
    for (; last != sides.end() && last->cells == first->cells; ++last) {
      winding += last->is_turned ? -1 : 1;
    }
    auto [a, b, c] = first->cells;
    if (winding < 0) std::swap(b, c);
    result.triangles.insert(result.triangles.end(), static_cast<std::size_t>(std::abs(winding)),
                            {a, b, c});
    first = last;
  }
  return result;
}

}  // namespace

CoarseMesh coarse_mesh(const TriangleMesh& mesh, std::size_t most, const std::stop_token& stop) {
  constexpr double kTrianglesOfCell = 3;  // about so many where a flat surface crosses a cell
  constexpr double kFiner = 0.7071;       // twice as many triangles
  constexpr int kMostTries = 8;
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& x = mesh.vertices[a];
    area += 0.5 * (mesh.vertices[b] - x).cross(mesh.vertices[c] - x).norm();
  }
  if (!(area > 0)) throw InputError("the mesh has no area; give a mesh with triangles");
  double cell = std::max(std::sqrt(kTrianglesOfCell * area / static_cast<double>(most)),
                         mesh.box().size().maxCoeff() / kMostCells);
  CoarseMesh coarse{clustered(mesh, cell, stop), cell};
  // A rough surface has less area in larger cells.
  for (int i = 0; i < kMostTries && coarse.mesh.triangles.size() < most / 2; ++i) {
    cell *= kFiner;
    TriangleMesh finer = clustered(mesh, cell, stop);
    if (finer.triangles.size() > most) break;
    coarse = {std::move(finer), cell};
  }
  for (int i = 0; i < kMostTries && coarse.mesh.triangles.size() > most; ++i) {
    coarse.cell /= kFiner;
    coarse.mesh = clustered(mesh, coarse.cell, stop);
  }
  return coarse;
}

}  // namespace qjulia::shape

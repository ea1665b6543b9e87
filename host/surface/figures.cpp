#include "qjulia/figures.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "qjulia/shape.hpp"
#include "surface/box_dimension.hpp"

namespace qjulia {
namespace {

constexpr double kEdgesPerBox = 4;
/// Points on triangles are this much closer than the boxes of a coarse mesh are wide.
constexpr double kPointsPerBox = 2;
/// Coarse meshes are counted by boxes of this part of the longest side, triangles filled in.
constexpr double kFilledBox = 1.0 / 128;

/// Points of the triangles whose edges are longer than `spacing`, no farther apart.
void fill_in(const TriangleMesh& mesh, double spacing, std::vector<Eigen::Vector3f>& points) {
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& p = mesh.vertices[a];
    const Eigen::Vector3d u = mesh.vertices[b] - p;
    const Eigen::Vector3d v = mesh.vertices[c] - p;
    const double longest = std::max({u.norm(), v.norm(), (u - v).norm()});
    const int parts = static_cast<int>(std::ceil(longest / spacing));
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; i + j <= parts && parts > 1; ++j) {
        points.push_back((p + (i * u + j * v) / parts).cast<float>());
      }
    }
  }
}

}  // namespace

void FigureSink::vertices(std::span<const Eigen::Vector3d> positions,
                          std::span<const Eigen::Vector3d> normals) {
  for (const Eigen::Vector3d& x : positions) {
    parent_.push_back(static_cast<std::uint32_t>(positions_.size()));
    positions_.push_back(x.cast<float>());
  }
  take_complete();
  if (next_ != nullptr) next_->vertices(positions, normals);
}

void FigureSink::triangles(std::span<const Triangle> triangles) {
  waiting_.insert(waiting_.end(), triangles.begin(), triangles.end());
  take_complete();
  if (next_ != nullptr) next_->triangles(triangles);
}

std::uint32_t FigureSink::root(std::uint32_t vertex) {
  while (parent_[vertex] != vertex) vertex = parent_[vertex] = parent_[parent_[vertex]];
  return vertex;
}

void FigureSink::take_complete() {
  const auto left = std::partition(waiting_.begin(), waiting_.end(), [this](const Triangle& t) {
    return std::ranges::max(t) >= positions_.size();
  });
  if (positions_.empty()) return;
  // Volumes are taken from a point of the surface: far from the origin, they would cancel.
  const Eigen::Vector3d apex = positions_.front().cast<double>();
  for (auto t = left; t != waiting_.end(); ++t) {
    const auto& [a, b, c] = *t;
    const Eigen::Vector3d p = positions_[a].cast<double>();
    const Eigen::Vector3d u = positions_[b].cast<double>() - p;
    const Eigen::Vector3d v = positions_[c].cast<double>() - p;
    const Eigen::Vector3d normal = u.cross(v);
    area_ += 0.5 * normal.norm();
    volume_ += (p - apex).dot(normal) / 6;
    edges_ += u.norm() + v.norm() + (u - v).norm();
    ++triangles_;
    parent_[root(a)] = root(b);
    parent_[root(b)] = root(c);
  }
  waiting_.erase(left, waiting_.end());
}

SurfaceFigures FigureSink::figures() {
  SurfaceFigures figures;
  figures.area = area_;
  figures.volume = volume_;
  for (std::uint32_t v = 0; v < parent_.size(); ++v) {
    if (root(v) == v) ++figures.components;
  }
  const double edge = triangles_ > 0 ? edges_ / (3 * static_cast<double>(triangles_)) : 0;
  const BoxDimension box = box_dimension(positions_, kEdgesPerBox * edge);
  figures.dimension = box.dimension;
  figures.dimension_error = box.error;
  figures.box_sizes = box.sizes;
  return figures;
}

SurfaceFigures measure(const TriangleMesh& mesh) {
  FigureSink sink;
  sink.vertices(mesh.vertices, {});
  sink.triangles(mesh.triangles);
  SurfaceFigures figures = sink.figures();
  // A mesh of few triangles has no small boxes of vertices: its triangles are filled with points.
  const double finest = kFilledBox * mesh.box().size().maxCoeff();
  if (!(figures.box_sizes >= 4) && finest > 0) {
    std::vector<Eigen::Vector3f> points;
    for (const Eigen::Vector3d& x : mesh.vertices) points.push_back(x.cast<float>());
    fill_in(mesh, finest / kPointsPerBox, points);
    const BoxDimension box = box_dimension(points, finest * 0.999);
    figures.dimension = box.dimension;
    figures.dimension_error = box.error;
    figures.box_sizes = box.sizes;
  }
  return figures;
}

nlohmann::json to_json(const SurfaceFigures& figures) {
  return {{"area", figures.area},
          {"volume", figures.volume},
          {"area_per_volume", figures.area / figures.volume},
          {"box_dimension", figures.dimension},
          {"box_dimension_error", figures.dimension_error},
          {"box_sizes", figures.box_sizes}};
}

TriangleMesh large_components(const TriangleMesh& mesh, double least) {
  std::vector<std::uint32_t> parent(mesh.vertices.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&parent](std::uint32_t v) {
    while (parent[v] != v) v = parent[v] = parent[parent[v]];
    return v;
  };
  for (const auto& [a, b, c] : mesh.triangles) {
    parent[root(a)] = root(b);
    parent[root(b)] = root(c);
  }
  std::vector<double> area(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& p = mesh.vertices[a];
    area[root(a)] += 0.5 * (mesh.vertices[b] - p).cross(mesh.vertices[c] - p).norm();
  }
  const auto largest = std::ranges::max_element(area);
  const auto keeps = [&](std::uint32_t v) {
    const std::uint32_t r = root(v);
    if (least >= 1) return area.begin() + r == largest;
    return area[r] >= least * *largest;
  };
  TriangleMesh kept;
  std::vector<std::uint32_t> number(mesh.vertices.size());
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!keeps(v)) continue;
    number[v] = static_cast<std::uint32_t>(kept.vertices.size());
    kept.vertices.push_back(mesh.vertices[v]);
    if (!mesh.normals.empty()) kept.normals.push_back(mesh.normals[v]);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (keeps(a)) kept.triangles.push_back({number[a], number[b], number[c]});
  }
  return kept;
}

WallThickness wall_thickness(const Device& device, const TriangleMesh& mesh) {
  constexpr std::size_t kSamples = 4000;
  constexpr std::uint64_t kSeed = 1;
  constexpr int kHalvings = 14;
  // A ball that touches at the sample alone has its centre this close to its radius inside; the
  // rest is for the edges between flat triangles.
  constexpr double kTouch = 0.9;
  const SignedDistance distance(device, mesh);
  const auto samples = sample_surface(mesh, kSamples, kSeed);
  std::vector<double> low(samples.size(), 0);
  std::vector<double> high(samples.size(), 0.5 * mesh.box().diagonal());
  std::vector<Eigen::Vector3d> centers(samples.size());
  for (int step = 0; step < kHalvings; ++step) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      centers[i] = samples[i].position - 0.5 * (low[i] + high[i]) * samples[i].normal;
    }
    const auto found = distance.at(centers);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double radius = 0.5 * (low[i] + high[i]);
      (found[i] < -kTouch * radius ? low : high)[i] = radius;
    }
  }
  std::ranges::sort(high);
  const auto at = [&](double part) {
    return 2 * high[static_cast<std::size_t>(part * static_cast<double>(high.size() - 1))];
  };
  return {at(0.01), at(0.1), at(0.5)};
}

}  // namespace qjulia

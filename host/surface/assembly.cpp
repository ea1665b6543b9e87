#include "surface/assembly.hpp"

#include <Eigen/Geometry>

namespace qjulia {

void Assembly::add(const MeshPart& part) {
  place(part);
  add_normals(part.triangles);
  triangles_ += part.triangles.size();
  sink_.triangles(part.triangles);

  const std::size_t done = part.complete - first_;
  for (std::size_t i = 0; i < done; ++i) normals_[i].normalize();
  sink_.vertices(std::span(positions_).first(done), std::span(normals_).first(done));
  const auto kept = static_cast<std::ptrdiff_t>(done);
  positions_.erase(positions_.begin(), positions_.begin() + kept);
  normals_.erase(normals_.begin(), normals_.begin() + kept);
  first_ = part.complete;
}

void Assembly::place(const MeshPart& part) {
  for (const EdgeVertex& vertex : part.vertices) {
    Eigen::Vector3d index(vertex.point[0], vertex.point[1], vertex.point[2]);
    if (vertex.axis != EdgeVertex::kNoEdge) index[vertex.axis] += static_cast<double>(vertex.at);
    positions_.push_back(shape_to_map_.to_shape(grid_.at(index)));
  }
  for (const MeanVertex& mean : part.means) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const auto number : mean.of) sum += position(number);
    position(mean.number) = sum / static_cast<double>(mean.of.size());
  }
  normals_.resize(positions_.size(), Eigen::Vector3d::Zero());
}

void Assembly::add_normals(const std::vector<Triangle>& triangles) {
  for (const auto& [a, b, c] : triangles) {
    const Eigen::Vector3d& origin = position(a);
    const Eigen::Vector3d area = (position(b) - origin).cross(position(c) - origin);
    for (const auto number : {a, b, c}) normals_[number - first_] += area;
  }
}

}  // namespace qjulia

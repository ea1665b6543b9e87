#include "surface/refine.hpp"

#include <algorithm>

namespace qjulia {
void refine(const LevelSet& set, double level, const Grid& grid, int halvings,
            std::vector<EdgeVertex>& vertices) {
  if (halvings == 0) return;
  std::vector<float> near(vertices.size(), 0.0F);
  std::vector<float> far(vertices.size(), 1.0F);
  const auto inside_below = static_cast<float>(level);
  for (int halving = 0; halving < halvings; ++halving) {
    PointList points;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const EdgeVertex& vertex = vertices[i];
      Eigen::Vector3d index(vertex.point[0], vertex.point[1], vertex.point[2]);
      if (vertex.axis != EdgeVertex::kNoEdge) {
        index[vertex.axis] += static_cast<double>(0.5F * (near[i] + far[i]));
      }
      const Eigen::Vector3d x = grid.at(index);
      points.add(x.x(), x.y(), x.z());
    }
    const std::vector<float> values = set.at(points);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const bool inside = values[i] < inside_below;
      (inside == vertices[i].leads_inside ? far : near)[i] = 0.5F * (near[i] + far[i]);
    }
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    vertices[i].at = std::clamp(0.5F * (near[i] + far[i]), kVertexMargin, 1 - kVertexMargin);
  }
}

}  // namespace qjulia

#include "mesh_io/mesh_objects.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace qjulia::shape {
namespace {

std::vector<Eigen::AlignedBox3d> boxes_of(const TriangleMesh& mesh, const Parts& parts) {
  std::vector<Eigen::AlignedBox3d> boxes(parts.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) {
      boxes[parts.of_triangle[t]].extend(mesh.vertices[v]);
    }
  }
  return boxes;
}

/// The parts that are no cavities, from the smallest box to the largest.
std::vector<std::size_t> by_box_volume(const Objects& objects,
                                       const std::vector<Eigen::AlignedBox3d>& boxes) {
  std::vector<std::size_t> sorted;
  for (std::size_t part = 0; part < boxes.size(); ++part) {
    if (!objects.is_cavity(part)) sorted.push_back(part);
  }
  std::ranges::stable_sort(sorted, {}, [&](std::size_t part) { return boxes[part].volume(); });
  return sorted;
}

}  // namespace

Objects objects_of(const TriangleMesh& mesh) {
  Objects objects{connected_parts(mesh), {}, 0};
  const std::size_t parts = objects.parts.size();
  objects.of_part.resize(parts, Objects::kNone);
  bool has_cavities = false;
  for (std::size_t part = 0; part < parts; ++part) {
    if (objects.is_cavity(part)) {
      has_cavities = true;
    } else {
      objects.of_part[part] = static_cast<std::uint32_t>(objects.count++);
    }
  }
  if (!has_cavities) return objects;
  const std::vector<Eigen::AlignedBox3d> boxes = boxes_of(mesh, objects.parts);
  const std::vector<std::size_t> sorted = by_box_volume(objects, boxes);
  for (std::size_t part = 0; part < parts; ++part) {
    if (!objects.is_cavity(part)) continue;
    // Smaller boxes cannot hold it, and the first that does is the smallest.
    const auto first = std::ranges::lower_bound(sorted, boxes[part].volume(), {},
                                                [&](std::size_t i) { return boxes[i].volume(); });
    const auto holder = std::find_if(first, sorted.end(),
                                     [&](std::size_t i) { return boxes[i].contains(boxes[part]); });
    objects.of_part[part] = holder == sorted.end() ? static_cast<std::uint32_t>(objects.count++)
                                                   : objects.of_part[*holder];
  }
  return objects;
}

}  // namespace qjulia::shape

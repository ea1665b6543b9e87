#include "mesh_io/scene_faces.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <utility>

namespace qjulia::shape {
namespace {

constexpr std::size_t kMostWork = 16;  ///< items looked at, for each one kept

}  // namespace

SceneFaces::SceneFaces(const MeshFile& file, std::size_t bytes) : file_(file), faces_(file) {
  set_bytes(bytes);
}

void SceneFaces::set_bytes(std::size_t bytes) { most_items_ = std::max(most_items_, bytes); }

void SceneFaces::refuse_size() const {
  file_.refuse(
      fmt::format("it places its meshes so often that there would be more than {} vertices or "
                  "triangles; export the scene as one mesh",
                  most_items_));
}

void SceneFaces::spend(std::size_t items) {
  file_.poll();
  if (items > kMostWork * most_items_ - work_) refuse_size();
  work_ += items;
}

void SceneFaces::add(std::span<const Triangle> triangles, std::size_t vertices,
                     const std::function<Eigen::Vector3d(std::uint32_t)>& vertex,
                     const Eigen::Affine3d& to_scene) {
  if (triangles.empty()) return;
  std::uint32_t first = std::numeric_limits<std::uint32_t>::max(), last = 0;
  for (const Triangle& t : triangles) {
    first = std::min(first, std::ranges::min(t));
    last = std::max(last, std::ranges::max(t));
  }
  if (last >= vertices) {
    file_.refuse(
        fmt::format("a triangle has vertex {}, and there are {}; export it again", last, vertices));
  }
  const std::size_t range = std::size_t{last} - first + 1;
  spend(range + triangles.size());
  if (triangles.size() > most_items_ - std::min(most_items_, faces_.faces())) refuse_size();
  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> places(range, kUnused);
  const bool is_mirrored = to_scene.linear().determinant() < 0;
  for (const Triangle& t : triangles) {
    Triangle placed;
    std::ranges::transform(t, placed.begin(), [&](std::uint32_t v) {
      std::uint32_t& place = places[v - first];
      if (place != kUnused) return place;
      const Eigen::Vector3f x = (to_scene * vertex(v)).cast<float>();
      if (!x.allFinite()) {
        file_.refuse(fmt::format("its vertex {} is not at finite coordinates; export it again", v));
      }
      place = static_cast<std::uint32_t>(faces_.vertices.size());
      faces_.add_vertex(x);
      return place;
    });
    if (is_mirrored) std::swap(placed[1], placed[2]);
    faces_.add_face(placed);
  }
}

FaceList SceneFaces::take() && {
  if (faces_.faces() == 0) {
    file_.refuse(
        "its scene has no triangles (points and lines are no surface); export a mesh with "
        "triangles");
  }
  return std::move(faces_);
}

}  // namespace qjulia::shape

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>

#include "base/file_types.hpp"
#include "mesh/mesh_report.hpp"
#include "mesh/point_cells.hpp"
#include "mesh/triangulate.hpp"
#include "mesh_io/formats.hpp"
#include "mesh_io/mesh_file.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/mesh/painted_mesh.hpp"

namespace qjulia {

using namespace shape;
namespace {

/// @return the number of polygons that cross themselves or have no area.
std::size_t triangulate_polygons(const MeshFile& file, FaceList& faces) {
  return static_cast<std::size_t>(std::ranges::count_if(faces.polygons, [&](const auto& polygon) {
    return !triangulate(faces.vertices,
                        std::span(faces.triangles).subspan(polygon.first, polygon.count),
                        [&] { file.poll(); });
  }));
}

/// What `read` gives. @throws InputError also where there is not enough memory.
template <class Read>
auto within_memory(const std::filesystem::path& path, const Read& read) {
  try {
    return read();
  } catch (const std::bad_alloc&) {
    throw InputError(
        fmt::format("cannot read mesh '{}': there is not enough memory for it", path.string()));
  }
}

std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  return (std::rotl(hash, 21) ^ value) * 0x9e3779b97f4a7c15U;
}

/// Finds the first of equal items, which are known by their places in a list.
class FirstEqual {
 public:
  explicit FirstEqual(std::size_t items) : slots_(std::bit_ceil(2 * items + 1), kEmpty) {}

  /// The first item added that equals `item`, or `item` itself, which is then added.
  template <class Equals>
  std::uint32_t find_or_add(std::uint32_t item, std::uint64_t hash, const Equals& equals) {
    const std::size_t mask = slots_.size() - 1;
    for (std::size_t slot = (hash ^ hash >> 32) & mask;; slot = (slot + 1) & mask) {
      if (slots_[slot] == kEmpty) return slots_[slot] = item;
      if (equals(slots_[slot], item)) return slots_[slot];
    }
  }

 private:
  static constexpr std::uint32_t kEmpty = ~0U;
  std::vector<std::uint32_t> slots_;
};

/// Call it now and then. @throws Interrupted
using Poll = std::function<void()>;

/// For each vertex the first one at the same place. Zeros have one sign.
std::vector<std::uint32_t> first_at_same_place(const std::vector<Eigen::Vector3d>& x,
                                               const Poll& poll) {
  FirstEqual places(x.size());
  std::vector<std::uint32_t> first(x.size());
  for (std::uint32_t v = 0; v < x.size(); ++v) {
    if (v % kPolled == 0) poll();
    std::uint64_t hash = 0;
    for (const double c : x[v]) hash = mixed(hash, std::bit_cast<std::uint64_t>(c + 0.0));
    first[v] =
        places.find_or_add(v, hash, [&](std::uint32_t a, std::uint32_t b) { return x[a] == x[b]; });
  }
  return first;
}

/// A triangle whose height is below rounding error of its longest side.
bool has_no_area(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  constexpr double kRounding = 1e-12;
  const double side =
      std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
  return (b - a).cross(c - a).norm() <= kRounding * side;
}

/// Gives equal vertices one index and leaves out triangles without area and vertices that no
/// triangle uses.
TriangleMesh weld(const std::vector<Eigen::Vector3d>& x, const std::vector<Triangle>& triangles,
                  MeshReport& report, const Poll& poll) {
  const std::vector<std::uint32_t> first = first_at_same_place(x, poll);
  TriangleMesh mesh;
  mesh.triangles.reserve(triangles.size());
  std::vector<bool> is_used(x.size());
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (t % kPolled == 0) poll();
    const auto& [a, b, c] = triangles[t];
    if (has_no_area(x[a], x[b], x[c])) {
      ++report.dropped_triangles;
      continue;
    }
    mesh.triangles.push_back({first[a], first[b], first[c]});
    for (const std::uint32_t corner : mesh.triangles.back()) is_used[corner] = true;
  }
  std::vector<std::uint32_t>& place = report.vertex_of_file;
  place.assign(x.size(), MeshReport::kNoVertex);
  for (std::uint32_t v = 0; v < x.size(); ++v) {
    if (first[v] != v) {
      ++report.welded_vertices;
      place[v] = place[first[v]];
    } else if (is_used[v]) {
      place[v] = static_cast<std::uint32_t>(mesh.vertices.size());
      mesh.vertices.push_back(x[v]);
    }
  }
  for (Triangle& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) corner = place[corner];
  }
  return mesh;
}

/// Leaves one of equal triangles. Two with opposite windings are a sheet without an inside and
/// stay, as they cancel out in winding numbers; but where all triangles are in such pairs the mesh
/// was meant to be seen from both sides, and the first of each pair stays.
void drop_duplicates(TriangleMesh& mesh, MeshReport& report, const Poll& poll) {
  const auto& triangles = mesh.triangles;
  const auto sorted = [&](std::uint32_t t) {
    Triangle corners = triangles[t];
    std::ranges::sort(corners);
    return corners;
  };
  const auto winding = [&](std::uint32_t t) {
    const auto& [a, b, c] = triangles[t];
    return (a < b) + (b < c) + (c < a) == 2 ? 1 : 2;
  };
  FirstEqual places(triangles.size());
  std::vector<std::uint8_t> seen(triangles.size());  // windings, of the first equal triangle
  std::vector<std::uint32_t> kept;                   // not seen before in this winding
  std::vector<std::uint32_t> turned;                 // those of `kept` seen in the other one
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (t % kPolled == 0) poll();
    std::uint64_t hash = 0;
    for (const auto v : sorted(t)) hash = mixed(hash, v);
    const std::uint32_t first = places.find_or_add(
        t, hash, [&](std::uint32_t a, std::uint32_t b) { return sorted(a) == sorted(b); });
    if ((seen[first] & winding(t)) != 0) {
      ++report.duplicate_triangles;
      continue;
    }
    if (seen[first] != 0) turned.push_back(t);
    seen[first] = static_cast<std::uint8_t>(seen[first] | winding(t));
    kept.push_back(t);
  }
  if (kept.size() == triangles.size() && turned.empty()) return;
  report.two_sided_triangles = turned.size();
  if (2 * turned.size() == kept.size()) {
    report.is_two_sided = true;
    std::vector<std::uint32_t> fronts;
    std::ranges::set_difference(kept, turned, std::back_inserter(fronts));
    kept = std::move(fronts);
  }
  std::vector<Triangle> rest;
  rest.reserve(kept.size());
  for (const auto t : kept) rest.push_back(triangles[t]);
  mesh.triangles = std::move(rest);
}

/// The surface of points without faces; of points at the same place the first one counts.
/// @throws InputError for a point without a normal.
TriangleMesh surface_of_points(const MeshFile& file, const FaceList& raw, MeshReport& report,
                               const std::stop_token& stop) {
  const std::vector<std::uint32_t> first = first_at_same_place(raw.vertices, [&] { file.poll(); });
  std::vector<Eigen::Vector3d> points, normals;
  for (std::uint32_t v = 0; v < first.size(); ++v) {
    if (first[v] != v) {
      ++report.welded_vertices;
      continue;
    }
    const Eigen::Vector3d& normal = raw.normals[v];
    const double length = normal.stableNorm();
    if (!std::isfinite(length) || length == 0) {
      file.refuse(
          fmt::format("point {} has the normal ({}, {}, {}), which is no direction; leave such "
                      "points out, or compute the normals again",
                      v, normal.x(), normal.y(), normal.z()));
    }
    points.push_back(raw.vertices[v]);
    normals.emplace_back((normal / length).normalized());
  }
  report.points = points.size();
  constexpr std::size_t kFewest = 4;  // which have an inside
  if (points.size() < kFewest) {
    file.refuse(fmt::format("it has no faces, and only {} different points; export more of them",
                            points.size()));
  }
  return point_cells(points, normals, stop);
}

constexpr const char* kNoArea =
    "none of its triangles has an area (are all vertices equal or in one line?)";

/// The mesh, and a report of what was left out on the way.
InspectedMesh read(const std::filesystem::path& path, const std::stop_token& stop) {
  const std::string extension =
      base::expect_type(path, base::FileContent::mesh, base::FileUse::read);
  return within_memory(path, [&] {
    MeshReport found;
    const MeshFile file(path, extension, stop);
    const Poll poll = [&] { file.poll(); };
    FaceList faces = mesh_format(extension).read(file, nullptr);
    found.bad_polygons = triangulate_polygons(file, faces);
    const bool is_cloud = !faces.normals.empty();
    TriangleMesh mesh = is_cloud ? surface_of_points(file, faces, found, stop)
                                 : weld(faces.vertices, faces.triangles, found, poll);
    if (faces.is_soup) found.welded_vertices = 0;
    if (mesh.triangles.empty()) file.refuse(kNoArea);
    if (const std::string problem = size_problem(mesh.box()); !problem.empty()) {
      file.refuse(problem);
    }
    if (!is_cloud) drop_duplicates(mesh, found, poll);
    found.dropped_triangles += faces.dropped_faces;
    mesh.format_up = format_up(path);
    return InspectedMesh{std::move(mesh), std::move(found)};
  });
}

}  // namespace

TriangleMesh read_mesh(const std::filesystem::path& path, std::stop_token stop) {
  return read(path, stop).mesh;
}

InspectedMesh read_and_inspect_mesh(const std::filesystem::path& path, std::stop_token stop) {
  InspectedMesh found = read(path, stop);
  found.report = inspect(found.mesh, std::move(found.report), stop);
  return found;
}

InspectedMesh as_if_read(const TriangleMesh& mesh, const std::stop_token& stop) {
  mesh.validate();
  const Poll poll = [&] { throw_if_stopped(stop); };
  const auto refuse = [](const std::string& problem) {
    throw InputError(fmt::format("the mesh cannot be used: {}", problem));
  };
  // Numbers as large as those refused here need not be finite in single precision.
  if (const std::string problem = size_problem(mesh.box()); !problem.empty()) refuse(problem);
  std::vector<Eigen::Vector3d> vertices;
  vertices.reserve(mesh.vertices.size());
  for (const Eigen::Vector3d& x : mesh.vertices) {
    // In two steps: Eigen 3.4 does not round the vectorised part of two casts in one expression.
    const Eigen::Vector3f rounded = x.cast<float>();
    vertices.emplace_back(rounded.cast<double>());
  }
  InspectedMesh found;
  found.mesh = weld(vertices, mesh.triangles, found.report, poll);
  if (found.mesh.triangles.empty()) refuse(kNoArea);
  drop_duplicates(found.mesh, found.report, poll);
  found.mesh.format_up = mesh.format_up;
  found.report = inspect(found.mesh, std::move(found.report), stop);
  return found;
}

PaintedMesh read_painted_mesh(const std::filesystem::path& path, const std::string& property,
                              std::stop_token stop) {
  const std::string extension =
      base::expect_type(path, base::FileContent::mesh, base::FileUse::paint);
  return within_memory(path, [&] {
    const MeshFile file(path, extension, std::move(stop));
    FaceList faces = mesh_format(extension).read(file, &property);
    triangulate_polygons(file, faces);
    return PaintedMesh{std::move(faces.vertices), std::move(faces.triangles),
                       std::move(faces.shares)};
  });
}

}  // namespace qjulia

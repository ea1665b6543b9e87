#include "explore/maker.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <utility>
#include <vector>

#include "base/temporary_folder.hpp"
#include "qjulia/error.hpp"
#include "qjulia/figures.hpp"
#include "qjulia/map_file.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/surface_colors.hpp"

namespace qjulia::explore {
namespace {

constexpr double kTurnSeconds = 4;  ///< a turntable takes once around

std::string name_of_file(const MakeRequest& request) { return "mesh" + request.extension; }

std::string bytes_of(const TriangleMesh& mesh, const Map& map, const MakeRequest& request) {
  constexpr double kMillimetre = 1e-3;
  MeshFileOptions options;
  options.up = map.frame.up;
  if (request.millimetres) options.metres_per_unit = kMillimetre;
  if (request.extension == ".glb") options.map = packed_map(map);
  const base::TemporaryFolder folder("qjulia");
  const auto file = folder.path() / name_of_file(request);
  write_mesh(mesh, file, options);
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(bytes).str();
}

/// The colours that pictures of the map have. Clay is none, and some files hold none.
void add_colors(const Device& device, const Map& map, const MakeRequest& request,
                const ProgressMonitor& monitor, TriangleMesh& mesh) {
  const PictureOptions& picture = request.view.picture;
  if (picture.material == Material::clay || !holds_colors(name_of_file(request))) return;
  SurfaceColorOptions options;
  options.material = picture.material;
  options.palette = picture.palette;
  options.iterations = request.surface.iterations;
  options.range = picture.range;
  mesh.colors = surface_colors(device, map, mesh, options, monitor).colors;
}

std::string mesh_file(const Device& device, Map map, const MakeRequest& request,
                      const ProgressMonitor& monitor) {
  if (request.millimetres) map = with_longest_side(std::move(map), *request.millimetres);
  if (format_up(name_of_file(request))) {  // as it is drawn
    map.frame.up = request.view.picture.camera.up.value_or(map.frame.up.value_or(kDefaultUp));
  }
  // Pictures are drawn on `device` while slabs of the mesh are evaluated on threads of their own.
  const Device own = device.sibling();
  TriangleMesh mesh = extract_surface(own, map, request.surface, monitor);
  if (mesh.triangles.empty()) {
    throw Error(has_points(own, map, request.surface, monitor.stop)
                    ? "the set is too thin for cells of this size: give a higher resolution"
                    : "the set is empty: try less detail, or fewer iterations");
  }
  if (!request.view.picture.keep_loose) drop_loose_pieces(mesh);
  add_colors(own, map, request, monitor, mesh);
  for (const Cut& cut : request.view.picture.cuts) {
    if (!map.frame.box) throw InputError("cut: the map keeps no box of its shape");
    const int axis = cut.axis - 'x';
    mesh = cut_away(mesh, axis,
                    std::lerp(map.frame.box->low[axis], map.frame.box->high[axis], cut.at / 100));
  }
  if (mesh.triangles.empty()) throw Error("nothing is left of the set: cut less away");
  const MeshReport report = inspect(mesh);
  monitor.report({"", 1, 0,
                  fmt::format("{} triangles, {}", report.triangles,
                              report.closed()                     ? "closed and manifold"
                              : request.view.picture.cuts.empty() ? "not closed"
                                                                  : "open where it is cut")});
  return bytes_of(mesh, map, request);
}

std::string turntable(const Device& device, const Map& map, const MakeRequest& request,
                      const ProgressMonitor& monitor) {
  const PictureOptions& options = request.view.picture;
  Studio studio(device, map, options, monitor.stop);
  std::vector<Camera> cameras(static_cast<std::size_t>(request.frames), options.camera);
  for (int i = 0; i < request.frames; ++i) {
    cameras[static_cast<std::size_t>(i)].azimuth += 360.0 * i / request.frames;
  }
  cameras = studio.aimed(cameras);
  studio.set_range(range_over(studio.shown(cameras), options.material));
  std::vector<Image> images;
  for (int i = 0; i < request.frames; ++i) {
    ProgressMonitor part = monitor;
    part.on_progress = [&](Progress progress) {
      progress.fraction = (i + progress.fraction) / request.frames;
      monitor.report(progress);
    };
    images.push_back(studio.picture(cameras[static_cast<std::size_t>(i)], part));
  }
  monitor.report({"", 1, 0, fmt::format("{} pictures", request.frames)});
  return animated_png_bytes(images, kTurnSeconds / request.frames);
}

}  // namespace

TriangleMesh cut_away(const TriangleMesh& mesh, int axis, double most) {
  constexpr std::uint32_t kNone = 0xFFFFFFFF;
  TriangleMesh cut;
  const auto added = [&](const Eigen::Vector3d& vertex) {
    cut.vertices.push_back(vertex);
    return static_cast<std::uint32_t>(cut.vertices.size() - 1);
  };
  // How far a vertex is below the plane; above 0 it stays.
  const auto below = [&](std::uint32_t v) { return most - mesh.vertices[v][axis]; };
  std::vector<std::uint32_t> numbers(mesh.vertices.size(), kNone);
  const auto kept = [&](std::uint32_t v) {
    if (numbers[v] == kNone) {
      numbers[v] = added(mesh.vertices[v]);
      if (!mesh.normals.empty()) cut.normals.push_back(mesh.normals[v]);
      if (!mesh.colors.empty()) cut.colors.push_back(mesh.colors[v]);
    }
    return numbers[v];
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> crossings;  // by edge
  const auto crossing = [&](std::uint32_t a, std::uint32_t b) {
    // From the same end for both triangles of an edge.
    if (a > b) std::swap(a, b);
    const auto [at, is_new] = crossings.try_emplace({a, b});
    if (!is_new) return at->second;
    const double way = below(a) / (below(a) - below(b));
    Eigen::Vector3d point = mesh.vertices[a] + way * (mesh.vertices[b] - mesh.vertices[a]);
    point[axis] = most;
    if (!mesh.normals.empty()) {
      const auto share = static_cast<float>(way);
      cut.normals.push_back(((1 - share) * mesh.normals[a] + share * mesh.normals[b]).normalized());
    }
    if (!mesh.colors.empty()) {
      VertexColor& color = cut.colors.emplace_back();
      for (std::size_t c = 0; c < color.size(); ++c) {
        color[c] = static_cast<std::uint8_t>(
            std::lround(std::lerp(mesh.colors[a][c], mesh.colors[b][c], way)));
      }
    }
    return at->second = added(point);
  };
  for (const Triangle& triangle : mesh.triangles) {
    // The polygon of what stays, cut into triangles about its first corner.
    std::array<std::uint32_t, 4> corners{};
    std::size_t count = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = triangle[i], b = triangle[(i + 1) % 3];
      if (below(a) > 0) corners[count++] = kept(a);
      if ((below(a) > 0) != (below(b) > 0)) corners[count++] = crossing(a, b);
    }
    for (std::size_t i = 2; i < count; ++i) {
      cut.triangles.push_back({corners[0], corners[i - 1], corners[i]});
    }
  }
  return cut;
}

std::string made_file(const Device& device, const Map& map, const MakeRequest& request,
                      const ProgressMonitor& monitor) {
  if (request.is_turntable) return turntable(device, map, request, monitor);
  return mesh_file(device, map, request, monitor);
}

}  // namespace qjulia::explore

#include "qjulia/edit/portal_choice.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "map/portals.hpp"
#include "measure/shortest_ways.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/portal_settings.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia {
namespace {

using Eigen::Vector3d;

/// Cells along the shape's longest side of the surface that tips are sought on.
constexpr int kCells = 96;
/// Points of the surface that are tried.
constexpr int kMostTries = 64;
/// The body: what is no farther from the origin than so many times the nearest point.
constexpr double kBody = 1.5;
/// A tip's direction is that from the middle of the surface this far around it, map units.
constexpr double kTipReach = 0.4;
/// A copy is sunk into the shape by this share of its height.
constexpr double kSunk = 0.06;
/// What the set reaches beyond the shape, of its radius.
constexpr double kBeyond = 1.06;
/// The smallest copy that is reported, as a share of the shape's size.
constexpr double kSmallestSeen = 0.01;

/// Distances along a surface's edges from points that are added one by one.
class EdgeDistances {
 public:
  explicit EdgeDistances(const TriangleMesh& mesh)
      : vertices_(mesh.vertices),
        neighbours_(mesh.vertices.size()),
        distances_(mesh.vertices.size(), std::numeric_limits<double>::infinity()) {
    for (const auto& [a, b, c] : mesh.triangles) {
      neighbours_[a].push_back(b);
      neighbours_[b].push_back(c);
      neighbours_[c].push_back(a);
    }
  }

  void add(const std::vector<std::size_t>& sources) {
    surface::shorten_ways(distances_, sources, [&](std::size_t from, const auto& take) {
      for (const std::size_t next : neighbours_[from]) {
        take(next, (vertices_[next] - vertices_[from]).norm());
      }
    });
  }

  /// The farthest point of the part that is reached.
  std::size_t farthest() const {
    const auto farthest = std::ranges::max_element(
        distances_, {}, [](double distance) { return std::isfinite(distance) ? distance : -1; });
    return static_cast<std::size_t>(farthest - distances_.begin());
  }

 private:
  std::vector<Vector3d> vertices_;
  std::vector<std::vector<std::size_t>> neighbours_;
  std::vector<double> distances_;
};

/// The shape's own surface, map coordinates.
TriangleMesh own_surface(const Device& device, const Map& map, const ProgressMonitor& monitor) {
  TriangleMesh mesh =
      extract_surface(device, map, {.resolution = kCells, .iterations = 1}, monitor);
  if (mesh.triangles.empty()) {
    throw InputError("the map's own shape is empty, so that no copy has a place to stand on");
  }
  for (Vector3d& x : mesh.vertices) x = map.frame.shape_to_map.to_map(x);
  return mesh;
}

/// Away from the middle of the surface about it.
Vector3d outward(const TriangleMesh& mesh, const Vector3d& tip) {
  Vector3d sum = Vector3d::Zero();
  double count = 0;
  for (const Vector3d& x : mesh.vertices) {
    if ((x - tip).norm() > kTipReach) continue;
    sum += x;
    ++count;
  }
  const Vector3d away = tip - sum / count;
  return away.norm() > 0 ? Vector3d(away.normalized()) : Vector3d(tip.normalized());
}

/// A portal whose copy of the mesh stands on `tip`, its foot towards the shape.
/// @param middle, radius of a ball that holds the mesh.
Portal copy_on(const TriangleMesh& mesh, const Vector3d& middle, double radius, const Vector3d& tip,
               const PortalOptions& options) {
  const Vector3d up = outward(mesh, tip);
  double lowest = 0, highest = 0;
  for (const Vector3d& x : mesh.vertices) {
    const double height = up.dot(x - middle);
    lowest = std::min(lowest, height);
    highest = std::max(highest, height);
  }
  const double sunk = lowest + kSunk * (highest - lowest);
  Vector3d foot = Vector3d::Zero();
  double count = 0;
  for (const Vector3d& x : mesh.vertices) {
    if (up.dot(x - middle) > sunk) continue;
    foot += x - middle;
    ++count;
  }
  foot /= count;
  Portal portal;
  portal.scale = 1 / options.size;
  portal.radius = kBeyond * radius * options.size;
  portal.center = tip - options.size * (foot + (sunk - up.dot(foot)) * up);
  portal.destination = middle;
  portal.mask = options.mask;
  return portal;
}

/// Whether a portal's ball is clear of the origin, and of other balls.
bool has_room(const Portal& portal, const std::vector<Portal>& others) {
  if (portal.center.norm() <= 1.05 * portal.radius) return false;
  return std::ranges::none_of(others, [&](const Portal& other) {
    return (portal.center - other.center).norm() <= 1.001 * (portal.radius + other.radius);
  });
}

/// Balls that hold the copies' own portals too: ρ s ≥ D + ρ, with D the farthest centre from where
/// centres lead. @param room how many times so wide they are. @return none if they would have
/// points in common.
std::optional<std::vector<Portal>> with_room_for_copies(const std::vector<Portal>& portals,
                                                        double room) {
  std::vector<Portal> wide;
  for (Portal portal : portals) {
    double farthest = 0;
    for (const Portal& other : portals) {
      farthest = std::max(farthest, (other.center - portal.destination).norm());
    }
    portal.radius = std::max(portal.radius, room * farthest / (portal.scale - 1));
    if (!has_room(portal, wide)) return std::nullopt;
    wide.push_back(portal);
  }
  return wide;
}

}  // namespace

void PortalOptions::validate() const { expect_in_ranges(portal_settings(), *this); }

std::vector<Portal> proposed_portals(const Device& device, const Map& map,
                                     const PortalOptions& options, const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  if (map.dynamics.slice != 0) {
    throw InputError(
        fmt::format("portals can be proposed only for the slice W = 0, and the map's is W = {}",
                    map.dynamics.slice));
  }
  const TriangleMesh mesh = own_surface(device, without_portals(map), monitor);
  const Vector3d middle = mesh.box().center();
  double radius = 0, nearest = std::numeric_limits<double>::infinity();
  for (const Vector3d& x : mesh.vertices) {
    radius = std::max(radius, (x - middle).norm());
    nearest = std::min(nearest, x.norm());
  }
  std::vector<std::size_t> body;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (mesh.vertices[i].norm() <= kBody * nearest) body.push_back(i);
  }
  const Field field(device, without_portals(map));
  // A copy whose middle lies inside the shape would not be seen.
  const auto stands_off = [&](const Portal& portal) {
    return field.at(on_slice({&portal.center, 1}, 0)).front() > map.dynamics.surface_level;
  };
  EdgeDistances distances(mesh);
  distances.add(body);
  std::vector<Portal> portals;
  for (int tried = 0; tried < kMostTries && std::ssize(portals) < options.count; ++tried) {
    throw_if_stopped(monitor.stop);
    const std::size_t tip = distances.farthest();
    distances.add({tip});
    const Portal portal = copy_on(mesh, middle, radius, mesh.vertices[tip], options);
    if (has_room(portal, portals) && stands_off(portal)) portals.push_back(portal);
  }
  if (portals.empty()) {
    throw OptionError(
        "size",
        fmt::format("there is no place for a copy of {:.3g} of the shape's size: at every tip "
                    "it would cover the origin of iteration or stand inside the shape; "
                    "give a smaller size, such as {:.2g}",
                    options.size, 0.5 * options.size));
  }
  // A camera can dive into a portal where there is room about the point to which copies shrink
  // (tools/film/dive.hpp).
  constexpr double kWide = 1.5, kJust = 1.01;
  for (const double room : {kWide, kJust}) {
    if (const auto wide = with_room_for_copies(portals, room)) return *wide;
  }
  return portals;
}

int visible_depth(const std::vector<Portal>& portals) {
  double least = std::numeric_limits<double>::infinity();
  for (const Portal& portal : portals) least = std::min(least, portal.scale);
  if (!(least > 1)) return 0;
  constexpr double kDeepest = 1000;
  return static_cast<int>(std::clamp(std::log(1 / kSmallestSeen) / std::log(least), 1.0, kDeepest));
}

}  // namespace qjulia

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
/// A copy that is planted stands across the surface this far around its place, map units.
constexpr double kFootReach = 0.15;
/// A copy is sunk into the shape by this share of its height.
constexpr double kSunk = 0.06;
/// What the set reaches beyond the shape, of its radius.
constexpr double kBeyond = 1.06;
/// Balls that hold copies on copies are so many times as wide as they must be.
constexpr double kJust = 1.01;
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

/// The mean normal of the surface about one of its vertices, on the vertex's own side of thin
/// limbs.
Vector3d facing(const TriangleMesh& mesh, std::size_t vertex) {
  const Vector3d& place = mesh.vertices[vertex];
  const auto normal = [&](const Triangle& triangle) {
    const auto& [a, b, c] = triangle;
    const Vector3d& x = mesh.vertices[a];
    return Vector3d((mesh.vertices[b] - x).cross(mesh.vertices[c] - x));
  };
  Vector3d own = Vector3d::Zero();
  for (const Triangle& triangle : mesh.triangles) {
    if (std::ranges::count(triangle, vertex) > 0) own += normal(triangle);
  }
  Vector3d sum = Vector3d::Zero();
  for (const Triangle& triangle : mesh.triangles) {
    if ((mesh.vertices[triangle[0]] - place).norm() > kFootReach) continue;
    if (const Vector3d n = normal(triangle); n.dot(own) > 0) sum += n;
  }
  return sum.norm() > 0 ? Vector3d(sum.normalized()) : outward(mesh, place);
}

/// A ball that holds the mesh.
struct Ball {
  Vector3d middle;
  double radius = 0;
};

Ball ball_about(const TriangleMesh& mesh) {
  Ball ball{mesh.box().center()};
  for (const Vector3d& x : mesh.vertices) {
    ball.radius = std::max(ball.radius, (x - ball.middle).norm());
  }
  return ball;
}

/// A portal whose copy of the mesh stands on `tip`, its foot towards the shape.
/// @param ball that holds the mesh. @param up away from the shape.
Portal copy_on(const TriangleMesh& mesh, const Ball& ball, const Vector3d& tip, const Vector3d& up,
               const PortalOptions& options) {
  const auto& [middle, radius] = ball;
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

/// The shape's own surface, as proposals and planted copies need it.
/// @throws InputError when the slice is another one than W = 0.
TriangleMesh surface_to_stand_on(const Device& device, const Map& map,
                                 const ProgressMonitor& monitor) {
  map.validate();
  if (map.dynamics.slice != 0) {
    throw InputError(fmt::format(
        "portals can stand only on the slice W = 0, and the map's is W = {}", map.dynamics.slice));
  }
  return own_surface(device, without_portals(map), monitor);
}

/// Whether a copy's middle lies outside of the shape: otherwise it would not be seen.
/// @param shape the map's field without portals.
bool stands_off(const Field& shape, const Map& map, const Portal& portal) {
  return shape.at(on_slice({&portal.center, 1}, 0)).front() > map.dynamics.surface_level;
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
  const TriangleMesh mesh = surface_to_stand_on(device, map, monitor);
  const Ball ball = ball_about(mesh);
  double nearest = std::numeric_limits<double>::infinity();
  for (const Vector3d& x : mesh.vertices) nearest = std::min(nearest, x.norm());
  std::vector<std::size_t> body;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    if (mesh.vertices[i].norm() <= kBody * nearest) body.push_back(i);
  }
  const Field shape(device, without_portals(map));
  EdgeDistances distances(mesh);
  distances.add(body);
  std::vector<Portal> portals;
  for (int tried = 0; tried < kMostTries && std::ssize(portals) < options.count; ++tried) {
    throw_if_stopped(monitor.stop);
    const std::size_t tip = distances.farthest();
    distances.add({tip});
    const Vector3d& at = mesh.vertices[tip];
    const Portal portal = copy_on(mesh, ball, at, outward(mesh, at), options);
    if (has_room(portal, portals) && stands_off(shape, map, portal)) portals.push_back(portal);
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
  constexpr double kWide = 1.5;
  for (const double room : {kWide, kJust}) {
    if (const auto wide = with_room_for_copies(portals, room)) return *wide;
  }
  return portals;
}

std::vector<Portal> planted_portals(const Device& device, const Map& map, const Vector3d& place,
                                    double size, const ProgressMonitor& monitor) {
  const PortalOptions options{.size = size};
  options.validate();
  if (!place.allFinite()) throw OptionError("place", "it is not finite");
  std::vector<Portal> portals = map.layers.portals;
  if (std::ssize(portals) >= kMostPortals) {
    throw InputError(
        fmt::format("the map has {} portals, the most that a map holds", portals.size()));
  }
  const TriangleMesh mesh = surface_to_stand_on(device, map, monitor);
  const Vector3d wanted = map.frame.shape_to_map.to_map(place);
  const auto nearest = std::ranges::min_element(
      mesh.vertices, {}, [&](const Vector3d& x) { return (x - wanted).squaredNorm(); });
  const auto foot = static_cast<std::size_t>(nearest - mesh.vertices.begin());
  const Portal portal = copy_on(mesh, ball_about(mesh), *nearest, facing(mesh, foot), options);
  const auto refuse = [&](const char* why) {
    throw OptionError("size", fmt::format("a copy of {:.3g} of the shape's size would {}; give a "
                                          "smaller size, or another place",
                                          size, why));
  };
  if (!has_room(portal, {})) refuse("cover the origin of iteration");
  if (!has_room(portal, portals)) refuse("reach into another copy's ball");
  if (!stands_off(Field(device, without_portals(map)), map, portal)) {
    refuse("stand inside the shape");
  }
  portals.push_back(portal);
  return with_room_for_copies(portals, kJust).value_or(portals);
}

int visible_depth(const std::vector<Portal>& portals) {
  double least = std::numeric_limits<double>::infinity();
  for (const Portal& portal : portals) least = std::min(least, portal.scale);
  if (!(least > 1)) return 0;
  constexpr double kDeepest = 1000;
  return static_cast<int>(std::clamp(std::log(1 / kSmallestSeen) / std::log(least), 1.0, kDeepest));
}

}  // namespace qjulia

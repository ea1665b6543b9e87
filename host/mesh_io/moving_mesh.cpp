#include "qjulia/mesh/moving_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "base/file_types.hpp"
#include "base/output_file.hpp"
#include "base/random.hpp"
#include "base/range_check.hpp"
#include "mesh_io/mesh_objects.hpp"
#include "mesh_io/write_glb.hpp"
#include "mesh_io/write_usd.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

/// The triangles of each body, in the mesh's order.
std::vector<std::vector<std::size_t>> triangles_of_bodies(const TriangleMesh& mesh) {
  const shape::Objects objects = shape::objects_of(mesh);
  std::vector<std::vector<std::size_t>> bodies(objects.count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    bodies[objects.of_triangle(t)].push_back(t);
  }
  return bodies;
}

/// A body about the middle of its box, with that middle as its place.
MovingBody body_of(const TriangleMesh& mesh, const std::vector<std::size_t>& triangles,
                   std::vector<std::uint32_t>& numbers) {
  MovingBody body;
  TriangleMesh& own = body.mesh;
  std::vector<std::uint32_t> used;
  constexpr std::uint32_t kNone = shape::Objects::kNone;
  for (const std::size_t t : triangles) {
    Triangle triangle = mesh.triangles[t];
    for (std::uint32_t& v : triangle) {
      if (numbers[v] == kNone) {
        numbers[v] = static_cast<std::uint32_t>(used.size());
        used.push_back(v);
      }
      v = numbers[v];
    }
    own.triangles.push_back(triangle);
  }
  for (const std::uint32_t v : used) {
    numbers[v] = kNone;
    own.vertices.push_back(mesh.vertices[v]);
    if (!mesh.normals.empty()) own.normals.push_back(mesh.normals[v]);
    if (!mesh.colors.empty()) own.colors.push_back(mesh.colors[v]);
  }
  const Eigen::Vector3d center = own.box().center();
  for (Eigen::Vector3d& x : own.vertices) x -= center;
  body.poses = {{center, Eigen::Quaterniond::Identity()}};
  return body;
}

/// What all bodies have in common.
struct Scattering {
  ScatterOptions options;
  Box box;               ///< of the whole mesh
  Eigen::Vector3d up;    ///< unit vectors
  Eigen::Vector3d wind;  ///< at right angles to `up`

  double length() const { return box.size().maxCoeff(); }
  /// How late the field reaches a place: 0 first, 1 last.
  double lateness(const Eigen::Vector3d& place) const {
    const Eigen::Vector3d from_middle = place - box.center();
    const auto along = [&](const Eigen::Vector3d& axis) {
      const double extent = box.size().dot(axis.cwiseAbs());
      return extent > 0 ? 0.5 + from_middle.dot(axis) / extent : 0.5;
    };
    switch (options.field) {
      case ScatterField::outward:
        return length() > 0 ? 1 - from_middle.norm() / (box.size().norm() / 2) : 0.5;
      case ScatterField::wind:
        return 1 - along(wind);  // the lee side first: nothing is in its way
      case ScatterField::gravity:
        break;
    }
    return along(up);
  }
};

/// Numbers that a body draws once.
struct Chance {
  double lateness, speed, flutter, turns;
  Eigen::Vector3d axis, aside;  ///< unit vectors

  explicit Chance(base::Random& random)
      : lateness(random.uniform()),
        speed(random.uniform(0.7, 1.3)),
        flutter(random.uniform()),
        turns(random.uniform(-1, 1)),
        axis(direction(random)),
        aside(direction(random)) {}

  /// Even over the sphere (Archimedes).
  static Eigen::Vector3d direction(base::Random& random) {
    const double z = random.uniform(-1, 1), angle = random.uniform(0, 2 * std::numbers::pi);
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }
};

/// How far a body is from where it set off, `seconds` after it did. @param share of its time
/// @param fall the longest way down
Eigen::Vector3d way(const Scattering& all, const Chance& chance, const Eigen::Vector3d& from,
                    double seconds, double share, double fall) {
  constexpr double kFallTime = 0.6;  // seconds in which a body falls as far as the mesh is long
  constexpr double kLift = 0.3, kFlutter = 0.08;
  const double reach = all.options.distance * all.length() * chance.speed * share * share;
  switch (all.options.field) {
    case ScatterField::outward: {
      const Eigen::Vector3d out = from - all.box.center();
      const Eigen::Vector3d straight = out.norm() > 0 ? out.normalized() : chance.axis;
      return reach * (straight + 0.2 * chance.aside).normalized();
    }
    case ScatterField::wind: {
      const double phase = 2 * std::numbers::pi * (2 * share + chance.flutter);
      const double flutter = kFlutter * all.length() * share *
                             (std::sin(phase) - std::sin(2 * std::numbers::pi * chance.flutter));
      return reach * (all.wind + kLift * chance.speed * all.up) + flutter * chance.aside;
    }
    case ScatterField::gravity:
      break;
  }
  const double fallen = all.length() * seconds * seconds / (kFallTime * kFallTime);
  return -std::min(fallen, fall) * all.up;
}

void scatter(MovingBody& body, const Scattering& all, const Chance& chance, const MovingMesh& of) {
  constexpr double kSpread = 0.5, kByChance = 0.3;
  const Eigen::Vector3d from = body.poses.front().place;
  const double last = static_cast<double>(of.moments - 1) / of.rate;
  const double late =
      (1 - kByChance) * std::clamp(all.lateness(from), 0.0, 1.0) + kByChance * chance.lateness;
  const double start = kSpread * last * late;
  double radius = 0;
  for (const Eigen::Vector3d& x : body.mesh.vertices) radius = std::max(radius, x.norm());
  // Turned as it may be, it does not reach through the floor, which is under the whole mesh.
  const double height =
      0.5 * std::abs(all.box.size().dot(all.up)) + (from - all.box.center()).dot(all.up);
  const double fall = std::max(0.0, height - radius);
  const bool falls = all.options.field == ScatterField::gravity;
  body.poses.reserve(of.moments);
  for (std::size_t i = 1; i < of.moments; ++i) {
    const double seconds = std::max(0.0, static_cast<double>(i) / of.rate - start);
    const double share = last > start ? seconds / (last - start) : 0;
    const Eigen::Vector3d gone = way(all, chance, from, seconds, share, fall);
    // What falls turns as long as it does.
    const double turned = falls && fall > 0 ? gone.norm() / fall : falls ? 0 : share;
    const double angle = 2 * std::numbers::pi * chance.turns * turned;
    body.poses.push_back({from + gone, Eigen::Quaterniond(Eigen::AngleAxisd(angle, chance.axis))});
  }
}

}  // namespace

void ScatterOptions::validate() const {
  base::expect_between("seconds", seconds, 0.1, 600);
  base::expect_between("distance", distance, 0, 100);
}

void MovingMesh::validate() const {
  base::expect_positive("rate", rate);
  if (moments == 0) throw InputError("the moving mesh has no moments; give it at least one");
  std::size_t vertices = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const MovingBody& body = bodies[i];
    body.mesh.validate();
    vertices += body.mesh.vertices.size();
    const TriangleMesh& first = bodies.front().mesh;
    if (body.mesh.normals.empty() != first.normals.empty() ||
        body.mesh.colors.empty() != first.colors.empty()) {
      throw InputError(
          fmt::format("body {} has normals or colors where body 0 has none, or has none where body "
                      "0 has them; give all bodies the same",
                      i));
    }
    if (body.poses.size() != 1 && body.poses.size() != moments) {
      throw InputError(
          fmt::format("body {} has {} poses for {} moments; give one for each moment, or a "
                      "single one for a body that stays still",
                      i, body.poses.size(), moments));
    }
    for (const BodyPose& pose : body.poses) {
      constexpr double kTolerance = 1e-6;
      const bool is_turn = std::abs(pose.turn.norm() - 1) < kTolerance;  // NaN is not
      if (pose.place.allFinite() && is_turn) continue;
      throw InputError(fmt::format(
          "body {} has a pose whose place is not finite or whose turn is not of length 1", i));
    }
  }
  if (vertices > std::numeric_limits<std::uint32_t>::max()) {
    throw InputError(fmt::format("its bodies have {} vertices, more than a mesh can", vertices));
  }
}

namespace {

/// All bodies in one mesh. @param pose_of gives the pose of a body
template <class PoseOf>
TriangleMesh joined(const MovingMesh& moving, const PoseOf& pose_of) {
  TriangleMesh all;
  for (const MovingBody& body : moving.bodies) {
    const BodyPose pose = pose_of(body);
    const auto first = static_cast<std::uint32_t>(all.vertices.size());
    for (const Triangle& t : body.mesh.triangles) {
      all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    const Eigen::Matrix3d turn = pose.turn.toRotationMatrix();
    for (const Eigen::Vector3d& x : body.mesh.vertices) {
      all.vertices.emplace_back(pose.place + turn * x);
    }
    const Eigen::Matrix3f turn_of_normals = turn.cast<float>();
    for (const Eigen::Vector3f& n : body.mesh.normals)
      all.normals.emplace_back(turn_of_normals * n);
    all.colors.insert(all.colors.end(), body.mesh.colors.begin(), body.mesh.colors.end());
  }
  return all;
}

}  // namespace

TriangleMesh mesh_at(const MovingMesh& moving, std::size_t moment) {
  moving.validate();
  if (moment >= moving.moments) {
    throw InputError(fmt::format("the mesh has {} moments; give one from 0 to {}", moving.moments,
                                 moving.moments - 1));
  }
  return joined(moving, [&](const MovingBody& body) {
    return body.poses.size() == 1 ? body.poses.front() : body.poses[moment];
  });
}

TriangleMesh mesh_after(const MovingMesh& moving, double seconds) {
  moving.validate();
  if (!(seconds >= 0) || !std::isfinite(seconds)) {
    throw InputError(fmt::format("{} seconds; give 0 or more", seconds));
  }
  const std::size_t last = moving.moments - 1;
  const double place = std::min(seconds * moving.rate, static_cast<double>(last));
  const auto before = static_cast<std::size_t>(place);
  const std::size_t after = std::min(before + 1, last);
  const double way = place - static_cast<double>(before);
  return joined(moving, [&](const MovingBody& body) {
    if (body.poses.size() == 1) return body.poses.front();
    const BodyPose &from = body.poses[before], &to = body.poses[after];
    return BodyPose{from.place + way * (to.place - from.place), from.turn.slerp(way, to.turn)};
  });
}

MovingMesh scattered(const TriangleMesh& mesh, const ScatterOptions& options, UpAxis up) {
  options.validate();
  mesh.validate();
  MovingMesh moving;
  moving.moments = static_cast<std::size_t>(std::round(options.seconds * moving.rate)) + 1;
  std::vector<std::uint32_t> numbers(mesh.vertices.size(), shape::Objects::kNone);
  for (const auto& triangles : triangles_of_bodies(mesh)) {
    moving.bodies.push_back(body_of(mesh, triangles, numbers));
  }
  if (moving.bodies.empty()) return moving;
  constexpr std::size_t kMostPoses = 20'000'000;  // a gigabyte of them
  if (moving.bodies.size() > kMostPoses / moving.moments) {
    throw InputError(
        fmt::format("{} bodies in {} moments are more than {} poses; give fewer seconds, or leave "
                    "small bodies out",
                    moving.bodies.size(), moving.moments, kMostPoses));
  }
  std::vector<double> volumes;  // each is computed once
  for (const MovingBody& body : moving.bodies) volumes.push_back(signed_volume(body.mesh));
  const auto largest =
      moving.bodies.begin() + (std::ranges::max_element(volumes) - volumes.begin());
  std::rotate(moving.bodies.begin(), largest, largest + 1);
  const Eigen::Vector3d upward = direction(up);
  const Eigen::Vector3d wind = std::abs(upward.x()) > 0.5 ? Eigen::Vector3d::UnitY().eval()
                                                          : Eigen::Vector3d::UnitX().eval();
  const Scattering all{options, mesh.box(), upward, wind};
  base::Random random(options.seed);
  for (std::size_t i = 1; i < moving.bodies.size(); ++i) {
    scatter(moving.bodies[i], all, Chance(random), moving);
  }
  moving.validate();  // coordinates may be too large to add
  return moving;
}

void write_moving_mesh(const MovingMesh& moving, const std::filesystem::path& path,
                       const MeshFileOptions& options) {
  moving.validate();
  options.validate();
  const std::string extension = base::extension_of(path);
  if (extension != ".glb" && extension != ".usda") {
    throw InputError(
        fmt::format("'{}': a mesh that moves is written as .glb or .usda", path.string()));
  }
  base::OutputFile file(path);
  const std::string name = options.name.empty() ? path.stem().string() : options.name;
  const UpAxis up = options.up.value_or(UpAxis::z);
  const double metres = options.metres_per_unit.value_or(1);
  if (extension == ".glb") {
    shape::write_moving_glb(moving, name, options.note, up, metres, options.map, file.stream());
  } else {
    shape::write_moving_usd(moving, name, options.note, up, metres, file.stream());
  }
  if (!file.stream()) {
    throw OutputError(fmt::format("cannot write mesh '{}'; check the space left", path.string()));
  }
  file.commit();
}

}  // namespace qjulia

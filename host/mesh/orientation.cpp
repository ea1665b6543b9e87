/// Which parts of a mesh are wound inside out. This follows from their signed volumes, and from
/// which parts lie in which.
///
/// A part lies in another one when most of the rays that begin on it begin inside the other. The
/// winding number of a body about the point where a ray begins is a sum over the body's triangles
/// that the ray crosses: +1 where it comes out and −1 where it goes in.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <span>

#include "base/random.hpp"
#include "mesh/parts.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia {
namespace shape {
namespace {

constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

/// Rays from each body. There are fewer if there are many bodies.
constexpr std::size_t kMostRays = 64, kFewestRays = 8, kRaysInAll = std::size_t{1} << 17;
constexpr std::size_t kRaysAtOnce = std::size_t{1} << 17;
constexpr std::uint64_t kRaySeed = 1;

/// A part that encloses a volume.
struct Solid {
  std::uint32_t part;
  double volume;  ///< signed
};

/// A body may have holes, as long as its area vectors sum to no more than this share of its area.
constexpr double kMostOpen = 0.25;
/// Volumes below this share of the area times the mesh's longest side are rounding errors.
constexpr double kLeastEnclosed = 1e-10;

/// The parts that enclose a volume, the largest first.
std::vector<Solid> bodies_of(const TriangleMesh& mesh, const Parts& parts) {
  const double side = mesh.box().size().maxCoeff();
  std::vector<Solid> bodies;
  for (std::uint32_t part = 0; part < parts.size(); ++part) {
    const ConeSum& sum = parts.sums[part];
    const double volume = sum.is_closed() ? sum.volume : sum.volume_from_centroid();
    if (sum.normals.norm() > kMostOpen * sum.area) continue;
    if (std::abs(volume) > kLeastEnclosed * sum.area * side) bodies.push_back({part, volume});
  }
  std::ranges::stable_sort(bodies, std::ranges::greater{},
                           [](const Solid& body) { return std::abs(body.volume); });
  return bodies;
}

/// A ray from a point of a body's surface in the positive direction of a coordinate axis.
struct Ray {
  Eigen::Vector3d from;
  std::uint32_t body;
  std::uint32_t axis;
};

/// `count` rays from each body, spread evenly by area and taking the three axes in turn.
/// @param body_of the number of each part's body, or kNone.
std::vector<Ray> rays_from(const TriangleMesh& mesh, const Parts& parts,
                           const std::vector<std::uint32_t>& body_of, std::size_t bodies,
                           std::size_t count) {
  struct Walk {
    double area = 0;  // area of the triangles so far
    std::uint32_t rays = 0;
  };
  std::vector<Walk> walks(bodies);
  base::Random random(kRaySeed);
  std::vector<Ray> rays;
  rays.reserve(bodies * count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const std::uint32_t body = body_of[parts.of_triangle[t]];
    if (body == kNone) continue;
    const Eigen::Vector3d& a = mesh.vertices[mesh.triangles[t][0]];
    const Eigen::Vector3d ab = mesh.vertices[mesh.triangles[t][1]] - a;
    const Eigen::Vector3d ac = mesh.vertices[mesh.triangles[t][2]] - a;
    Walk& walk = walks[body];
    walk.area += 0.5 * ab.cross(ac).norm();
    const double apart = parts.sums[parts.of_triangle[t]].area / static_cast<double>(count);
    while (walk.rays < count && walk.area > (walk.rays + 0.5) * apart) {
      // Uniform in the triangle (Osada et al. 2002).
      const double r = std::sqrt(random.uniform());
      const double s = random.uniform();
      rays.push_back({a + r * ((1 - s) * ab + s * ac), body, walk.rays++ % 3});
    }
  }
  return rays;
}

/// Rays along one axis, sorted into the cells of a grid across it.
class RayGrid {
 public:
  /// @param numbers of the rays in `rays` that are along `axis`
  RayGrid(std::span<const Ray> rays, std::span<const std::uint32_t> numbers, int axis)
      : rays_(rays), axis_(axis), u_((axis + 1) % 3), v_((axis + 2) % 3) {
    for (const std::uint32_t ray : numbers) bounds_.extend(flat(rays_[ray].from));
    cells_ = std::max<std::size_t>(
        1, static_cast<std::size_t>(std::sqrt(static_cast<double>(numbers.size()))));
    first_.resize(cells_ * cells_ + 1);
    const auto cell_of = [&](std::uint32_t ray) {
      const Eigen::Vector2d p = flat(rays_[ray].from);
      return cell(p, 1) * cells_ + cell(p, 0);
    };
    for (const std::uint32_t ray : numbers) ++first_[cell_of(ray) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<std::size_t> next = first_;
    sorted_.resize(numbers.size());
    for (const std::uint32_t ray : numbers) sorted_[next[cell_of(ray)]++] = ray;
  }

  /// Calls `use` with the number of each ray that crosses the triangle, and the sign of the
  /// crossing. The sum over a closed surface does not depend on rounding, because a ray passes an
  /// edge on the same side for both triangles of the edge.
  template <class Use>
  void for_crossings(const std::array<Eigen::Vector3d, 3>& corners, const Use& use) const {
    const std::array<Eigen::Vector2d, 3> p{flat(corners[0]), flat(corners[1]), flat(corners[2])};
    const Eigen::Vector2d low = p[0].cwiseMin(p[1]).cwiseMin(p[2]);
    const Eigen::Vector2d high = p[0].cwiseMax(p[1]).cwiseMax(p[2]);
    if (!bounds_.intersects({low, high})) return;
    const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    const std::size_t left = cell(low, 0), right = cell(high, 0);
    for (std::size_t row = cell(low, 1); row <= cell(high, 1); ++row) {
      const auto begin = first_[row * cells_ + left];
      const auto end = first_[row * cells_ + right + 1];
      for (std::size_t i = begin; i < end; ++i) {
        const Eigen::Vector3d& from = rays_[sorted_[i]].from;
        const int sign = winding(p, flat(from));
        if (sign == 0) continue;
        const double height = normal.dot(corners[0] - from) / normal[axis_];
        if (height > 0) use(sorted_[i], sign);
      }
    }
  }

 private:
  Eigen::Vector2d flat(const Eigen::Vector3d& x) const { return {x[u_], x[v_]}; }

  std::size_t cell(const Eigen::Vector2d& p, Eigen::Index along) const {
    const double size = bounds_.sizes()[along];
    const auto cells = static_cast<double>(cells_);
    const double place = size > 0 ? cells * ((p[along] - bounds_.min()[along]) / size) : 0;
    return static_cast<std::size_t>(std::clamp(place, 0.0, cells - 1));
  }

  /// The winding number of a triangle about a point: 1 if the triangle is counter-clockwise, −1 if
  /// it is clockwise, 0 if the point is outside.
  static int winding(const std::array<Eigen::Vector2d, 3>& p, const Eigen::Vector2d& at) {
    int sum = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector2d &from = p[i], &to = p[(i + 1) % 3];
      const bool rises = to.y() > at.y();
      if ((from.y() > at.y()) == rises) continue;
      const Eigen::Vector2d &low = rises ? from : to, &high = rises ? to : from;
      const double x = low.x() + (at.y() - low.y()) * ((high.x() - low.x()) / (high.y() - low.y()));
      if (x > at.x()) sum += rises ? 1 : -1;
    }
    return sum;
  }

  std::span<const Ray> rays_;
  int axis_;
  Eigen::Index u_, v_;  ///< the other axes, so that the three are right-handed
  Eigen::AlignedBox2d bounds_;
  std::size_t cells_;                  ///< along a side
  std::vector<std::size_t> first_;     ///< in `sorted_`, of each cell
  std::vector<std::uint32_t> sorted_;  ///< numbers of rays
};

/// For each body, the larger bodies that it lies in, the largest first.
using Holders = std::vector<std::vector<std::uint32_t>>;

/// For each ray that begins inside another body, calls `use` with the ray's own body and the other.
template <class Use>
void for_rays_in_bodies(const TriangleMesh& mesh, const Parts& parts,
                        const std::vector<std::uint32_t>& body_of, std::span<const Ray> rays,
                        const std::stop_token& stop, const Use& use) {
  std::array<std::vector<std::uint32_t>, 3> along;
  for (std::uint32_t ray = 0; ray < rays.size(); ++ray) along[rays[ray].axis].push_back(ray);
  const std::array<RayGrid, 3> grids{RayGrid(rays, along[0], 0), RayGrid(rays, along[1], 1),
                                     RayGrid(rays, along[2], 2)};
  struct Crossing {
    std::uint32_t ray, body;
    int sign;
  };
  std::vector<Crossing> crossings;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % kTrianglesPolled == 0) throw_if_stopped(stop);
    const std::uint32_t body = body_of[parts.of_triangle[t]];
    if (body == kNone) continue;
    const auto& [a, b, c] = mesh.triangles[t];
    const std::array<Eigen::Vector3d, 3> corners{mesh.vertices[a], mesh.vertices[b],
                                                 mesh.vertices[c]};
    for (const RayGrid& grid : grids) {
      grid.for_crossings(corners, [&](std::uint32_t ray, int sign) {
        if (body < rays[ray].body) crossings.push_back({ray, body, sign});
      });
    }
  }
  throw_if_stopped(stop);
  const auto key = [](const Crossing& crossing) { return std::pair(crossing.ray, crossing.body); };
  std::ranges::sort(crossings, {}, key);
  for (auto first = crossings.begin(); first != crossings.end();) {
    int winding = 0;
    auto last = first;
    for (; last != crossings.end() && key(*last) == key(*first); ++last) winding += last->sign;
    if (winding != 0) use(rays[first->ray].body, first->body);
    first = last;
  }
}

Holders find_holders(const TriangleMesh& mesh, const Parts& parts,
                     const std::vector<std::uint32_t>& body_of, std::size_t bodies,
                     const std::stop_token& stop) {
  const std::size_t count = std::clamp(kRaysInAll / bodies, kFewestRays, kMostRays);
  const std::vector<Ray> rays = rays_from(mesh, parts, body_of, bodies, count);
  using Pair = std::pair<std::uint32_t, std::uint32_t>;
  std::vector<Pair> found;  // one for each ray in a body
  for (std::size_t first = 0; first < rays.size(); first += kRaysAtOnce) {
    for_rays_in_bodies(mesh, parts, body_of,
                       std::span(rays).subspan(first, std::min(kRaysAtOnce, rays.size() - first)),
                       stop,
                       [&](std::uint32_t of, std::uint32_t in) { found.emplace_back(of, in); });
  }
  std::ranges::sort(found);
  Holders holders(bodies);
  for (auto first = found.begin(); first != found.end();) {
    const auto last = std::find_if(first, found.end(), [&](const Pair& p) { return p != *first; });
    if (2 * static_cast<std::size_t>(last - first) > count) {
      holders[first->first].push_back(first->second);
    }
    first = last;
  }
  return holders;
}

/// Which bodies are turned. Bodies come after those that hold them. When a body is turned, the
/// bodies in it are turned with it; one that is then still inside out is a cavity if there is
/// material around it, and else is turned itself.
std::vector<bool> turned_by(const std::vector<Solid>& bodies, const Holders& holders) {
  std::vector<bool> turned(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    int material = 0;
    bool turns = false;
    for (const std::uint32_t holder : holders[i]) {
      const bool adds = (bodies[holder].volume > 0) != turned[holder];
      material += adds ? 1 : -1;
      turns = turned[holder];
    }
    const bool is_inside_out = (bodies[i].volume < 0) != turns;
    turned[i] = is_inside_out && material <= 0 ? !turns : turns;
  }
  return turned;
}

}  // namespace

std::vector<bool> parts_inside_out(const TriangleMesh& mesh, const Parts& parts,
                                   const std::stop_token& stop) {
  const std::vector<Solid> bodies = bodies_of(mesh, parts);
  const auto is_negative = [](const Solid& body) { return body.volume < 0; };
  const bool all_alike =
      std::ranges::all_of(bodies, is_negative) || std::ranges::none_of(bodies, is_negative);
  std::vector<std::uint32_t> body_of(parts.size(), kNone);
  for (std::uint32_t i = 0; i < bodies.size(); ++i) body_of[bodies[i].part] = i;
  // If all bodies are wound alike, it does not matter which lie in which.
  const Holders holders =
      all_alike ? Holders(bodies.size()) : find_holders(mesh, parts, body_of, bodies.size(), stop);
  const std::vector<bool> turned = turned_by(bodies, holders);

  ConeSum rest;
  double volume = 0;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    if (body_of[part] == kNone) rest += parts.sums[part];
  }
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    volume += turned[i] ? -bodies[i].volume : bodies[i].volume;
  }
  const bool turns_rest = volume + rest.volume_from_centroid() < 0;
  std::vector<bool> result(parts.size());
  for (std::size_t part = 0; part < parts.size(); ++part) {
    result[part] = body_of[part] == kNone ? turns_rest : turned[body_of[part]];
  }
  return result;
}

}  // namespace shape

TriangleMesh oriented_outward(TriangleMesh mesh, const std::stop_token& stop) {
  mesh.validate();
  const shape::Parts parts = shape::connected_parts(mesh, stop);
  const std::vector<bool> turned = shape::parts_inside_out(mesh, parts, stop);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    auto& [a, b, c] = mesh.triangles[t];
    if (turned[parts.of_triangle[t]]) std::swap(b, c);
  }
  return mesh;
}

}  // namespace qjulia

#include "qjulia/surface/figures.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/union_find.hpp"
#include "mesh/cone_sum.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia {
namespace {

constexpr int kCoarsest = 3;  // 2³ boxes along the longest side
constexpr int kFinest = 9;

/// Boxes of a cube, 2^`level` along each side, and which of them hold a point.
class Boxes {
 public:
  explicit Boxes(int level) : level_(level), held_(std::size_t{1} << 3 * level) {}

  void hold(std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    held_[(std::size_t{z} << 2 * level_) + (std::size_t{y} << level_) + x] = true;
  }
  std::size_t count() const {
    return static_cast<std::size_t>(std::count(held_.begin(), held_.end(), true));
  }
  /// Boxes twice as wide.
  Boxes coarser() const {
    Boxes wide(level_ - 1);
    const std::uint32_t mask = (1U << level_) - 1;
    for (std::size_t i = 0; i < held_.size(); ++i) {
      if (!held_[i]) continue;
      wide.hold((static_cast<std::uint32_t>(i) & mask) / 2,
                (static_cast<std::uint32_t>(i >> level_) & mask) / 2,
                static_cast<std::uint32_t>(i >> 2 * level_) / 2);
    }
    return wide;
  }

 private:
  int level_;
  std::vector<bool> held_;
};

constexpr double kEdgesPerBox = 4;
/// Points on triangles are this much closer than the boxes of a coarse mesh are wide.
constexpr double kPointsPerBox = 2;
/// Coarse meshes are counted by boxes of this part of the longest side, triangles filled in.
constexpr double kFilledBox = 1.0 / 128;

/// Calls `use` for points of a triangle, about `spacing` apart.
template <class Use>
void for_points(std::array<Eigen::Vector3d, 3> p, double spacing, const Use& use) {
  // Rows along the shortest edge: a long and thin triangle has few points.
  const auto edge = [&](std::size_t i) { return (p[(i + 1) % 3] - p[i]).norm(); };
  const auto is_shorter = [&](std::size_t i, std::size_t j) { return edge(i) < edge(j); };
  const auto shortest = static_cast<std::ptrdiff_t>(
      std::min({std::size_t{0}, std::size_t{1}, std::size_t{2}}, is_shorter));
  std::rotate(p.begin(), p.begin() + shortest, p.end());
  const Eigen::Vector3d u = p[1] - p[0], v = p[2] - p[0];
  const auto parts = [&](double length) { return std::max(1.0, std::ceil(length / spacing)); };
  const double rows = parts(std::max(v.norm(), (v - u).norm()));
  for (double j = 0; j <= rows; ++j) {
    const double left = 1 - j / rows;
    const double columns = parts(left * u.norm());
    for (double i = 0; i <= columns; ++i) {
      use((p[0] + left * i / columns * u + j / rows * v).template cast<float>());
    }
  }
}

/// The dimension of the points in `box` that `for_all` hands to its argument, by boxes of `finest`
/// and wider. An empty box has none.
template <class ForAll>
BoxDimension dimension_of(const Eigen::AlignedBox3f& box, double finest, const ForAll& for_all) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (box.isEmpty()) return {kNone, kNone, 0};
  const float side = box.sizes().maxCoeff();
  if (!std::isfinite(side)) return {kNone, kNone, 0};
  int level = kFinest;
  while (level >= kCoarsest && static_cast<double>(side) / (1 << level) < finest) --level;
  const int sizes = level - kCoarsest + 1;
  if (sizes < 3) return {kNone, kNone, std::max(0, sizes)};

  Boxes boxes(level);
  const auto most = static_cast<float>((1 << level) - 1);
  const float scale = static_cast<float>(1 << level) / side;
  for_all([&](const Eigen::Vector3f& p) {
    const Eigen::Vector3f at = (scale * (p - box.min())).cwiseMax(0.0F).cwiseMin(most);
    boxes.hold(static_cast<std::uint32_t>(at.x()), static_cast<std::uint32_t>(at.y()),
               static_cast<std::uint32_t>(at.z()));
  });
  // Least squares for ln N over ln 1/s, in units of ln 2.
  std::vector<double> counts;
  for (; level >= kCoarsest; --level) {
    counts.push_back(std::log2(static_cast<double>(boxes.count())));
    if (level > kCoarsest) boxes = boxes.coarser();
  }
  double mean = 0;
  for (const double c : counts) mean += c / sizes;
  double slope = 0;
  double spread = 0;
  const auto abscissa = [&](int i) { return 0.5 * (sizes - 1) - i; };
  for (int i = 0; i < sizes; ++i) {
    slope += abscissa(i) * counts[static_cast<std::size_t>(i)];
    spread += abscissa(i) * abscissa(i);
  }
  slope /= spread;
  double residual = 0;
  for (int i = 0; i < sizes; ++i) {
    const double r = counts[static_cast<std::size_t>(i)] - mean - slope * abscissa(i);
    residual += r * r;
  }
  return {slope, std::sqrt(residual / (sizes - 2) / spread), sizes};
}

void set_dimension(const BoxDimension& box, SurfaceFigures& figures) {
  figures.dimension = box.dimension;
  figures.dimension_error = box.error;
  figures.box_sizes = box.sizes;
}

/// What adds up over the triangles of a connected part.
struct PartSums {
  shape::ConeSum cones;  ///< whose apex is the mesh's first vertex
  double edges = 0;      ///< sum of the lengths of triangles' edges
  std::size_t triangles = 0;
  std::uint64_t boundary = 0;  ///< sum of `edge_hash`: 0 where all edges are closed up

  PartSums& operator+=(const PartSums& other) {
    cones += other.cones;
    edges += other.edges;
    triangles += other.triangles;
    boundary += other.boundary;
    return *this;
  }
  double area() const { return cones.area; }
  /// The volume enclosed. A bubble's is as large as that of the body that would fill it.
  double enclosed() const { return std::abs(cones.volume_from_centroid()); }
  bool is_open() const { return boundary != 0; }
};

/// A number for the edge from `a` to `b`; that of the edge back is its negative.
std::uint64_t edge_hash(std::uint64_t a, std::uint64_t b) {
  if (a == b) return 0;
  std::uint64_t hash = (std::min(a, b) << 32 | std::max(a, b)) * 0x9E3779B97F4A7C15U;
  hash = (hash ^ hash >> 32) * 0xD6E8FEB86659FD93U;
  hash ^= hash >> 32;
  return a < b ? hash : -hash;
}

/// The connected parts of a mesh whose triangles arrive one by one. Vertices are labelled, and the
/// labels of parts that meet are united. There are few labels where neighbouring triangles come one
/// after the other.
class ConnectedParts {
 public:
  static constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();

  void add_vertices(std::size_t count) { labels_.resize(labels_.size() + count, kNone); }

  void add(const Triangle& triangle, const PartSums& sums) {
    std::uint32_t part = kNone;
    for (const auto v : triangle) {
      if (labels_[v] == kNone) continue;
      const std::uint32_t other = united_.root(labels_[v]);
      if (part != kNone && part != other) {
        united_.unite(part, other);
        sums_[other] += std::exchange(sums_[part], {});
      }
      part = other;
    }
    if (part == kNone) {
      part = static_cast<std::uint32_t>(sums_.size());
      united_.add();
      sums_.emplace_back();
    }
    for (const auto v : triangle) labels_[v] = part;
    sums_[part] += sums;
  }

  /// The sums of each label. A label that was united with another has no triangles.
  const std::vector<PartSums>& sums() const { return sums_; }

  /// Drops those parts for whose sums `is_dropped` holds.
  template <class Predicate>
  void drop(const Predicate& is_dropped) {
    dropped_.resize(sums_.size());
    for (std::uint32_t label = 0; label < sums_.size(); ++label) {
      if (sums_[label].triangles > 0 && is_dropped(sums_[label])) dropped_[label] = true;
    }
    for (std::uint32_t label = 0; label < sums_.size(); ++label) {
      dropped_[label] = dropped_[united_.root(label)];
    }
  }
  bool is_any_dropped() const { return !dropped_.empty(); }
  bool keeps_label(std::uint32_t label) const { return dropped_.empty() || !dropped_[label]; }
  /// Whether vertex `v` has a triangle of a part that was not dropped.
  bool keeps(std::uint32_t v) const {
    return v < labels_.size() && labels_[v] != kNone && keeps_label(labels_[v]);
  }

 private:
  std::vector<std::uint32_t> labels_;  ///< one for each vertex
  base::UnionFind united_;             ///< labels
  std::vector<PartSums> sums_;         ///< by label, at the roots
  std::vector<bool> dropped_;          ///< by label; empty: none
};

}  // namespace

BoxDimension box_dimension(std::span<const Eigen::Vector3f> points, double finest) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : points) {
    if (!p.allFinite()) throw InputError("a point for the box-counting dimension is not finite");
    box.extend(p);
  }
  return dimension_of(box, finest, [&](const auto& use) { std::ranges::for_each(points, use); });
}

struct FigureSink::Impl {
  SurfaceSink* next;
  Eigen::Vector3d first;                   ///< vertex
  std::vector<Eigen::Vector3f> positions;  ///< from there: far from the origin they would be coarse
  ConnectedParts parts;
  std::vector<Triangle> waiting;  ///< for their vertices
  /// All triangles measured, or none once there are more than `most_kept`: only the dimension of a
  /// coarse mesh needs them.
  std::vector<Triangle> kept_triangles;
  std::size_t most_kept = std::size_t{1} << 20;

  explicit Impl(SurfaceSink* sink) : next(sink) {}

  std::array<Eigen::Vector3d, 3> corners(const Triangle& triangle) const {
    const auto& [a, b, c] = triangle;
    return {positions[a].cast<double>(), positions[b].cast<double>(), positions[c].cast<double>()};
  }

  /// Measures those triangles whose vertices have all come; the others wait.
  void measure(std::span<const Triangle> triangles) {
    std::vector<Triangle> incomplete;
    for (const Triangle& triangle : triangles) {
      const auto& [a, b, c] = triangle;
      if (std::ranges::max(triangle) >= positions.size()) {
        incomplete.push_back(triangle);
        continue;
      }
      const auto [p, q, r] = corners(triangle);
      parts.add(triangle, {.cones = {p, q, r},
                           .edges = (q - p).norm() + (r - q).norm() + (p - r).norm(),
                           .triangles = 1,
                           .boundary = edge_hash(a, b) + edge_hash(b, c) + edge_hash(c, a)});
      if (kept_triangles.size() < most_kept) {
        kept_triangles.push_back(triangle);
      } else if (most_kept > 0) {
        most_kept = 0;
        kept_triangles = {};
      }
    }
    waiting.insert(waiting.end(), incomplete.begin(), incomplete.end());
  }
  void expect_nothing_dropped() const {
    if (!parts.is_any_dropped()) return;
    throw InputError("parts of a mesh are dropped once, after its last triangle");
  }
};

FigureSink::FigureSink(SurfaceSink* next) : impl_(std::make_unique<Impl>(next)) {}

FigureSink::~FigureSink() = default;

void FigureSink::vertices(std::span<const Eigen::Vector3d> positions,
                          std::span<const Eigen::Vector3d> normals) {
  std::vector<Eigen::Vector3f>& all = impl_->positions;
  if (all.empty() && !positions.empty()) impl_->first = positions.front();
  const std::size_t before = all.size();
  // Positions are kept in single precision, from the first one on.
  for (const Eigen::Vector3d& x : positions) {
    if ((x - impl_->first).cast<float>().allFinite()) continue;
    throw InputError(fmt::format("the surface's vertex ({}, {}, {}) is not finite, or too far away",
                                 x.x(), x.y(), x.z()));
  }
  all.resize(before + positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    all[before + i] = (positions[i] - impl_->first).cast<float>();
  }
  impl_->parts.add_vertices(positions.size());
  impl_->measure(std::exchange(impl_->waiting, {}));
  if (impl_->next != nullptr) impl_->next->vertices(positions, normals);
}

void FigureSink::triangles(std::span<const Triangle> triangles) {
  impl_->expect_nothing_dropped();
  impl_->measure(triangles);
  if (impl_->next != nullptr) impl_->next->triangles(triangles);
}

LoosePieces FigureSink::drop_loose_pieces() {
  impl_->expect_nothing_dropped();
  constexpr double kLeast = 0.01;  // times the largest part's volume
  double largest = 0;
  double all = 0;
  for (const PartSums& part : impl_->parts.sums()) {
    largest = std::max(largest, part.enclosed());
    all += part.enclosed();
  }
  LoosePieces dropped;
  impl_->parts.drop([&](const PartSums& part) {
    // What a box has cut open has no volume to judge it by, and may be of the main body.
    const bool is_loose = !part.is_open() && part.enclosed() < kLeast * largest;
    if (is_loose) ++dropped.count;
    if (is_loose) dropped.volume += part.enclosed();
    return is_loose;
  });
  if (dropped.count > 0) dropped.share = dropped.volume / all;
  return dropped;
}

void FigureSink::drop_small_parts(double least) {
  impl_->expect_nothing_dropped();
  const auto& sums = impl_->parts.sums();
  if (sums.empty()) return;
  const auto largest = std::ranges::max_element(sums, {}, &PartSums::area);
  impl_->parts.drop([&](const PartSums& part) {
    return least >= 1 ? &part != &*largest : part.area() < least * largest->area();
  });
}

bool FigureSink::keeps(std::uint32_t vertex) const { return impl_->parts.keeps(vertex); }

TriangleMesh FigureSink::kept_of(const TriangleMesh& mesh) const {
  mesh.validate();
  TriangleMesh kept;
  std::vector<std::uint32_t> number(mesh.vertices.size());
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!keeps(v)) continue;
    number[v] = static_cast<std::uint32_t>(kept.vertices.size());
    kept.vertices.push_back(mesh.vertices[v]);
    if (!mesh.normals.empty()) kept.normals.push_back(mesh.normals[v]);
    if (!mesh.colors.empty()) kept.colors.push_back(mesh.colors[v]);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (keeps(a) && keeps(b) && keeps(c))
      kept.triangles.push_back({number[a], number[b], number[c]});
  }
  return kept;
}

SurfaceFigures FigureSink::figures() const {
  SurfaceFigures figures;
  double edges = 0;
  const ConnectedParts& parts = impl_->parts;
  for (std::uint32_t label = 0; label < parts.sums().size(); ++label) {
    const PartSums& sums = parts.sums()[label];
    if (sums.triangles == 0 || !parts.keeps_label(label)) continue;
    ++figures.components;
    figures.triangles += sums.triangles;
    figures.area += sums.area();
    figures.volume += sums.cones.volume;
    edges += sums.edges;
  }
  if (figures.triangles == 0) return figures;
  const double edge = edges / (3 * static_cast<double>(figures.triangles));
  Eigen::AlignedBox3f box;
  const auto for_vertices = [&](const auto& use) {
    for (std::uint32_t v = 0; v < impl_->positions.size(); ++v) {
      if (parts.keeps(v)) use(impl_->positions[v]);
    }
  };
  for_vertices([&](const Eigen::Vector3f& p) {
    box.extend(p);
    ++figures.vertices;
  });
  set_dimension(dimension_of(box, kEdgesPerBox * edge, for_vertices), figures);
  // A coarse mesh has no small boxes of vertices: its triangles are filled with points.
  const double finest = kFilledBox * static_cast<double>(box.sizes().maxCoeff());
  if (figures.box_sizes < 4 && finest > 0 && !impl_->kept_triangles.empty()) {
    const auto for_filled = [&](const auto& use) {
      for (const Triangle& triangle : impl_->kept_triangles) {
        if (parts.keeps(triangle[0])) {
          for_points(impl_->corners(triangle), finest / kPointsPerBox, use);
        }
      }
    };
    set_dimension(dimension_of(box, finest * 0.999, for_filled), figures);
  }
  return figures;
}

FigureSink::FigureSink(const TriangleMesh& mesh, const std::stop_token& stop) : FigureSink() {
  constexpr std::size_t kPolled = std::size_t{1} << 16;  // triangles between two polls
  mesh.validate();
  impl_->most_kept = mesh.triangles.size();
  FigureSink::vertices(mesh.vertices, {});
  const std::span<const Triangle> all = mesh.triangles;
  for (std::size_t first = 0; first < all.size(); first += kPolled) {
    throw_if_stopped(stop);
    FigureSink::triangles(all.subspan(first, std::min(kPolled, all.size() - first)));
  }
}

SurfaceFigures measure(const TriangleMesh& mesh, const std::stop_token& stop) {
  return FigureSink(mesh, stop).figures();
}

nlohmann::json to_json(const SurfaceFigures& figures) {
  return {{"area", figures.area},
          {"volume", figures.volume},
          {"area_per_volume", figures.area / figures.volume},
          {"box_dimension", figures.dimension},
          {"box_dimension_error", figures.dimension_error},
          {"box_sizes", figures.box_sizes}};
}

TriangleMesh large_components(const TriangleMesh& mesh, double least) {
  FigureSink sink(mesh);
  sink.drop_small_parts(least);
  return sink.kept_of(mesh);
}

LoosePieces drop_loose_pieces(TriangleMesh& mesh) {
  FigureSink sink(mesh);
  const LoosePieces dropped = sink.drop_loose_pieces();
  if (dropped.count > 0) mesh = sink.kept_of(mesh);
  return dropped;
}

}  // namespace qjulia

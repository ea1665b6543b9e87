#include "qjulia/figures.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/union_find.hpp"
#include "qjulia/shape.hpp"

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

/// Calls `use` for points of the triangles, about `spacing` apart, seen from the first vertex,
/// since single precision is coarse far from the origin.
template <class Use>
void for_points(const TriangleMesh& mesh, double spacing, const Use& use) {
  const Eigen::Vector3d first = mesh.vertices.front();
  for (const auto& [a, b, c] : mesh.triangles) {
    std::array<Eigen::Vector3d, 3> p{mesh.vertices[a] - first, mesh.vertices[b] - first,
                                     mesh.vertices[c] - first};
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
}

/// Of the points in `box` that `for_all` hands to its argument, by boxes of `finest` and wider.
template <class ForAll>
BoxDimension dimension_of(const Eigen::AlignedBox3f& box, double finest, const ForAll& for_all) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const float side = box.sizes().maxCoeff();
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

base::UnionFind components_of(const TriangleMesh& mesh) {
  base::UnionFind components(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    components.unite(a, b);
    components.unite(b, c);
  }
  return components;
}

/// The vertices v for which `keeps` holds, and the triangles on them.
template <class Keeps>
TriangleMesh part_of(const TriangleMesh& mesh, const Keeps& keeps) {
  TriangleMesh kept;
  std::vector<std::uint32_t> number(mesh.vertices.size());
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (!keeps(v)) continue;
    number[v] = static_cast<std::uint32_t>(kept.vertices.size());
    kept.vertices.push_back(mesh.vertices[v]);
    if (!mesh.normals.empty()) kept.normals.push_back(mesh.normals[v]);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    if (keeps(a)) kept.triangles.push_back({number[a], number[b], number[c]});
  }
  return kept;
}

/// Whether each vertex is at an open edge. Around a vertex where triangles close up, each
/// neighbour begins one edge and ends another.
std::vector<bool> open_vertices(const TriangleMesh& mesh) {
  std::vector<std::int64_t> balance(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    balance[a] += std::int64_t{c} - b;
    balance[b] += std::int64_t{a} - c;
    balance[c] += std::int64_t{b} - a;
  }
  std::vector<bool> open(balance.size());
  for (std::size_t v = 0; v < open.size(); ++v) open[v] = balance[v] != 0;
  return open;
}

}  // namespace

BoxDimension box_dimension(std::span<const Eigen::Vector3f> points, double finest) {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (points.empty()) return {kNone, kNone, 0};
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : points) box.extend(p);
  return dimension_of(box, finest, [&](const auto& use) { std::ranges::for_each(points, use); });
}

struct FigureSink::Impl {
  SurfaceSink* next;
  Eigen::Vector3d first;                   ///< vertex
  std::vector<Eigen::Vector3f> positions;  ///< from there: far from the origin they would be coarse
  base::UnionFind components;
  std::vector<Triangle> waiting;  ///< for their vertices
  double area = 0;
  double volume = 0;
  double edges = 0;  ///< sum of the lengths of triangles' edges
  std::size_t triangles = 0;

  explicit Impl(SurfaceSink* sink) : next(sink) {}

  /// Measures the triangles whose vertices have all come.
  void measure_complete() {
    const auto left = std::partition(waiting.begin(), waiting.end(), [this](const Triangle& t) {
      return std::ranges::max(t) >= positions.size();
    });
    for (auto t = left; t != waiting.end(); ++t) {
      const auto& [a, b, c] = *t;
      const Eigen::Vector3d p = positions[a].cast<double>();
      const Eigen::Vector3d u = positions[b].cast<double>() - p;
      const Eigen::Vector3d v = positions[c].cast<double>() - p;
      const Eigen::Vector3d normal = u.cross(v);
      area += 0.5 * normal.norm();
      volume += p.dot(normal) / 6;
      edges += u.norm() + v.norm() + (u - v).norm();
      ++triangles;
      components.unite(a, b);
      components.unite(b, c);
    }
    waiting.erase(left, waiting.end());
  }
};

FigureSink::FigureSink(SurfaceSink* next) : impl_(std::make_unique<Impl>(next)) {}

FigureSink::~FigureSink() = default;

void FigureSink::vertices(std::span<const Eigen::Vector3d> positions,
                          std::span<const Eigen::Vector3d> normals) {
  for (const Eigen::Vector3d& x : positions) {
    if (impl_->positions.empty()) impl_->first = x;
    impl_->components.add();
    impl_->positions.emplace_back((x - impl_->first).cast<float>());
  }
  impl_->measure_complete();
  if (impl_->next != nullptr) impl_->next->vertices(positions, normals);
}

void FigureSink::triangles(std::span<const Triangle> triangles) {
  impl_->waiting.insert(impl_->waiting.end(), triangles.begin(), triangles.end());
  impl_->measure_complete();
  if (impl_->next != nullptr) impl_->next->triangles(triangles);
}

SurfaceFigures FigureSink::figures() {
  SurfaceFigures figures;
  figures.area = impl_->area;
  figures.volume = impl_->volume;
  figures.components = impl_->components.sets();
  const double edge =
      impl_->triangles > 0 ? impl_->edges / (3 * static_cast<double>(impl_->triangles)) : 0;
  set_dimension(box_dimension(impl_->positions, kEdgesPerBox * edge), figures);
  return figures;
}

SurfaceFigures measure(const TriangleMesh& mesh) {
  FigureSink sink;
  sink.vertices(mesh.vertices, {});
  sink.triangles(mesh.triangles);
  SurfaceFigures figures = sink.figures();
  // A mesh of few triangles has no small boxes of vertices: its triangles are filled with points.
  const double finest = kFilledBox * mesh.box().size().maxCoeff();
  if (!(figures.box_sizes >= 4) && finest > 0) {
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3d& x : mesh.vertices) {
      box.extend((x - mesh.vertices.front()).cast<float>());
    }
    const auto for_all = [&](const auto& use) { for_points(mesh, finest / kPointsPerBox, use); };
    set_dimension(dimension_of(box, finest * 0.999, for_all), figures);
  }
  return figures;
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
  base::UnionFind components = components_of(mesh);
  std::vector<double> area(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Eigen::Vector3d& p = mesh.vertices[a];
    area[components.root(a)] += 0.5 * (mesh.vertices[b] - p).cross(mesh.vertices[c] - p).norm();
  }
  const auto largest = std::ranges::max_element(area);
  return part_of(mesh, [&](std::uint32_t v) {
    const std::uint32_t r = components.root(v);
    if (least >= 1) return area.begin() + r == largest;
    return area[r] >= least * *largest;
  });
}

LoosePieces drop_loose_pieces(TriangleMesh& mesh) {
  constexpr double kLeast = 0.01;  // of the largest part's volume
  LoosePieces dropped;
  if (mesh.triangles.empty()) return dropped;
  base::UnionFind components = components_of(mesh);
  std::vector<double> volume(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    // From a vertex of the part: far from the origin, volumes would cancel.
    const std::uint32_t r = components.root(a);
    const Eigen::Vector3d& apex = mesh.vertices[r];
    const Eigen::Vector3d p = mesh.vertices[a] - apex;
    const Eigen::Vector3d q = mesh.vertices[b] - apex;
    volume[r] += p.dot(q.cross(mesh.vertices[c] - apex)) / 6;
  }
  // Those of bubbles are negative.
  for (double& v : volume) v = std::abs(v);
  const double least = kLeast * *std::ranges::max_element(volume);
  // What a box has cut open has no volume to judge it by, and may be of the main body.
  const std::vector<bool> open = open_vertices(mesh);
  std::vector<bool> is_cut(mesh.vertices.size());
  for (std::uint32_t v = 0; v < open.size(); ++v) {
    if (open[v]) is_cut[components.root(v)] = true;
  }
  const auto keeps = [&](std::uint32_t v) {
    const std::uint32_t r = components.root(v);
    return is_cut[r] || volume[r] >= least;
  };
  double all = 0;
  for (std::uint32_t v = 0; v < mesh.vertices.size(); ++v) {
    if (components.root(v) != v) continue;
    all += volume[v];
    if (keeps(v)) continue;
    ++dropped.count;
    dropped.volume += volume[v];
  }
  if (dropped.count > 0) dropped.share = dropped.volume / all;
  if (dropped.count > 0) mesh = part_of(mesh, keeps);
  return dropped;
}

WallThickness wall_thickness(const Device& device, const TriangleMesh& mesh) {
  constexpr std::size_t kSamples = 4000;
  constexpr std::uint64_t kWallSeed = 1;
  constexpr int kHalvings = 14;
  // A ball that touches at the sample alone has its centre this close to its radius inside; the
  // rest is for the edges between flat triangles.
  constexpr double kTouch = 0.9;
  const SignedDistance distance(device, mesh);
  const auto samples = sample_surface(mesh, kSamples, kWallSeed);
  std::vector<double> low(samples.size(), 0);
  std::vector<double> high(samples.size(), 0.5 * mesh.box().diagonal());
  std::vector<Eigen::Vector3d> centers(samples.size());
  for (int step = 0; step < kHalvings; ++step) {
    for (std::size_t i = 0; i < samples.size(); ++i) {
      centers[i] = samples[i].position - 0.5 * (low[i] + high[i]) * samples[i].normal;
    }
    const auto found = distance.at(centers);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const double radius = 0.5 * (low[i] + high[i]);
      (found[i] < -kTouch * radius ? low : high)[i] = radius;
    }
  }
  std::ranges::sort(high);
  const auto at = [&](double part) {
    return 2 * high[static_cast<std::size_t>(part * static_cast<double>(high.size() - 1))];
  };
  return {at(0.01), at(0.1), at(0.5)};
}

}  // namespace qjulia

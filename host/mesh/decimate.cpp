#include "qjulia/mesh/decimate.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <OpenMesh/Core/Utils/Property.hh>
#include <OpenMesh/Tools/Decimater/ModAspectRatioT.hh>
#include <OpenMesh/Tools/Decimater/ModBaseT.hh>
#include <OpenMesh/Tools/Decimater/ModHausdorffT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/range_check.hpp"
#include "mesh/decimate_blocks.hpp"
#include "mesh/half_edge_mesh.hpp"
#include "mesh/triangle_tree.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/progress.hpp"

namespace qjulia {
namespace {

using shape::Collapser;
using shape::HalfEdgeMesh;

constexpr std::size_t kCollapsesPolled = 1024;
constexpr std::size_t kFewestLeft = 4;
/// Larger meshes are first decimated in blocks of at most this many triangles, down to this
/// multiple of the requested number.
constexpr std::size_t kMostInABlock = std::size_t{1} << 21;
constexpr std::size_t kLeftToChoose = 3;
/// Degrees by which a collapse may turn a triangle if an error is given: a triangle that turns
/// farther leaves the surface between its corners.
constexpr float kMostTurned = 30;
/// The longest edge of a triangle over its height that a collapse may leave: files have single
/// precision, in which thinner ones may have no area.
constexpr float kMostSlender = 1000;
constexpr double kMeasureSlack = 0.02;
/// The share of the error within which OpenMesh keeps vertices: between vertices, surfaces lie
/// farther apart.
constexpr double kVertexShare = 0.7;
/// Parts of a triangle's edges, at whose ends distances are measured. With two parts and the
/// triangle's middle, two points in ten thousand lay beyond the error, by up to 1.4 times; with six
/// parts, one in a hundred thousand, by up to 1.15 times. A decimation takes twice as long for it.
constexpr int kEdgeParts = 6;
/// Number of decimations with an error; four are usual.
constexpr int kMostDecimations = 12;

/// Colours of the vertices that went into one.
struct ColorSum {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 1;

  VertexColor mean() const {
    VertexColor mean;
    for (std::size_t c = 0; c < mean.size(); ++c) {
      mean[c] = static_cast<std::uint8_t>(std::lround(sum[static_cast<Eigen::Index>(c)] / count));
    }
    return mean;
  }
};
using ColorProperty = OpenMesh::VPropHandleT<ColorSum>;

/// Adds a vertex's colours to those of the vertex that it collapses into.
template <class Mesh>
class ColorAdder : public OpenMesh::Decimater::ModBaseT<Mesh> {
 public:
  using Base = OpenMesh::Decimater::ModBaseT<Mesh>;
  using Handle = OpenMesh::Decimater::ModHandleT<ColorAdder>;
  explicit ColorAdder(Mesh& mesh) : Base(mesh, true) {}

  void add_to(const ColorProperty& sums) { sums_ = sums; }
  void postprocess_collapse(const typename Base::CollapseInfo& collapse) override {
    ColorSum& kept = Base::mesh().property(sums_, collapse.v1);
    const ColorSum& gone = Base::mesh().property(sums_, collapse.v0);
    kept.sum += gone.sum;
    kept.count += gone.count;
  }

 private:
  ColorProperty sums_;
};

/// Notes into which vertex each one collapses.
template <class Mesh>
class CollapseNotes : public OpenMesh::Decimater::ModBaseT<Mesh> {
 public:
  using Base = OpenMesh::Decimater::ModBaseT<Mesh>;
  using Handle = OpenMesh::Decimater::ModHandleT<CollapseNotes>;
  explicit CollapseNotes(Mesh& mesh) : Base(mesh, true) {}

  void note_in(std::vector<std::uint32_t>& into) { into_ = &into; }
  void postprocess_collapse(const typename Base::CollapseInfo& collapse) override {
    (*into_)[static_cast<std::size_t>(collapse.v0.idx())] =
        static_cast<std::uint32_t>(collapse.v1.idx());
  }

 private:
  std::vector<std::uint32_t>* into_ = nullptr;
};

/// The colours of `mesh` as a property of its half-edge mesh.
ColorProperty add_colors(const TriangleMesh& mesh, HalfEdgeMesh& half_edges) {
  ColorProperty sums;
  half_edges.add_property(sums);
  for (std::size_t v = 0; v < mesh.colors.size(); ++v) {
    const auto& [red, green, blue] = mesh.colors[v];
    half_edges.property(sums, OpenMesh::VertexHandle(static_cast<int>(v))).sum = {
        double(red), double(green), double(blue)};
  }
  return sums;
}

HalfEdgeMesh half_edges_of(const TriangleMesh& mesh, const std::stop_token& stop) {
  HalfEdgeMesh result;
  result.reserve(mesh.vertices.size(), 3 * mesh.triangles.size() / 2, mesh.triangles.size());
  for (const Eigen::Vector3d& x : mesh.vertices) result.add_vertex({x.x(), x.y(), x.z()});
  // It reports what it refuses on a standard stream; a library must not.
  static std::once_flag is_silent;
  std::call_once(is_silent, [] { omerr().disable(); });
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % kCollapsesPolled == 0) throw_if_stopped(stop);
    const auto& [a, b, c] = mesh.triangles[t];
    if (a == b || b == c || c == a) {
      throw InputError(
          fmt::format("triangle {} has a vertex twice: only a manifold mesh can be decimated", t));
    }
    const auto corner = [&](std::size_t i) {
      return OpenMesh::VertexHandle(static_cast<int>(mesh.triangles[t][i]));
    };
    if (result.add_face(corner(0), corner(1), corner(2)).is_valid()) continue;
    throw InputError(
        fmt::format("triangle {} shares an edge with more than one other, or is wound against it: "
                    "only a manifold mesh can be decimated",
                    t));
  }
  return result;
}

/// Area-weighted means of the triangles around each vertex, of length 1.
std::vector<Eigen::Vector3f> normals_of(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> sums(mesh.vertices.size(), Eigen::Vector3d::Zero());
  for (const Triangle& triangle : mesh.triangles) {
    const Eigen::Vector3d& x = mesh.vertices[triangle[0]];
    const Eigen::Vector3d area =
        (mesh.vertices[triangle[1]] - x).cross(mesh.vertices[triangle[2]] - x);
    for (const std::uint32_t corner : triangle) sums[corner] += area;
  }
  std::vector<Eigen::Vector3f> normals;
  normals.reserve(sums.size());
  for (const Eigen::Vector3d& sum : sums) normals.emplace_back(sum.normalized().cast<float>());
  return normals;
}

/// The faces that are left, and the vertices that they have. Those before the first one that was
/// collapsed keep their numbers.
TriangleMesh collected(HalfEdgeMesh& mesh) {
  mesh.garbage_collection();
  TriangleMesh result;
  result.vertices.reserve(mesh.n_vertices());
  for (const auto vertex : mesh.vertices()) {
    const OpenMesh::Vec3d& x = mesh.point(vertex);
    result.vertices.emplace_back(x[0], x[1], x[2]);
  }
  result.triangles.reserve(mesh.n_faces());
  for (const auto face : mesh.faces()) {
    Triangle corners{};
    std::size_t i = 0;
    for (const auto vertex : mesh.fv_range(face)) {
      corners[i++] = static_cast<std::uint32_t>(vertex.idx());
    }
    result.triangles.push_back(corners);
  }
  return result;
}

/// Prevents collapses into vertices of a seam: two blocks could otherwise make the same edge
/// between two vertices of their seam.
template <class Mesh>
class SeamKeeper : public OpenMesh::Decimater::ModBaseT<Mesh> {
 public:
  using Base = OpenMesh::Decimater::ModBaseT<Mesh>;
  using Handle = OpenMesh::Decimater::ModHandleT<SeamKeeper>;
  explicit SeamKeeper(Mesh& mesh) : Base(mesh, true) {}

  void keep(const std::vector<bool>& seam) { seam_ = &seam; }
  float collapse_priority(const typename Base::CollapseInfo& collapse) override {
    return (*seam_)[static_cast<std::size_t>(collapse.v1.idx())] ? float{Base::ILLEGAL_COLLAPSE}
                                                                 : float{Base::LEGAL_COLLAPSE};
  }

 private:
  const std::vector<bool>* seam_ = nullptr;
};

/// Vertices that a decimation leaves where they are; each list is empty or has all vertices.
struct FixedVertices {
  std::vector<bool> seam;  ///< shared with another block: nothing collapses into these either
  std::vector<bool> held;
};

/// What became of a mesh, and of its vertices.
struct Collapsed {
  TriangleMesh mesh;
  std::vector<std::uint32_t> kept;  ///< for each vertex of the result: its number before
  std::vector<std::uint32_t> into;  ///< for each vertex before: itself if it was kept, else the one
                                    ///< into which it went, which may have gone into another
};

Collapsed decimated_at_once(TriangleMesh mesh, const DecimateOptions& options,
                            const FixedVertices& fixed, const std::stop_token& stop) {
  HalfEdgeMesh half_edges = half_edges_of(mesh, stop);
  OpenMesh::VPropHandleT<std::uint32_t> numbers;
  half_edges.add_property(numbers);
  Collapsed found;
  found.into.resize(mesh.vertices.size());
  std::iota(found.into.begin(), found.into.end(), 0U);
  for (const auto vertex : half_edges.vertices()) {
    half_edges.property(numbers, vertex) = static_cast<std::uint32_t>(vertex.idx());
  }
  const bool has_normals = !mesh.normals.empty();
  std::optional<ColorProperty> colors;
  if (!mesh.colors.empty()) colors = add_colors(mesh, half_edges);
  mesh = {};
  half_edges.request_face_normals();  // what flipping is judged by
  half_edges.update_face_normals();

  Collapser decimater(half_edges);
  OpenMesh::Decimater::ModNormalFlippingT<HalfEdgeMesh>::Handle folds;
  decimater.add(folds);
  OpenMesh::Decimater::ModAspectRatioT<HalfEdgeMesh>::Handle slivers;
  decimater.add(slivers);
  decimater.module(slivers).set_aspect_ratio(kMostSlender);
  OpenMesh::Decimater::ModHausdorffT<HalfEdgeMesh>::Handle bound;
  if (options.error) {
    decimater.module(folds).set_max_normal_deviation(kMostTurned);
    decimater.add(bound);
    decimater.module(bound).set_tolerance(*options.error);
  }
  SeamKeeper<HalfEdgeMesh>::Handle keeper;
  if (!fixed.seam.empty()) {
    decimater.add(keeper);
    decimater.module(keeper).keep(fixed.seam);
  }
  for (const std::vector<bool>* locked : {&fixed.seam, &fixed.held}) {
    for (std::size_t v = 0; v < locked->size(); ++v) {
      if ((*locked)[v])
        half_edges.status(OpenMesh::VertexHandle(static_cast<int>(v))).set_locked(true);
    }
  }
  CollapseNotes<HalfEdgeMesh>::Handle notes;
  decimater.add(notes);
  decimater.module(notes).note_in(found.into);
  ColorAdder<HalfEdgeMesh>::Handle adder;
  if (colors) {
    decimater.add(adder);
    decimater.module(adder).add_to(*colors);
  }
  decimater.collapse_to(options.most.value_or(0), stop);

  found.mesh = collected(half_edges);
  if (has_normals) found.mesh.normals = normals_of(found.mesh);
  for (const auto vertex : half_edges.vertices()) {
    found.kept.push_back(half_edges.property(numbers, vertex));
    if (colors) found.mesh.colors.push_back(half_edges.property(*colors, vertex).mean());
  }
  return found;
}

/// How far points of a mesh's triangles are from another surface.
struct PointDistances {
  double farthest = 0;
  std::vector<std::size_t> too_far;  ///< the triangles that have a point beyond the limit
};

/// Measures at the points that divide each triangle's edges into equal parts, and at those between
/// them in the same lattice; not at corners, which collapses have kept near.
PointDistances point_distances(const TriangleMesh& mesh, const shape::TriangleTree& surface,
                               double limit, const std::stop_token& stop) {
  PointDistances found;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (t % kCollapsesPolled == 0) throw_if_stopped(stop);
    const auto& [a, b, c] = mesh.triangles[t];
    const auto& x = mesh.vertices;
    double distance = 0;
    for (int i = 0; i < kEdgeParts && distance <= limit; ++i) {
      for (int j = 0; j <= kEdgeParts - i && j < kEdgeParts; ++j) {
        const int k = kEdgeParts - i - j;
        if (k == kEdgeParts) continue;
        const Eigen::Vector3d point = (i * x[a] + j * x[b] + k * x[c]) / kEdgeParts;
        distance = std::max(distance, surface.nearest(point, kMeasureSlack).distance);
      }
    }
    if (distance > limit) found.too_far.push_back(t);
    found.farthest = std::max(found.farthest, distance);
  }
  return found;
}

/// Holds the corners of a mesh's triangles.
void hold_corners(const TriangleMesh& mesh, const std::vector<std::size_t>& triangles,
                  std::vector<bool>& held) {
  for (const std::size_t t : triangles) {
    for (const std::uint32_t v : mesh.triangles[t]) held[v] = true;
  }
}

/// Holds all vertices that went into the corners of the result's triangles.
void hold_collapsed(Collapsed& result, const std::vector<std::size_t>& triangles,
                    std::vector<bool>& held) {
  std::vector<bool> is_wrong(held.size());
  for (const std::size_t t : triangles) {
    for (const std::uint32_t v : result.mesh.triangles[t]) is_wrong[result.kept[v]] = true;
  }
  for (std::size_t v = 0; v < held.size(); ++v) {
    std::uint32_t last = result.into[v];
    while (result.into[last] != last) last = result.into[last];
    result.into[v] = last;
    if (is_wrong[last]) held[v] = true;
  }
}

/// A decimated mesh, and the farthest measured distance from the one before; 0 if no error is
/// given.
struct Measured {
  TriangleMesh mesh;
  double farthest = 0;
};

/// Decimates, and measures from points of the triangles, of the mesh and of the result, to the
/// other surface. Where that distance exceeds the error, the vertices are held
/// fixed, and the mesh is decimated again. Where vertices are held, the surface does not change, so
/// this ends; few vertices are held if the surface is smooth, and many if it is as rough as the
/// error.
Measured decimated_within_error(TriangleMesh mesh, DecimateOptions options, FixedVertices fixed,
                                const std::stop_token& stop) {
  const double error = *options.error;
  const shape::TriangleTree before(mesh, stop);
  options.error = kVertexShare * error;
  fixed.held.resize(mesh.vertices.size());
  for (int i = 0; i < kMostDecimations; ++i) {
    Collapsed result = decimated_at_once(mesh, options, fixed, stop);
    const PointDistances back = point_distances(result.mesh, before, error, stop);
    const PointDistances there =
        point_distances(mesh, shape::TriangleTree(result.mesh, stop), error, stop);
    if (back.too_far.empty() && there.too_far.empty()) {
      return {std::move(result.mesh), std::max(back.farthest, there.farthest)};
    }
    hold_collapsed(result, back.too_far, fixed.held);
    hold_corners(mesh, there.too_far, fixed.held);
  }
  return {std::move(mesh), 0};
}

Measured decimated_as_asked(TriangleMesh mesh, const DecimateOptions& options, FixedVertices fixed,
                            const std::stop_token& stop) {
  if (options.error) {
    return decimated_within_error(std::move(mesh), options, std::move(fixed), stop);
  }
  return {decimated_at_once(std::move(mesh), options, fixed, stop).mesh, 0};
}

/// Divides the triangles into blocks of equal size, side by side along the longest side.
std::vector<std::vector<Triangle>> blocks_of(const TriangleMesh& mesh, std::size_t most) {
  Eigen::Index axis = 0;
  mesh.box().size().maxCoeff(&axis);
  std::vector<std::uint32_t> order(mesh.triangles.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto place = [&](std::uint32_t t) {
    const auto& [a, b, c] = mesh.triangles[t];
    return mesh.vertices[a][axis] + mesh.vertices[b][axis] + mesh.vertices[c][axis];
  };
  const std::size_t count = (order.size() + most - 1) / most;
  std::vector<std::vector<Triangle>> blocks(count);
  auto begin = order.begin();
  for (std::size_t block = 0; block < count; ++block) {
    const auto end =
        order.begin() + static_cast<std::ptrdiff_t>((block + 1) * order.size() / count);
    if (end != order.end()) std::ranges::nth_element(begin, end, order.end(), {}, place);
    for (auto t = begin; t != end; ++t) blocks[block].push_back(mesh.triangles[*t]);
    begin = end;
  }
  return blocks;
}

/// Which vertices have triangles of more than one block.
std::vector<bool> seam_of(std::size_t vertices, const std::vector<std::vector<Triangle>>& blocks) {
  constexpr auto kNone = std::numeric_limits<std::uint16_t>::max();
  std::vector<std::uint16_t> owner(vertices, kNone);
  std::vector<bool> seam(vertices);
  for (std::size_t block = 0; block < blocks.size(); ++block) {
    const auto own = static_cast<std::uint16_t>(block);
    for (const Triangle& triangle : blocks[block]) {
      for (const std::uint32_t v : triangle) {
        if (owner[v] == kNone) owner[v] = own;
        if (owner[v] != own) seam[v] = true;
      }
    }
  }
  return seam;
}

constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

/// A part of a mesh; vertices of the seam come first, in the order of their numbers.
struct MeshBlock {
  TriangleMesh mesh;
  std::vector<std::uint32_t> seam;  ///< their numbers in the whole mesh
};

/// @param numbers scratch: as many as the whole mesh has vertices, all kNoVertex; so again after.
MeshBlock block_of(const TriangleMesh& whole, std::span<const Triangle> triangles,
                   const std::vector<bool>& seam, std::vector<std::uint32_t>& numbers) {
  MeshBlock block;
  std::vector<std::uint32_t> inner;
  for (const Triangle& triangle : triangles) {
    for (const std::uint32_t v : triangle) {
      if (numbers[v] != kNoVertex) continue;
      numbers[v] = 0;
      (seam[v] ? block.seam : inner).push_back(v);
    }
  }
  std::ranges::sort(block.seam);
  std::ranges::sort(inner);
  std::vector<std::uint32_t> all = block.seam;
  all.insert(all.end(), inner.begin(), inner.end());
  for (const std::uint32_t v : all) {
    numbers[v] = static_cast<std::uint32_t>(block.mesh.vertices.size());
    block.mesh.vertices.push_back(whole.vertices[v]);
    if (!whole.colors.empty()) block.mesh.colors.push_back(whole.colors[v]);
  }
  block.mesh.triangles.reserve(triangles.size());
  for (const auto& [a, b, c] : triangles) {
    block.mesh.triangles.push_back({numbers[a], numbers[b], numbers[c]});
  }
  for (const std::uint32_t v : all) numbers[v] = kNoVertex;
  return block;
}

}  // namespace

TriangleMesh shape::decimated_in_blocks(TriangleMesh mesh, const DecimateOptions& options,
                                        std::size_t most_in_a_block, const std::stop_token& stop) {
  std::vector<std::vector<Triangle>> blocks = blocks_of(mesh, most_in_a_block);
  const std::size_t before = std::exchange(mesh.triangles, {}).size();
  const bool has_normals = !std::exchange(mesh.normals, {}).empty();
  const std::vector<bool> seam = seam_of(mesh.vertices.size(), blocks);
  std::vector<std::uint32_t> numbers(mesh.vertices.size(), kNoVertex);
  std::vector<std::uint32_t> joined(mesh.vertices.size(), kNoVertex);  // seam's, in the result
  TriangleMesh result;
  for (std::vector<Triangle>& triangles : blocks) {
    MeshBlock block = block_of(mesh, triangles, seam, numbers);
    const std::size_t fixed = block.seam.size();
    FixedVertices locked{std::vector<bool>(block.mesh.vertices.size()), {}};
    std::fill_n(locked.seam.begin(), fixed, true);
    DecimateOptions share = options;
    if (options.most) {
      const double part = static_cast<double>(triangles.size()) / static_cast<double>(before);
      share.most = std::max(kFewestLeft,
                            static_cast<std::size_t>(part * static_cast<double>(*options.most)));
    }
    std::vector<Triangle>().swap(triangles);
    const TriangleMesh part =
        decimated_as_asked(std::move(block.mesh), share, std::move(locked), stop).mesh;
    // The seam's are never collapsed and come first, so that they keep their numbers.
    std::vector<std::uint32_t> places(part.vertices.size());
    for (std::size_t v = 0; v < places.size(); ++v) {
      std::uint32_t fresh = kNoVertex;
      std::uint32_t& place = v < fixed ? joined[block.seam[v]] : fresh;
      if (place == kNoVertex) {
        place = static_cast<std::uint32_t>(result.vertices.size());
        result.vertices.push_back(part.vertices[v]);
        if (!part.colors.empty()) result.colors.push_back(part.colors[v]);
      }
      places[v] = place;
    }
    for (const auto& [a, b, c] : part.triangles) {
      result.triangles.push_back({places[a], places[b], places[c]});
    }
  }
  if (has_normals) result.normals = normals_of(result);
  return result;
}

void DecimateOptions::validate() const {
  if (!most && !error) throw OptionError("most", "give it, or an error, or both");
  if (most && *most < kFewestLeft) {
    throw OptionError("most", fmt::format("{} triangles close no surface; give 4 or more", *most));
  }
  if (error) base::expect_positive("error", *error);
}

Decimation decimate(TriangleMesh mesh, const DecimateOptions& options,
                    const std::stop_token& stop) {
  mesh.validate();
  options.validate();
  DecimationReport report{.before = mesh.triangles.size()};
  const std::size_t most = options.most.value_or(0);
  DecimateOptions left = options;
  if (mesh.triangles.size() > kMostInABlock && most < mesh.triangles.size() / kLeftToChoose) {
    if (left.error) *left.error /= 2;
    DecimateOptions first = left;
    if (first.most) *first.most *= kLeftToChoose;
    mesh = shape::decimated_in_blocks(std::move(mesh), first, kMostInABlock, stop);
    report.farthest = left.error.value_or(0);
  }
  if (mesh.triangles.size() > most) {
    Measured found = decimated_as_asked(std::move(mesh), left, {}, stop);
    mesh = std::move(found.mesh);
    report.farthest += found.farthest;
  }
  report.after = mesh.triangles.size();
  if (report.before <= most) {
    report.end = DecimationEnd::none;
  } else if (report.after <= most) {
    report.end = DecimationEnd::number;
  } else {
    report.end = options.error ? DecimationEnd::error : DecimationEnd::folds;
  }
  return {std::move(mesh), report};
}

TriangleMesh decimated(TriangleMesh mesh, const DecimateOptions& options,
                       const std::stop_token& stop) {
  return decimate(std::move(mesh), options, stop).mesh;
}

TriangleMesh decimated(TriangleMesh mesh, std::size_t most, const std::stop_token& stop) {
  return decimated(std::move(mesh), DecimateOptions{most, std::nullopt}, stop);
}

}  // namespace qjulia

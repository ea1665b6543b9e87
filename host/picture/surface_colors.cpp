#include "qjulia/picture/surface_colors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "picture/point_traits.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {

using namespace picture;
namespace {

/// Pixels of the set's diagonal in the picture that the colours of a mesh are compared with.
constexpr double kPixels = 600;

/// Vertices whose numbers are found between two reports of progress.
constexpr std::size_t kVerticesAtOnce = std::size_t{1} << 18;

/// The mean length of the edges about each vertex, map units: what it stands for. 0 without any.
std::vector<double> widths_of(const TriangleMesh& mesh, const ShapeToMap& to_map) {
  std::vector<double> sums(mesh.vertices.size()), counts(mesh.vertices.size());
  for (const auto& corners : mesh.triangles) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const std::uint32_t a = corners[i], b = corners[(i + 1) % corners.size()];
      const double length = to_map.scale * (mesh.vertices[b] - mesh.vertices[a]).norm();
      for (const std::uint32_t v : {a, b}) {
        sums[v] += length;
        counts[v] += 1;
      }
    }
  }
  for (std::size_t v = 0; v < sums.size(); ++v) sums[v] /= std::max(1.0, counts[v]);
  return sums;
}

/// What the material shows at each vertex, for balls of these diameters, map units.
std::vector<float> vertex_traits(const PointTraits& traits_at, const TriangleMesh& mesh,
                                 const std::vector<double>& widths,
                                 const ProgressMonitor& monitor) {
  std::vector<float> traits;
  for (std::size_t first = 0; first < widths.size(); first += kVerticesAtOnce) {
    const std::size_t count = std::min(kVerticesAtOnce, widths.size() - first);
    monitor.report({"colouring the surface",
                    static_cast<double>(first) / static_cast<double>(widths.size()), -1, ""});
    const std::vector<float> found = traits_at(std::span(mesh.vertices).subspan(first, count),
                                               std::span(widths).subspan(first, count));
    traits.insert(traits.end(), found.begin(), found.end());
  }
  return traits;
}

/// A few of the mesh's triangles, evenly over their numbers, with vertices of their own.
TriangleMesh sample_of(const TriangleMesh& mesh) {
  constexpr std::size_t kMost = 8192;
  const std::size_t all = mesh.triangles.size(), count = std::min(kMost, all);
  TriangleMesh sample;
  for (std::size_t i = 0; i < count; ++i) {
    const auto first = static_cast<std::uint32_t>(sample.vertices.size());
    for (const std::uint32_t v : mesh.triangles[i * all / count]) {
      sample.vertices.push_back(mesh.vertices[v]);
    }
    sample.triangles.push_back({first, first + 1, first + 2});
  }
  return sample;
}

/// The share of the edges whose ends' colours differ by more than a quarter of 255.
double abrupt_share_of(const TriangleMesh& mesh, const std::vector<VertexColor>& colors) {
  constexpr int kAbrupt = 64;
  std::size_t abrupt = 0;
  for (const Triangle& corners : mesh.triangles) {
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const VertexColor& a = colors[corners[i]];
      const VertexColor& b = colors[corners[(i + 1) % corners.size()]];
      int most = 0;
      for (std::size_t c = 0; c < a.size(); ++c) most = std::max(most, std::abs(a[c] - b[c]));
      if (most > kAbrupt) ++abrupt;
    }
  }
  return static_cast<double>(abrupt) /
         static_cast<double>(std::max<std::size_t>(1, 3 * mesh.triangles.size()));
}

}  // namespace

void SurfaceColorOptions::validate() const {
  if (material == Material::clay) {
    throw OptionError("material", "clay has one colour everywhere; give another material");
  }
  PictureOptions shared;
  shared.iterations = iterations;
  shared.palette = palette;
  shared.range = range;
  shared.validate();
}

SurfaceColors surface_colors(const Device& device, const Map& map, const TriangleMesh& mesh,
                             const SurfaceColorOptions& options, const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  mesh.validate();
  SurfaceColors found;
  if (mesh.vertices.empty()) return found;
  const TraceStage stage(monitor.trace, "colour the surface");
  const PointTraits traits_at(device, map, options, monitor.stop);
  const ShapeToMap& to_map = map.frame.shape_to_map;
  const std::vector<float> traits =
      vertex_traits(traits_at, mesh, widths_of(mesh, to_map), monitor);
  found.range = options.range ? *options.range : range_over(traits, options.material);
  const auto colors_of = [&](const std::vector<float>& values) {
    std::vector<VertexColor> colors;
    colors.reserve(values.size());
    for (const float value : values) {
      colors.push_back(vertex_color(options.palette, found.range, value));
    }
    return colors;
  };
  found.colors = colors_of(traits);
  // What a vertex stands for averages a pattern that is finer.
  const TriangleMesh sample = sample_of(mesh);
  const double pixel = to_map.scale * mesh.box().diagonal() / kPixels;
  const std::vector<double> widths(sample.vertices.size(), pixel);
  found.abrupt_share =
      abrupt_share_of(sample, colors_of(vertex_traits(traits_at, sample, widths, monitor)));
  return found;
}

}  // namespace qjulia

#include "qjulia/picture/surface_colors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "base/srgb.hpp"
#include "map/device_map.hpp"
#include "picture/material_traits.hpp"
#include "picture/orbit_traits.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
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
std::vector<float> vertex_traits(const OrbitsTell& orbits, const Coloring& coloring,
                                 const TriangleMesh& mesh, const std::vector<double>& widths,
                                 const ProgressMonitor& monitor) {
  std::vector<float> traits;
  for (std::size_t first = 0; first < widths.size(); first += kVerticesAtOnce) {
    const std::size_t count = std::min(kVerticesAtOnce, widths.size() - first);
    monitor.report({"colouring the surface",
                    static_cast<double>(first) / static_cast<double>(widths.size()), -1, ""});
    std::vector<Eigen::Vector3d> points;
    for (std::size_t v = first; v < first + count; ++v) {
      points.push_back(coloring.to_scene.to_map(mesh.vertices[v]));
    }
    const std::vector<float> found =
        material_traits(orbits, coloring, points, std::span(widths).subspan(first, count));
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

VertexColor vertex_color(const Palette& palette, double share) {
  const Rgb color = color_at(palette, share);
  VertexColor bytes;
  for (std::size_t c = 0; c < bytes.size(); ++c) {
    bytes[c] = base::byte_of(base::srgb_encoded(color[static_cast<Eigen::Index>(c)]));
  }
  return bytes;
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
  const Coloring coloring{options.material, direction(map.frame.up.value_or(kDefaultUp)),
                          map.frame.shape_to_map};
  const map::DeviceMap device_map(
      device, map, find_stop_radii(device, map, options.escape, monitor.stop), options.precision);
  const OrbitsTell orbits = [&](const auto& points, auto widths) {
    return orbit_traits(device_map, points, widths, options.iterations, options.material,
                        monitor.stop);
  };
  const std::vector<float> traits =
      vertex_traits(orbits, coloring, mesh, widths_of(mesh, coloring.to_scene), monitor);
  found.range = options.range ? *options.range : range_over(traits, options.material);
  const auto colors_of = [&](const std::vector<float>& values) {
    std::vector<VertexColor> colors;
    colors.reserve(values.size());
    for (const float value : values) {
      colors.push_back(vertex_color(options.palette, share_of(found.range, double{value})));
    }
    return colors;
  };
  found.colors = colors_of(traits);
  // What a vertex stands for averages a pattern that is finer.
  const TriangleMesh sample = sample_of(mesh);
  const double pixel = coloring.to_scene.scale * mesh.box().diagonal() / kPixels;
  const std::vector<double> widths(sample.vertices.size(), pixel);
  found.abrupt_share =
      abrupt_share_of(sample, colors_of(vertex_traits(orbits, coloring, sample, widths, monitor)));
  return found;
}

}  // namespace qjulia

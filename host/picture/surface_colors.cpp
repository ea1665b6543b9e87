#include "qjulia/surface_colors.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/srgb.hpp"
#include "picture/orbit_traits.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"

namespace qjulia {
namespace {

/// How far behind a triangle its points lie, over the mesh's mean edge.
constexpr double kBehind = 0.25;
/// A point of a triangle stands for the third of its area about a corner. These are the weights of
/// that corner and of each of the two others.
constexpr double kOwnWeight = 2.0 / 3, kOtherWeight = 1.0 / 6;
/// Shares of the vertices below the palette's beginning and above its end.
constexpr double kTail = 0.02;
/// Triangles whose points are on the device at a time.
constexpr std::size_t kTrianglesAtOnce = std::size_t{1} << 17;

double mean_edge(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto& x = mesh.vertices;
    sum += (x[b] - x[a]).norm() + (x[c] - x[b]).norm() + (x[a] - x[c]).norm();
  }
  return sum / (3 * static_cast<double>(std::max<std::size_t>(1, mesh.triangles.size())));
}

/// Triangles `first` … `last` − 1: three points `behind` each of them, map units.
std::vector<Eigen::Vector3d> points_behind(const TriangleMesh& mesh, std::size_t first,
                                           std::size_t last, double behind,
                                           const ShapeToMap& to_map) {
  std::vector<Eigen::Vector3d> points;
  points.reserve(3 * (last - first));
  for (std::size_t t = first; t < last; ++t) {
    std::array<Eigen::Vector3d, 3> x;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = mesh.vertices[mesh.triangles[t][i]];
    const Eigen::Vector3d inward = -behind * (x[1] - x[0]).cross(x[2] - x[0]).normalized();
    const Eigen::Vector3d sum = x[0] + x[1] + x[2];
    for (const Eigen::Vector3d& corner : x) {
      points.push_back(
          to_map.to_map(kOtherWeight * sum + (kOwnWeight - kOtherWeight) * corner + inward));
    }
  }
  return points;
}

/// What the material shows at each vertex.
std::vector<float> vertex_traits(const map::DeviceMap& device_map, const ShapeToMap& to_map,
                                 const TriangleMesh& mesh, const SurfaceColorOptions& options,
                                 const ProgressMonitor& monitor) {
  const double edge = mean_edge(mesh);
  std::vector<double> sums(mesh.vertices.size()), weights(mesh.vertices.size());
  for (std::size_t first = 0; first < mesh.triangles.size(); first += kTrianglesAtOnce) {
    const std::size_t last = std::min(first + kTrianglesAtOnce, mesh.triangles.size());
    monitor.report({"colouring the surface",
                    static_cast<double>(first) / static_cast<double>(mesh.triangles.size()), -1,
                    ""});
    const std::vector<float> traits =
        picture::orbit_traits(device_map, points_behind(mesh, first, last, kBehind * edge, to_map),
                              options.iterations, options.material, monitor.stop);
    for (std::size_t t = first; t < last; ++t) {
      const auto at = traits.begin() + static_cast<std::ptrdiff_t>(3 * (t - first));
      const double mean = (double{at[0]} + double{at[1]} + double{at[2]}) / 3;
      const auto& [a, b, c] = mesh.triangles[t];
      const auto& x = mesh.vertices;
      // A triangle without area counts a little, for vertices that have no other.
      const double weight = (x[b] - x[a]).cross(x[c] - x[a]).norm() + 1e-6 * edge * edge;
      for (const std::uint32_t v : mesh.triangles[t]) {
        sums[v] += weight * mean;
        weights[v] += weight;
      }
    }
  }
  std::vector<float> traits(sums.size());
  for (std::size_t v = 0; v < sums.size(); ++v) {
    // None without triangles, or where areas are beyond all numbers.
    const double mean = sums[v] / weights[v];
    if (std::isfinite(mean)) traits[v] = static_cast<float>(mean);
  }
  return traits;
}

double percentile(std::vector<float>& values, double share) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(
                                       std::lround(share * static_cast<double>(values.size() - 1)));
  std::ranges::nth_element(values, at);
  return double{*at};
}

/// Through the palette's colours, in linear light as pictures go.
VertexColor color_at(const Palette& palette, double share) {
  const auto last = static_cast<double>(palette.stops.size() - 1);
  const double way = last * std::clamp(share, 0.0, 1.0);
  const auto stop = static_cast<std::size_t>(std::min(std::floor(way), last - 1));
  const double rest = way - static_cast<double>(stop);
  const Rgb color = (1 - rest) * palette.stops[stop] + rest * palette.stops[stop + 1];
  VertexColor bytes;
  for (std::size_t c = 0; c < bytes.size(); ++c) {
    bytes[c] = base::byte_of(base::srgb_encoded(color[static_cast<Eigen::Index>(c)]));
  }
  return bytes;
}

}  // namespace

void SurfaceColorOptions::validate() const {
  if (material == Material::clay) {
    throw OptionError("material", "clay has one colour everywhere; give iterations or trap");
  }
  PictureOptions shared;
  shared.iterations = iterations;
  shared.palette = palette;
  shared.validate();
}

SurfaceColors surface_colors(const Device& device, const Map& map, const TriangleMesh& mesh,
                             const SurfaceColorOptions& options, const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  mesh.validate();
  SurfaceColors found;
  if (mesh.vertices.empty()) return found;
  const StopRadii stops = find_stop_radii(device, map, options.escape, monitor.stop);
  const TraceStage stage(monitor.trace, "colour the surface");
  const std::vector<float> traits = vertex_traits({device, map, stops, options.precision},
                                                  map.frame.shape_to_map, mesh, options, monitor);
  std::vector<float> sorted = traits;
  const double low = percentile(sorted, kTail), high = percentile(sorted, 1 - kTail);
  if (high > low) {
    found.low = low;
    found.high = high;
  }
  found.colors.reserve(traits.size());
  for (const float trait : traits) {
    found.colors.push_back(
        color_at(options.palette, (double{trait} - found.low) / (found.high - found.low)));
  }
  return found;
}

}  // namespace qjulia

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/range_check.hpp"
#include "layout/picture_layout.h"
#include "map/box_option.hpp"
#include "map/portals.hpp"
#include "picture/depth_grid.hpp"
#include "picture/shading.hpp"
#include "qjulia/error.hpp"
#include "qjulia/field.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/progress.hpp"

namespace qjulia {

using namespace picture;
namespace {

using Eigen::Vector3d;

constexpr int kHalo = 2;               ///< rows of samples that normals look beyond a strip
constexpr int kStripSamples = 400000;  ///< keeps memory small and launches short
constexpr int kFloorMap = 256;

/// The lowest point of the shape along `up`.
double lowest(DepthSource& source, const Vector3d& up) {
  const Box bounds = source.bounds();
  const View view = parallel_view(-up, bounds, kFloorMap);
  double nearest = bounds.size().dot(up);
  for (const float depth : source.depths(view, 0, view.rows)) {
    if (depth >= 0) nearest = std::min(nearest, static_cast<double>(depth));
  }
  return view.eye.dot(up) + nearest;
}

/// What colours the strip's samples: none where all is clay. A pixel behind the surface: on it,
/// orbits part, and neighbours have nothing in common.
std::vector<float> traits_of(const View& view, const Strip& strip, DepthSource& source) {
  std::vector<Vector3d> points;
  std::vector<std::size_t> numbers;
  const int first_row = strip.first_row * strip.samples - strip.halo;
  for (std::size_t i = 0; i < strip.depths.size(); ++i) {
    if (strip.depths[i] < 0) continue;
    const auto wide = static_cast<std::size_t>(view.columns);
    const std::size_t row = i / wide;
    const double x = static_cast<double>(i % wide) + 0.5;
    const double y = first_row + static_cast<double>(row) + 0.5;
    const Vector3d direction = (view.dir + x * view.dir_dx + y * view.dir_dy).normalized();
    const double behind = view.footprint * view.samples;
    points.emplace_back(view.eye + (double{strip.depths[i]} + behind) * direction);
    numbers.push_back(i);
  }
  std::vector<double> arrays;
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    for (const Vector3d& point : points) arrays.push_back(point[axis]);
  }
  const std::vector<float> found = source.traits(arrays);
  if (found.empty()) return {};
  std::vector<float> traits(strip.depths.size());
  for (std::size_t i = 0; i < found.size(); ++i) traits[numbers[i]] = found[i];
  return traits;
}

/// What the strip's pixels show, added to `layers`.
void add_layers(const View& view, const Strip& strip, const std::vector<float>& normals,
                const ShapeToMap& to_scene, PictureLayers& layers) {
  const int columns = view.columns / strip.samples;
  for (int row = 0; row < strip.rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int i = column * strip.samples + strip.samples / 2;
      const int j = row * strip.samples + strip.samples / 2;
      const std::size_t sample = index(i, j + strip.halo, view.columns);
      const float depth = strip.depths[sample];
      if (depth < 0) {
        layers.depth.push_back(std::numeric_limits<float>::infinity());
        layers.normal.insert(layers.normal.end(), 3, 0.0F);
        layers.position.insert(layers.position.end(), 3, std::numeric_limits<float>::quiet_NaN());
        continue;
      }
      const double x = i + 0.5, y = strip.first_row * strip.samples + j + 0.5;
      const Vector3d direction = (view.dir + x * view.dir_dx + y * view.dir_dy).normalized();
      const Vector3d point = to_scene.to_shape(view.eye + double{depth} * direction);
      layers.depth.push_back(depth / static_cast<float>(to_scene.scale));
      const auto normal = normals.begin() + static_cast<std::ptrdiff_t>(3 * sample);
      layers.normal.insert(layers.normal.end(), normal, normal + 3);
      for (const double c : point) layers.position.push_back(static_cast<float>(c));
    }
  }
}

/// Pixels of the strip that have a sample on the surface.
std::size_t covered_pixels(const View& view, const Strip& strip) {
  const int columns = view.columns / strip.samples;
  std::vector<bool> covered(static_cast<std::size_t>(columns) *
                            static_cast<std::size_t>(strip.rows));
  for (int j = 0; j < strip.rows * strip.samples; ++j) {
    for (int i = 0; i < columns * strip.samples; ++i) {
      if (strip.depths[index(i, j + strip.halo, view.columns)] < 0) continue;
      covered[index(i / strip.samples, j / strip.samples, columns)] = true;
    }
  }
  return static_cast<std::size_t>(std::ranges::count(covered, true));
}

/// @param to_scene from the shape's coordinates to those of source and frame.
Image render_source(const Device& device, DepthSource& source, const Box& framed,
                    const ShapeToMap& to_scene, const PictureOptions& options,
                    const ProgressMonitor& monitor, PictureLayers* layers) {
  const int samples = options.samples_per_axis;
  const View view = camera_view(options.camera, framed, options.width, options.height, samples);
  const auto lights = studio_lights(options.camera, source.bounds());
  const auto rays = [](const View& v) { return double(v.columns) * double(v.rows); };
  double all = rays(view);
  for (const Light& light : lights) all += rays(light.view);
  double done = 0;
  const auto report = [&](double more) {
    done += more;
    monitor.report({"rendering", done / all, -1, {}});
  };

  std::vector<std::vector<float>> maps;
  for (const Light& light : lights) {
    maps.push_back(source.depths(light.view, 0, light.view.rows));
    throw_if_stopped(monitor.stop);
    report(rays(light.view));
  }
  const Vector3d up = axis(options.camera.up);
  const Scene scene{up, lowest(source, up), framed.center(), 0.5 * framed.diagonal()};
  const Shading shading(device, scene, lights, maps);

  if (layers != nullptr) *layers = {};
  Image image{options.width, options.height, {}};
  image.pixels.reserve(3 * static_cast<std::size_t>(image.width) *
                       static_cast<std::size_t>(image.height));
  const int strip_rows = std::max(1, kStripSamples / (view.columns * samples));
  for (int row = 0; row < options.height; row += strip_rows) {
    Strip strip;
    strip.first_row = row;
    strip.rows = std::min(strip_rows, options.height - row);
    strip.samples = samples;
    const int from = std::max(0, row * samples - kHalo);
    const int to = std::min(view.rows, (row + strip.rows) * samples + kHalo);
    strip.halo = row * samples - from;
    strip.depths = source.depths(view, from, to - from);
    if (options.material != Material::clay) strip.traits = traits_of(view, strip, source);
    throw_if_stopped(monitor.stop);
    const Shaded shaded = shading.shade(view, strip, layers != nullptr);
    image.pixels.insert(image.pixels.end(), shaded.pixels.begin(), shaded.pixels.end());
    image.covered += covered_pixels(view, strip);
    if (layers != nullptr) add_layers(view, strip, shaded.normals, to_scene, *layers);
    report(double(view.columns) * strip.rows * samples);
  }
  return image;
}

/// What a map's pictures show: the part asked for, else the box of the shape and its copies, or
/// where none is known, the source's bounds.
Box framed_box(const RationalMap& map, const std::optional<Box>& part, const DepthSource& source) {
  if (part) return *part;
  const std::optional<Box> box = map::box_with_copies(map);
  if (!box) return source.bounds();
  return {map.shape_to_map.to_map(box->low), map.shape_to_map.to_map(box->high)};
}

}  // namespace

const char* to_string(Material material) {
  switch (material) {
    case Material::clay:
      return "clay";
    case Material::iterations:
      return "iterations";
    case Material::trap:
      return "trap";
  }
  return "";
}

void PictureOptions::validate() const {
  base::expect_between("width", width, 1, 16384, "pixels");
  base::expect_between("height", height, 1, 16384, "pixels");
  base::expect_between("iterations", iterations, 1, kMostIterations);
  base::expect_between("samples_per_axis", samples_per_axis, 1, 8);
  base::expect_finite("azimuth", camera.azimuth);
  base::expect_between("elevation", camera.elevation, -90.0, 90.0, "degrees");
  base::expect_between("zoom", camera.zoom, 0.01, 1000.0);
  base::expect_between("field_of_view", camera.field_of_view, 1.0, 120.0, "degrees");
  map::expect_box(box);
  if (camera.up < 'x' || camera.up > 'z') {
    throw OptionError("up", fmt::format("'{}' is not an axis; give x, y or z", camera.up));
  }
}

Image render(const Device& device, const RationalMap& map, const PictureOptions& options,
             const ProgressMonitor& monitor, PictureLayers* layers) {
  options.validate();
  map.validate();
  MarchedSet set{map,         options.iterations, options.escape,
                 {},          options.precision,  options.material,
                 monitor.stop};
  if (options.box) {
    set.part =
        Box{map.shape_to_map.to_map(options.box->low), map.shape_to_map.to_map(options.box->high)};
  }
  const auto source = march_source(device, set);
  return render_source(device, *source, framed_box(map, set.part, *source), map.shape_to_map,
                       options, monitor, layers);
}

Image render_mesh(const Device& device, const TriangleMesh& mesh, const Box& framed,
                  const PictureOptions& options, const ProgressMonitor& monitor,
                  PictureLayers* layers) {
  options.validate();
  const double side = framed.size().maxCoeff();
  if (!(side > 0) || !std::isfinite(side)) {
    throw InputError("the box to frame has no size; give the mesh's own box");
  }
  // As large as maps are, so that both are lit alike.
  const ShapeToMap to_scene{3 / side, -3 / side * framed.center()};
  TriangleMesh scaled = mesh;
  for (Vector3d& vertex : scaled.vertices) vertex = to_scene.to_map(vertex);
  return render_source(device, *mesh_source(scaled),
                       {to_scene.to_map(framed.low), to_scene.to_map(framed.high)}, to_scene,
                       options, monitor, layers);
}

}  // namespace qjulia

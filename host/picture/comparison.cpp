#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "canvas/cairo_canvas.hpp"
#include "picture/framing.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/shape.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {

using namespace canvas;
namespace {

/// The share of seen points whose distance the scale holds.
constexpr double kHeld = 0.98;
constexpr int kGap = 8;  ///< pixels between pictures

/// From −1, within the mesh, to 1, outside: blue, white, red, as in Moreland 2009, "Diverging color
/// maps for scientific visualization"; sRGB.
Rgb diverging(double t) {
  const Rgb inside(0.23, 0.30, 0.75), middle(0.93, 0.93, 0.93), outside(0.71, 0.02, 0.15);
  t = std::clamp(t, -1.0, 1.0);
  return middle + std::abs(t) * ((t < 0 ? inside : outside) - middle);
}

/// The least of 1, 2 and 5 times a power of ten that is not below `value`.
double rounded_up(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (digit * power >= value * (1 - 1e-9)) return digit * power;
  }
  return 10 * power;
}

/// Signed distances of the seen points from a mesh, its units, pixel by pixel; not a number where
/// nothing is seen.
std::vector<double> distances_of(const SignedDistance& distance, const PictureLayers& layers,
                                 const std::stop_token& stop) {
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < layers.depth.size(); ++i) {
    if (!std::isfinite(layers.depth[i])) continue;
    points.emplace_back(layers.position[3 * i], layers.position[3 * i + 1],
                        layers.position[3 * i + 2]);
  }
  const std::vector<double> found = distance.at(points, stop);
  std::vector<double> distances(layers.depth.size(), NAN);
  std::size_t next = 0;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    if (std::isfinite(layers.depth[i])) distances[i] = found[next++];
  }
  return distances;
}

/// What distance has the scale's full colour: a round share of `unit`.
double scale_of(const std::vector<double>& distances, double unit) {
  std::vector<double> sizes;
  for (const double d : distances) {
    if (!std::isnan(d)) sizes.push_back(std::abs(d));
  }
  if (sizes.empty()) return unit;
  const auto held =
      sizes.begin() + static_cast<std::ptrdiff_t>(kHeld * static_cast<double>(sizes.size() - 1));
  std::ranges::nth_element(sizes, held);
  return unit * rounded_up(std::max(*held / unit, 1e-6));
}

/// The picture with the colours of the distances, as light and dark as it was.
Image colored(const Image& picture, const std::vector<double>& distances, double full) {
  // The brightness of a lit patch of the pictures' clay.
  constexpr double kLit = 0.75;
  Image image = picture;
  for (std::size_t i = 0; i < distances.size(); ++i) {
    std::uint8_t* rgb = image.pixels.data() + 3 * i;
    const double brightness = (0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]) / 255;
    if (std::isnan(distances[i])) {
      std::fill_n(rgb, 3, static_cast<std::uint8_t>(255 * brightness));
      continue;
    }
    const Rgb color = diverging(distances[i] / full);
    const double shade = std::clamp(brightness / kLit, 0.0, 1.1);
    for (int c = 0; c < 3; ++c) {
      rgb[c] = static_cast<std::uint8_t>(std::clamp(255 * shade * color[c], 0.0, 255.0));
    }
  }
  return image;
}

/// The sheet with a bar of the colours under it.
Image with_scale(const Image& sheet, double full, double diagonal) {
  const double size = std::max(11.0, sheet.width / 60.0);
  const double left = 0.1 * sheet.width, width = 0.8 * sheet.width;
  CairoCanvas canvas(sheet.width, sheet.height + static_cast<int>(6 * size));
  canvas.put(sheet, 0, 0);
  cairo_t* context = canvas.context();
  const double top = sheet.height + 2 * size;
  for (int i = 0; i < static_cast<int>(width); ++i) {
    const Rgb color = diverging(2 * (i + 0.5) / width - 1);
    cairo_set_source_rgb(context, color[0], color[1], color[2]);
    cairo_rectangle(context, left + i, top, 1.5, size);
    cairo_fill(context);
  }
  set_ink(context);
  draw_text(
      context,
      "distance of the set from the mesh: % of its box's diagonal; below, its units. Blue: inside",
      0.5 * sheet.width, top - 0.6 * size, size, Anchor::middle);
  for (const double share : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    const double x = left + 0.5 * (1 + share) * width;
    cairo_rectangle(context, x - 0.5, top + size, 1, 0.4 * size);
    cairo_fill(context);
    draw_text(context, fmt::format("{:.3g} %", 100 * share * full / diagonal), x, top + 2.5 * size,
              size, Anchor::middle);
    draw_text(context, fmt::format("{:.3g}", share * full), x, top + 3.7 * size, 0.9 * size,
              Anchor::middle);
  }
  return canvas.image();
}

}  // namespace

Image comparison(const Device& device, const Map& map, const TriangleMesh& mesh,
                 const PictureOptions& options, const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  mesh.validate();
  constexpr int kWidest = 32'767;  // Cairo's largest canvas, pixels
  if (2 * options.width + kGap > kWidest) {
    throw OptionError("size", fmt::format("a width of {} is too large for a sheet of two pictures "
                                          "side by side; give at most {}",
                                          options.width, (kWidest - kGap) / 2));
  }
  Map framed = map;
  if (!framed.frame.box) framed.frame.box = mesh.box();
  PictureOptions standing = options;
  if (!standing.camera.up) standing.camera.up = map.frame.up.value_or(kDefaultUp);
  Studio studio(device, framed, standing, monitor.stop);
  const std::vector<Eigen::Vector3d> of_mesh =
      options.box ? std::vector<Eigen::Vector3d>{} : picture::extremes(mesh.vertices, monitor.stop);
  standing.camera = studio.aimed(std::span(&standing.camera, 1), of_mesh).front();
  const auto [set, seen] = studio.layered_picture(standing.camera, monitor);
  standing.exposure = studio.exposure();
  PictureOptions potential = standing;
  potential.iterations = 1;
  const Image original = render_mesh(device, mesh, mesh.box(), standing, monitor);
  const Image fitted = render(device, framed, potential, monitor);
  const std::vector<double> distances =
      distances_of(outer_surface(device, mesh, monitor.stop).distance, seen, monitor.stop);
  const double diagonal = mesh.box().diagonal();
  const double full = scale_of(distances, 0.01 * diagonal);
  const std::array<Image, 4> pictures{
      captioned(original, "the mesh"), captioned(fitted, "the potential, n = 1"),
      captioned(set, fmt::format("the set, n = {}", options.iterations)),
      captioned(colored(set, distances, full), "distance from the mesh")};
  Image sheet = with_scale(contact_sheet(pictures, 2, kGap), full, diagonal);
  sheet.covered = set.covered;
  return sheet;
}

}  // namespace qjulia

#include "qjulia/picture/bake_texture.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/range_check.hpp"
#include "mesh/triangle_tree.hpp"
#include "picture/point_traits.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia {

using namespace picture;
namespace {

using Eigen::Matrix3d, Eigen::Vector2d, Eigen::Vector3d;

/// The squares of a texture, row by row from its upper left corner, with two triangles each: one in
/// the upper left half and one in the lower right. Lengths are in pixels, to the right and down.
class Atlas {
 public:
  /// @throws OptionError where the squares would be too small
  Atlas(std::size_t triangles, int size) : triangles_(triangles) {
    expect_texture_size(size, triangles);
    const double squares = std::ceil(static_cast<double>(triangles) / 2);
    side_ = static_cast<int>(size / std::ceil(std::sqrt(squares)));
    across_ = size / side_;
  }

  /// The triangle a pixel belongs to; where the texture is empty, the number of triangles or more.
  std::size_t triangle_at(int column, int row) const {
    const int i = column / side_, j = row / side_;
    if (i >= across_) return triangles_;
    const bool is_lower = column % side_ + row % side_ + 1 >= side_;
    return 2 * static_cast<std::size_t>(j * across_ + i) + (is_lower ? 1 : 0);
  }

  /// Where the triangle's corners lie. The first has the right angle; the way to the third is along
  /// the rows, and that to the second along the columns, so that with the second coordinate counted
  /// upward no triangle is mirrored.
  std::array<Vector2d, 3> corners(std::size_t triangle) const {
    // Hypotenuses of the two are 2 √2 pixels apart, other edges 1.5 pixels from the square's.
    constexpr double kMargin = 1.5, kLegMargins = 5;
    const double leg = side_ - kLegMargins;
    const auto square = static_cast<int>(triangle / 2);
    const Vector2d low = side_ * Vector2d(square % across_, square / across_);
    const bool is_lower = triangle % 2 == 1;
    const double to = is_lower ? -leg : leg;
    const Vector2d at = low + Vector2d::Constant(is_lower ? side_ - kMargin : kMargin);
    return {at, at + Vector2d(0, to), at + Vector2d(to, 0)};
  }

 private:
  std::size_t triangles_;
  int side_ = 0, across_ = 0;
};

/// A triangle with its place in the texture and with the tangent space of its corners.
class TexturedTriangle {
 public:
  TexturedTriangle(const TriangleMesh& mesh, std::size_t index, const Atlas& atlas) {
    const Triangle& triangle = mesh.triangles[index];
    const auto places = atlas.corners(index);
    origin_ = places[0];
    to_right_ = places[2].x() - places[0].x();
    down_ = places[1].y() - places[0].y();
    for (std::size_t i = 0; i < corners_.size(); ++i) corners_[i] = mesh.vertices[triangle[i]];
    const double sign = to_right_ > 0 ? 1 : -1;
    const Vector3d along = sign * (corners_[2] - corners_[0]);  // to the right in the texture
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      const Vector3d normal = mesh.normals[triangle[i]].cast<double>();
      const Vector3d tangent = (along - normal.dot(along) * normal).normalized();
      frames_[i] << tangent, normal.cross(tangent), normal;
    }
    const Vector3d ab = corners_[1] - corners_[0], ac = corners_[2] - corners_[0];
    pixel_ = std::sqrt(ab.cross(ac).norm()) / std::abs(to_right_);
  }

  /// Weights of the corners at a point of the texture; beyond the triangle some are negative.
  Vector3d weights(const Vector2d& at) const {
    const double c = (at.x() - origin_.x()) / to_right_, b = (at.y() - origin_.y()) / down_;
    return {1 - b - c, b, c};
  }

  Vector3d point(const Vector3d& weights) const {
    return weights[0] * corners_[0] + weights[1] * corners_[1] + weights[2] * corners_[2];
  }

  /// A normal in tangent space, interpolated as programs that draw do: of unit vectors at the
  /// corners, without making them unit vectors again.
  Vector3d in_tangent_space(const Vector3d& normal, const Vector3d& weights) const {
    const Matrix3d frame =
        weights[0] * frames_[0] + weights[1] * frames_[1] + weights[2] * frames_[2];
    Vector3d found = frame.fullPivLu().solve(normal);
    if (!found.allFinite()) return Vector3d::UnitZ();
    // A normal cannot point into the triangle: the nearest point may lie on a thin wall's far side.
    constexpr double kLeastOutward = 0.05;
    found.normalize();
    found.z() = std::max(found.z(), kLeastOutward);
    return found.normalized();
  }

  double pixel() const { return pixel_; }  ///< the width of a pixel on the triangle, about

  /// The tangent at a corner, and the bitangent's sign.
  Eigen::Vector4f tangent(std::size_t corner) const {
    const Eigen::Vector3f t = frames_[corner].col(0).cast<float>();
    return {t.x(), t.y(), t.z(), 1};
  }

 private:
  Vector2d origin_;
  double to_right_ = 0, down_ = 0, pixel_ = 0;
  std::array<Vector3d, 3> corners_;
  std::array<Matrix3d, 3> frames_;  ///< columns: tangent, bitangent, normal
};

/// The normal of a mesh at a point of one of its triangles.
Vector3d normal_at(const TriangleMesh& mesh, const Triangle& triangle, const Vector3d& x) {
  const auto& [a, b, c] = triangle;
  const Vector3d ab = mesh.vertices[b] - mesh.vertices[a], ac = mesh.vertices[c] - mesh.vertices[a];
  const Vector3d across = ab.cross(ac), ax = x - mesh.vertices[a];
  const double square = across.squaredNorm();
  const double of_b = square > 0 ? across.dot(ax.cross(ac)) / square : 0;
  const double of_c = square > 0 ? across.dot(ab.cross(ax)) / square : 0;
  const Eigen::Vector3f mean = static_cast<float>(1 - of_b - of_c) * mesh.normals[a] +
                               static_cast<float>(of_b) * mesh.normals[b] +
                               static_cast<float>(of_c) * mesh.normals[c];
  return mean.cast<double>().normalized();
}

std::uint8_t byte_of_normal(double coordinate) {
  return static_cast<std::uint8_t>(std::lround(127.5 * (std::clamp(coordinate, -1.0, 1.0) + 1)));
}

void expect_normals(const TriangleMesh& mesh) {
  mesh.validate();
  if (mesh.triangles.empty() || mesh.normals.empty()) {
    throw InputError("a texture needs meshes with triangles and with normals");
  }
}

/// Pixels of a texture, 3 bytes each.
Image blank(int size, std::array<std::uint8_t, 3> color) {
  Image image{size, size, {}};
  const std::size_t pixels = static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  image.pixels.reserve(3 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    image.pixels.insert(image.pixels.end(), color.begin(), color.end());
  }
  return image;
}

/// What pixels of a row show: their places in the picture, points of the fine mesh, and the widths
/// of a pixel there, map units.
struct Row {
  std::vector<std::size_t> pixels;
  std::vector<Vector3d> points;
  std::vector<double> widths;
};

}  // namespace

void expect_texture_size(int size, std::size_t triangles) {
  constexpr std::size_t kLeastSide = 8;  // pixels of a square
  const std::size_t across = static_cast<std::size_t>(size) / kLeastSide;
  if (triangles <= 2 * across * across) return;
  const double squares = std::ceil(static_cast<double>(triangles) / 2);
  const double least = static_cast<double>(kLeastSide) * std::ceil(std::sqrt(squares));
  const std::string larger =
      least <= TextureOptions::kMostSize ? fmt::format("{:.0f} or more, or ", least) : "";
  throw OptionError("size", fmt::format("{} pixels are too few for {} triangles; give {}a mesh of "
                                        "at most {} triangles",
                                        size, triangles, larger, 2 * across * across));
}

void TextureOptions::validate() const {
  base::expect_between("size", size, kLeastSize, kMostSize, "pixels");
  if (colors) colors->validate();
}

MeshTexture bake_texture(const Device& device, const Map& map, const TriangleMesh& fine,
                         const TriangleMesh& coarse, const TextureOptions& options,
                         const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  expect_normals(fine);
  expect_normals(coarse);
  const TraceStage stage(monitor.trace, "bake the texture");
  const Atlas atlas(coarse.triangles.size(), options.size);
  const shape::TriangleTree tree(fine, monitor.stop);
  std::optional<PointTraits> traits_at;
  MaterialRange range;
  if (options.colors) {
    traits_at.emplace(device, map, *options.colors, monitor.stop);
    range = options.colors->range
                ? *options.colors->range
                : surface_colors(device, map, fine, *options.colors, monitor).range;
  }
  Image normals = blank(options.size, {128, 128, 255}), colors = blank(options.size, {0, 0, 0});
  // Many rows at once keep a device busy.
  constexpr std::size_t kPointsAtOnce = std::size_t{1} << 18;
  Row waiting;
  const auto color = [&] {
    if (waiting.points.empty()) return;
    const std::vector<float> traits = (*traits_at)(waiting.points, waiting.widths);
    for (std::size_t i = 0; i < traits.size(); ++i) {
      std::ranges::copy(vertex_color(options.colors->palette, range, traits[i]),
                        colors.pixels.begin() + static_cast<std::ptrdiff_t>(3 * waiting.pixels[i]));
    }
    waiting = {};
  };
  for (int row = 0; row < options.size; ++row) {
    monitor.report({"baking the texture", static_cast<double>(row) / options.size, -1, ""});
    throw_if_stopped(monitor.stop);
    std::size_t last = coarse.triangles.size();
    std::optional<TexturedTriangle> patch;
    for (int column = 0; column < options.size; ++column) {
      const std::size_t triangle = atlas.triangle_at(column, row);
      if (triangle >= coarse.triangles.size()) continue;
      if (triangle != last) patch.emplace(coarse, last = triangle, atlas);
      const Vector3d weights = patch->weights({column + 0.5, row + 0.5});
      const auto nearest = tree.nearest(patch->point(weights));
      const Vector3d normal = patch->in_tangent_space(
          normal_at(fine, fine.triangles[nearest.triangle], nearest.position), weights);
      const std::size_t pixel =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(options.size) +
          static_cast<std::size_t>(column);
      for (std::size_t c = 0; c < 3; ++c) {
        normals.pixels[3 * pixel + c] = byte_of_normal(normal[static_cast<Eigen::Index>(c)]);
      }
      if (!traits_at) continue;
      waiting.pixels.push_back(pixel);
      waiting.points.push_back(nearest.position);
      waiting.widths.push_back(map.frame.shape_to_map.scale * patch->pixel());
    }
    if (waiting.points.size() >= kPointsAtOnce) color();
  }
  color();
  MeshTexture texture;
  texture.places.reserve(3 * coarse.triangles.size());
  for (std::size_t t = 0; t < coarse.triangles.size(); ++t) {
    const TexturedTriangle patch(coarse, t, atlas);
    const auto corners = atlas.corners(t);
    for (std::size_t i = 0; i < corners.size(); ++i) {
      texture.places.emplace_back((corners[i] / options.size).cast<float>());
      texture.tangents.push_back(patch.tangent(i));
    }
  }
  texture.normal = png_bytes(normals);
  if (options.colors) texture.color = png_bytes(colors);
  return texture;
}

}  // namespace qjulia

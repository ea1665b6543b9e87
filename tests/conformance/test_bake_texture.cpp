// Textures of a coarse sphere, against the exact normals and heights of the fine one.

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/srgb.hpp"
#include "check/unit_ball.hpp"
#include "png_file.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/bake_texture.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Eigen::Vector2d, Eigen::Vector3d;

namespace {

/// @param normal_at of a point of the sphere
template <class NormalAt>
TriangleMesh sphere_with_normals(int level, const NormalAt& normal_at) {
  TriangleMesh mesh = shapes::sphere(level);
  for (const Vector3d& x : mesh.vertices)
    mesh.normals.push_back(normal_at(x).template cast<float>());
  return mesh;
}

Vector3d outward(const Vector3d& x) { return x.normalized(); }

/// Normals that lean by up to 45 degrees, as those of a whirl about an axis.
Vector3d leaning(const Vector3d& x) {
  const Vector3d axis = Vector3d(1, 2, 2) / 3;
  return (outward(x) + axis.cross(outward(x))).normalized();
}

Image read(const std::string& png) {
  const test::TemporaryFolder folder;
  return test::read_png(folder.file("picture.png", png));
}

/// The picture between the middles of its pixels, at a place in 0 … 1, as a sampler reads it.
Vector3d sample(const Image& image, const Vector2d& place) {
  const Vector2d at = image.width * place - Vector2d::Constant(0.5);
  const Vector2d low = at.array().floor(), t = at - low;
  Vector3d sum = Vector3d::Zero();
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const double weight = (i == 1 ? t.x() : 1 - t.x()) * (j == 1 ? t.y() : 1 - t.y());
      const int x = std::clamp(static_cast<int>(low.x()) + i, 0, image.width - 1);
      const int y = std::clamp(static_cast<int>(low.y()) + j, 0, image.height - 1);
      for (int c = 0; c < 3; ++c) {
        sum[c] += weight * image.pixels[static_cast<std::size_t>(3 * (y * image.width + x) + c)];
      }
    }
  }
  return sum;
}

/// A point of a textured triangle, as programs that draw see it.
struct Seen {
  Vector3d point;
  Vector2d place;
  Vector3d normal;  ///< by the picture of normals
};

/// @param w weights of the triangle's corners
Seen seen(const TriangleMesh& mesh, const MeshTexture& texture, const Image& normals,
          std::size_t triangle, const Vector3d& w) {
  Seen seen{Vector3d::Zero(), Vector2d::Zero(), {}};
  Vector3d x[3];
  Vector2d p[3];
  for (std::size_t i = 0; i < 3; ++i) {
    x[i] = mesh.vertices[mesh.triangles[triangle][i]];
    p[i] = texture.places[3 * triangle + i].cast<double>();
    seen.point += w[static_cast<Eigen::Index>(i)] * x[i];
    seen.place += w[static_cast<Eigen::Index>(i)] * p[i];
  }
  // The way over the triangle for a step to the right in the picture, and for one up.
  Eigen::Matrix2d steps;
  steps << p[1] - p[0], p[2] - p[0];
  Eigen::Matrix<double, 3, 2> ways;
  ways << x[1] - x[0], x[2] - x[0];
  const Eigen::Matrix<double, 3, 2> slopes = ways * steps.inverse();
  const Vector3d right = slopes.col(0), up = -slopes.col(1);
  Vector3d tangent = Vector3d::Zero(), bitangent = tangent, normal = tangent;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vector3d n = mesh.normals[mesh.triangles[triangle][i]].cast<double>();
    const Vector3d t = (right - n * n.dot(right)).normalized();
    const double sign = n.cross(right).dot(up) > 0 ? 1 : -1;
    CHECK(sign == 1);  // no triangle is mirrored
    const auto weight = w[static_cast<Eigen::Index>(i)];
    tangent += weight * t;
    bitangent += weight * sign * n.cross(t);
    normal += weight * n;
  }
  const Vector3d c = sample(normals, seen.place) / 127.5 - Vector3d::Ones();
  seen.normal = (c.x() * tangent + c.y() * bitangent + c.z() * normal).normalized();
  return seen;
}

}  // namespace

TEST_CASE("a texture shows a fine mesh's normals and the material's colours on a coarse mesh") {
  const Map map = check::unit_ball();
  const TriangleMesh fine = sphere_with_normals(5, leaning),
                     coarse = sphere_with_normals(2, outward);
  SurfaceColorOptions colors;
  colors.material = Material::height;
  colors.palette.stops = {Rgb::Zero(), Rgb::Ones()};
  colors.range = MaterialRange{-1, 1};
  const MeshTexture texture =
      bake_texture(test::shared_device(), map, fine, coarse, {.size = 512, .colors = colors});
  texture.validate(coarse);
  const Image normals = read(texture.normal), picture = read(texture.color);
  REQUIRE(normals.width == 512);
  REQUIRE(picture.height == 512);
  const Eigen::Index up = map.frame.up.value_or(kDefaultUp) == UpAxis::y ? 1 : 2;
  // In the middle, on the edges and at the corners, where a sampler reads beyond the triangle.
  const Vector3d places[] = {{1 / 3.0, 1 / 3.0, 1 / 3.0},
                             {0.5, 0.5, 0},
                             {0, 0.5, 0.5},
                             {0.5, 0, 0.5},
                             {1, 0, 0},
                             {0, 1, 0},
                             {0, 0, 1}};
  double worst_angle = 0, worst_height = 0;
  for (std::size_t t = 0; t < coarse.triangles.size(); ++t) {
    for (const Vector3d& w : places) {
      const Seen at = seen(coarse, texture, normals, t, w);
      const Vector3d exact = at.point.normalized();
      worst_angle = std::max(worst_angle, std::acos(std::min(1.0, leaning(exact).dot(at.normal))));
      const double share = base::srgb_decoded(sample(picture, at.place).mean() / 255);
      worst_height = std::max(worst_height, std::abs(2 * share - 1 - exact[up]));
    }
  }
  CHECK(worst_angle < 0.02);   // a pixel's byte is worth 0.008
  CHECK(worst_height < 0.04);  // the palette's darkest steps are the widest
}

TEST_CASE("a texture without colours has normals alone, and one that is too small is refused") {
  const Map map = check::unit_ball();
  const TriangleMesh mesh = sphere_with_normals(3, outward);
  const auto bake = [&](int size) {
    return bake_texture(test::shared_device(), map, mesh, mesh, {.size = size});
  };
  const MeshTexture texture = bake(256);
  CHECK(texture.color.empty());
  // On itself, a mesh has its own normals.
  for (const std::size_t c : {std::size_t{0}, std::size_t{1}}) {
    const Image normals = read(texture.normal);
    int most = 0;
    for (std::size_t i = c; i < normals.pixels.size(); i += 3) {
      most = std::max(most, std::abs(normals.pixels[i] - 128));
    }
    CHECK(most < 8);
  }
  try {
    bake(128);
    FAIL("1,280 triangles fit into 128 x 128 pixels");
  } catch (const OptionError& error) {
    CHECK(error.field() == "size");
    CHECK_THAT(error.what(), Catch::Matchers::ContainsSubstring("give 208 or more"));
  }
  CHECK_NOTHROW(bake(208));
}

TEST_CASE("a textured .glb has the pictures, and a place in them for each corner") {
  const Map map = check::unit_ball();
  // An odd number of triangles leaves half of the last square empty.
  TriangleMesh mesh = sphere_with_normals(1, outward);
  mesh.triangles.pop_back();
  SurfaceColorOptions colors;
  colors.material = Material::height;
  const MeshTexture texture =
      bake_texture(test::shared_device(), map, mesh, mesh, {.size = 128, .colors = colors});
  const test::TemporaryFolder folder;
  const std::string path = folder / "ball.glb";
  write_textured_mesh(mesh, texture, path, {});
  const TriangleMesh again = read_mesh(path);
  CHECK(again.triangles.size() == mesh.triangles.size());
  CHECK(again.vertices.size() == mesh.vertices.size());  // equal ones are welded
  const std::string bytes = test::read_text(path);
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, sizeof(length));
  const auto scene = nlohmann::json::parse(bytes.substr(20, length));
  const std::string buffer = bytes.substr(28 + length);
  const auto part = [&](int view) {
    const auto& of = scene["bufferViews"][static_cast<std::size_t>(view)];
    return buffer.substr(of["byteOffset"], of["byteLength"]);
  };
  const auto& material = scene["materials"][0];
  const auto picture = [&](const nlohmann::json& reference) {
    const int texture_index = reference["index"];
    const int image = scene["textures"][static_cast<std::size_t>(texture_index)]["source"];
    return part(scene["images"][static_cast<std::size_t>(image)]["bufferView"]);
  };
  CHECK(picture(material["normalTexture"]) == texture.normal);
  CHECK(picture(material["pbrMetallicRoughness"]["baseColorTexture"]) == texture.color);
  CHECK(texture.normal != texture.color);
  const auto& attributes = scene["meshes"][0]["primitives"][0]["attributes"];
  const auto stored = [&](const char* name, const auto& expected) {
    const auto& accessor = scene["accessors"][attributes[name].get<std::size_t>()];
    CHECK(accessor["count"] == 3 * mesh.triangles.size());
    const std::string found = part(accessor["bufferView"]);
    REQUIRE(found.size() == expected.size() * sizeof(expected[0]));
    CHECK(std::memcmp(found.data(), expected.data(), found.size()) == 0);
  };
  stored("TEXCOORD_0", texture.places);
  stored("TANGENT", texture.tangents);
  for (const Eigen::Vector4f& t : texture.tangents) CHECK(t.norm() == Catch::Approx(std::sqrt(2)));
  for (const auto& view : scene["bufferViews"]) CHECK(view["byteOffset"].get<int>() % 4 == 0);
}

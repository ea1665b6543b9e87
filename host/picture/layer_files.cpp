#include <algorithm>
#include <array>
#include <cmath>

#include "files/atomic_file.hpp"
#include "files/npy.hpp"
#include "qjulia/picture.hpp"

namespace qjulia {
namespace {

void write_npy(const std::vector<float>& values, std::span<const std::size_t> shape,
               const std::filesystem::path& path) {
  AtomicFile file(path);
  file.stream() << npy_header(shape, false);
  file.stream().write(reinterpret_cast<const char*>(values.data()),
                      static_cast<std::streamsize>(values.size() * sizeof(float)));
  file.commit();
}

/// White at the least depth, a quarter at the greatest, black where nothing is.
Image depth_image(const std::vector<float>& depths, int width, int height) {
  float nearest = INFINITY, farthest = 0;
  for (const float depth : depths) {
    if (!std::isfinite(depth)) continue;
    nearest = std::min(nearest, depth);
    farthest = std::max(farthest, depth);
  }
  const float range = std::max(farthest - nearest, 1e-30F);
  Image image{width, height, {}};
  for (const float depth : depths) {
    const float share = std::isfinite(depth) ? 1 - 0.75F * (depth - nearest) / range : 0;
    image.pixels.insert(image.pixels.end(), 3, static_cast<std::uint8_t>(std::lround(255 * share)));
  }
  return image;
}

Image normal_image(const std::vector<float>& normals, int width, int height) {
  Image image{width, height, {}};
  for (const float c : normals) {
    image.pixels.push_back(static_cast<std::uint8_t>(std::lround(127.5F * (1 + c))));
  }
  return image;
}

}  // namespace

std::vector<std::filesystem::path> write_layers(const PictureLayers& layers, int width,
                                                const std::filesystem::path& prefix) {
  const auto wide = static_cast<std::size_t>(width);
  const std::size_t deep = layers.depth.size() / wide;
  const std::array<std::size_t, 3> shape{deep, wide, 3};
  const int height = static_cast<int>(deep);
  std::vector<std::filesystem::path> paths;
  const auto next = [&](const char* ending) {
    return paths.emplace_back(prefix.string() + ending);
  };
  write_npy(layers.depth, std::span(shape).first(2), next(".depth.npy"));
  write_npy(layers.normal, shape, next(".normal.npy"));
  write_npy(layers.position, shape, next(".position.npy"));
  write_png(depth_image(layers.depth, width, height), next(".depth.png"));
  write_png(normal_image(layers.normal, width, height), next(".normal.png"));
  return paths;
}

}  // namespace qjulia

#include "batch/picture_file.hpp"

#include <png.h>

namespace qjulia::batch {

std::optional<Image> read_picture(const std::filesystem::path& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) return std::nullopt;
  png.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  image.pixels.resize(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0) {
    return std::nullopt;
  }
  return image;
}

Image shrunk(const Image& image, int width) {
  const int step = (image.width + width - 1) / width;
  if (step <= 1) return image;
  Image small{image.width / step, std::max(image.height / step, 1), {}};
  const int tall = std::min(step, image.height);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        unsigned sum = 0;
        for (int v = 0; v < tall; ++v) {
          for (int u = 0; u < step; ++u) {
            const auto pixel =
                static_cast<std::size_t>(y * step + v) * static_cast<std::size_t>(image.width) +
                static_cast<std::size_t>(x * step + u);
            sum += image.pixels[3 * pixel + static_cast<std::size_t>(channel)];
          }
        }
        const auto area = static_cast<unsigned>(tall * step);
        small.pixels.push_back(static_cast<std::uint8_t>((sum + area / 2) / area));
      }
    }
  }
  return small;
}

}  // namespace qjulia::batch

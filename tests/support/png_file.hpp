#pragma once
/// PNG files read back by libpng alone.

#include <png.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>

#include "qjulia/picture/picture.hpp"

namespace qjulia::test {

/// @throws std::runtime_error unless the file is a whole PNG.
inline Image read_png(const std::filesystem::path& path) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&png, path.c_str()) == 0) {
    throw std::runtime_error(path.string() + ": " + png.message);
  }
  png.format = PNG_FORMAT_RGB;
  Image image{static_cast<int>(png.width), static_cast<int>(png.height), {}};
  image.pixels.resize(PNG_IMAGE_SIZE(png));
  if (png_image_finish_read(&png, nullptr, image.pixels.data(), 0, nullptr) == 0) {
    throw std::runtime_error(path.string() + ": " + png.message);
  }
  return image;
}

/// Mean over all bytes of the difference's size, 0 … 255; 255 where sizes differ.
inline double mean_difference(const Image& a, const Image& b) {
  if (a.width != b.width || a.height != b.height) return 255;
  double sum = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) sum += std::abs(a.pixels[i] - b.pixels[i]);
  return sum / static_cast<double>(a.pixels.size());
}

}  // namespace qjulia::test

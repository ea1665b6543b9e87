#include <algorithm>

#include "canvas/cairo_canvas.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {

using namespace canvas;
namespace {

/// The image before white.
Image opaque(Image image) {
  for (std::size_t i = 0; i < image.pixels.size() && !image.alpha.empty(); ++i) {
    const int alpha = image.alpha[i / 3];
    image.pixels[i] =
        static_cast<std::uint8_t>((image.pixels[i] * alpha + 255 * (255 - alpha) + 127) / 255);
  }
  image.alpha.clear();
  return image;
}

}  // namespace

Image contact_sheet(std::span<const Image> images, int columns, int gap) {
  if (images.empty() || columns < 1 || gap < 0) {
    throw InputError("a contact sheet needs pictures, at least one column and a gap of 0 or more");
  }
  int cell_width = 0, cell_height = 0;
  for (const Image& image : images) {
    image.validate();
    cell_width = std::max(cell_width, image.width);
    cell_height = std::max(cell_height, image.height);
  }
  const int count = static_cast<int>(images.size());
  columns = std::min(columns, count);
  const int rows = (count + columns - 1) / columns;
  Image sheet{columns * (cell_width + gap) - gap, rows * (cell_height + gap) - gap, {}};
  const auto row_bytes = 3 * static_cast<std::size_t>(sheet.width);
  sheet.pixels.assign(row_bytes * static_cast<std::size_t>(sheet.height), 255);
  for (int i = 0; i < count; ++i) {
    const Image image = opaque(images[static_cast<std::size_t>(i)]);
    const std::ptrdiff_t left = i % columns * std::ptrdiff_t{cell_width + gap};
    const std::ptrdiff_t top = i / columns * std::ptrdiff_t{cell_height + gap};
    const auto bytes = 3 * static_cast<std::ptrdiff_t>(image.width);
    for (int row = 0; row < image.height; ++row) {
      std::copy_n(
          image.pixels.begin() + row * bytes, bytes,
          sheet.pixels.begin() + static_cast<std::ptrdiff_t>(row_bytes) * (top + row) + 3 * left);
    }
  }
  return sheet;
}

Image reduced(const Image& image, int times) {
  if (times < 1) throw InputError("the reduction of a picture must be at least 1");
  image.validate();
  if (times == 1) return image;
  const Image all = opaque(image);
  Image small{std::max(1, all.width / times), std::max(1, all.height / times), {}};
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      const int right = std::min((x + 1) * times, all.width);
      const int bottom = std::min((y + 1) * times, all.height);
      for (int c = 0; c < 3; ++c) {
        int sum = 0, count = 0;
        for (int row = y * times; row < bottom; ++row) {
          for (int column = x * times; column < right; ++column, ++count) {
            const std::ptrdiff_t pixel = std::ptrdiff_t{row} * all.width + column;
            sum += all.pixels[static_cast<std::size_t>(3 * pixel + c)];
          }
        }
        small.pixels.push_back(static_cast<std::uint8_t>((sum + count / 2) / count));
      }
    }
  }
  return small;
}

Image captioned(const Image& image, const std::string& text) {
  image.validate();
  const double size = std::max(11.0, image.width / 24.0);
  CairoCanvas canvas(image.width, image.height + static_cast<int>(2 * size));
  canvas.put(opaque(image), 0, 0);
  draw_text(canvas.context(), text, 0.5 * image.width, image.height + 1.35 * size, size,
            Anchor::middle);
  return canvas.image();
}

}  // namespace qjulia

#include "canvas/cairo_canvas.hpp"

#include <algorithm>
#include <bit>
#include <iterator>

#include "qjulia/base/error.hpp"

namespace qjulia::canvas {

// Pixels are 32-bit words with blue in the lowest byte.
static_assert(std::endian::native == std::endian::little, "bytes are blue, green, red, none");

void check(cairo_status_t status, const char* what) {
  if (status == CAIRO_STATUS_SUCCESS) return;
  throw Error(std::string("cannot draw ") + what + ": " + cairo_status_to_string(status));
}

CairoCanvas::CairoCanvas(int width, int height)
    : surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height)),
      context_(cairo_create(surface_.get())) {
  check(cairo_surface_status(surface_.get()), "a canvas");
  check(cairo_status(context_.get()), "a canvas");
  cairo_set_source_rgb(context(), 1, 1, 1);
  cairo_paint(context());
}

void CairoCanvas::put(const Image& image, int left, int top) {
  cairo_surface_flush(surface_.get());
  auto* bytes = cairo_image_surface_get_data(surface_.get());
  const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface_.get());
  const int right = std::min(image.width, cairo_image_surface_get_width(surface_.get()) - left);
  const int bottom = std::min(image.height, cairo_image_surface_get_height(surface_.get()) - top);
  for (int row = std::max(0, -top); row < bottom; ++row) {
    for (int column = std::max(0, -left); column < right; ++column) {
      const std::uint8_t* rgb =
          image.pixels.data() + 3 * (std::ptrdiff_t{row} * image.width + column);
      std::reverse_copy(rgb, rgb + 3,
                        bytes + (top + row) * stride + 4 * std::ptrdiff_t{left + column});
    }
  }
  cairo_surface_mark_dirty(surface_.get());
}

Image CairoCanvas::image() const {
  cairo_surface_flush(surface_.get());
  check(cairo_status(context_.get()), "a picture");
  Image image{cairo_image_surface_get_width(surface_.get()),
              cairo_image_surface_get_height(surface_.get()),
              {}};
  const auto* bytes = cairo_image_surface_get_data(surface_.get());
  const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface_.get());
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const auto* pixel = bytes + row * stride + 4 * std::ptrdiff_t{column};
      std::reverse_copy(pixel, pixel + 3, std::back_inserter(image.pixels));
    }
  }
  return image;
}

double text_width(cairo_t* context, const std::string& text, double size) {
  cairo_select_font_face(context, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  cairo_set_font_size(context, size);
  cairo_text_extents_t extents;
  cairo_text_extents(context, text.c_str(), &extents);
  return extents.x_advance;
}

void set_ink(cairo_t* context) { cairo_set_source_rgb(context, 0.15, 0.15, 0.15); }

void draw_text(cairo_t* context, const std::string& text, double x, double y, double size,
               Anchor anchor) {
  const double width = text_width(context, text, size);  // chooses the font too
  const double share = anchor == Anchor::left ? 0 : anchor == Anchor::middle ? 0.5 : 1;
  set_ink(context);
  cairo_move_to(context, x - share * width, y);
  cairo_show_text(context, text.c_str());
}

}  // namespace qjulia::canvas

#include "picture/cairo_canvas.hpp"
#include "qjulia/error.hpp"
#include "qjulia/picture.hpp"

namespace qjulia {

Image captioned(const Image& image, const std::string& text) {
  if (image.pixels.empty()) throw InputError("a picture without pixels cannot be captioned");
  const double size = std::max(11.0, image.width / 24.0);
  CairoCanvas canvas(image.width, image.height + static_cast<int>(2 * size));
  canvas.put(image, 0, 0);
  cairo_set_source_rgb(canvas.context(), 0.15, 0.15, 0.15);
  draw_text(canvas.context(), text, 0.5 * image.width, image.height + 1.35 * size, size,
            Anchor::middle);
  return canvas.image();
}

}  // namespace qjulia

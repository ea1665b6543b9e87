#pragma once
/// Text and lines on pictures, drawn by Cairo.

#include <cairo.h>

#include <memory>
#include <string>

#include "qjulia/picture/picture.hpp"

namespace qjulia::canvas {

struct CairoDeleter {
  void operator()(cairo_t* context) const { cairo_destroy(context); }
  void operator()(cairo_surface_t* surface) const { cairo_surface_destroy(surface); }
};
using CairoContext = std::unique_ptr<cairo_t, CairoDeleter>;
using CairoSurface = std::unique_ptr<cairo_surface_t, CairoDeleter>;

/// @throws Error when Cairo has met one: `what` says where.
void check(cairo_status_t status, const char* what);

/// Pixels to draw on, white at first.
class CairoCanvas {
 public:
  CairoCanvas(int width, int height);
  cairo_t* context() const { return context_.get(); }
  /// Copies `image` to these coordinates; what lies beyond the canvas is left out.
  void put(const Image& image, int left, int top);
  Image image() const;

 private:
  CairoSurface surface_;
  CairoContext context_;
};

/// How far a line of text reaches, pixels.
double text_width(cairo_t* context, const std::string& text, double size);

enum class Anchor { left, middle, right };

/// Chooses the colour of text, lines and ticks.
void set_ink(cairo_t* context);

/// A line of text in the ink's colour. Its baseline begins, has its middle or ends at (x, y),
/// pixels.
void draw_text(cairo_t* context, const std::string& text, double x, double y, double size,
               Anchor anchor = Anchor::left);

}  // namespace qjulia::canvas

#include "report/plot.hpp"

#include <cairo-svg.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "canvas/cairo_canvas.hpp"
#include "qjulia/base/error.hpp"
#include "report/plot_labels.hpp"

namespace qjulia::report {

using namespace canvas;
namespace {

constexpr double kFont = 13, kLeft = 74, kRight = 18, kTop = 34, kBottom = 50;
constexpr int kMostTicks = 8;

/// Okabe and Ito's colours, which colour-blind readers tell apart.
constexpr std::array<std::array<double, 3>, 6> kColors{{{0.00, 0.45, 0.70},
                                                        {0.84, 0.37, 0.00},
                                                        {0.00, 0.62, 0.45},
                                                        {0.80, 0.47, 0.65},
                                                        {0.34, 0.71, 0.91},
                                                        {0.90, 0.62, 0.00}}};

/// Larger numbers are not drawn; nor, on a logarithmic axis, are those nearer to 0 than the
/// inverse.
constexpr double kMostShown = 1e100;

bool shown(const PlotAxis& axis, double value) {
  return std::abs(value) <= kMostShown && (!axis.logarithmic || value >= 1 / kMostShown);
}

/// Where values lie along an axis: from 0 at its low end to 1.
class Scale {
 public:
  Scale(const PlotAxis& axis, const std::vector<PlotSeries>& series,
        std::vector<double> PlotSeries::*values)
      : axis_(axis) {
    if (axis.range) {
      std::tie(low_, high_) = *axis.range;
      return;
    }
    bool any = false;
    for (const PlotSeries& s : series) {
      for (const double value : s.*values) {
        if (!shown(axis, value)) continue;
        low_ = any ? std::min(low_, value) : value;
        high_ = any ? std::max(high_, value) : value;
        any = true;
      }
    }
    if (!any) low_ = 1, high_ = 10;
    // Room around, and some extent where all values are one.
    if (axis.logarithmic) {
      const double room = std::max(1.05, std::pow(high_ / low_, 0.04));
      low_ /= room, high_ *= room;
    } else {
      const double room = high_ > low_ ? 0.04 * (high_ - low_) : std::max(1e-9, std::abs(low_));
      low_ -= room, high_ += room;
    }
  }

  double at(double value) const {
    if (axis_.logarithmic) return std::log(value / low_) / std::log(high_ / low_);
    return (value - low_) / (high_ - low_);
  }
  std::vector<double> ticks() const { return plot_ticks(low_, high_, axis_.logarithmic); }

 private:
  const PlotAxis& axis_;
  double low_ = 0, high_ = 1;
};

/// A name beside its point, with a line to it where it could not stand close by.
void draw_name(cairo_t* context, PlotLabels& labels, const std::string& name, double x, double y) {
  const LabelBox box = labels.place(x, y, text_width(context, name, kFont), kFont);
  const double near_x = std::clamp(x, box.left, box.right());
  const double near_y = std::clamp(y, box.top, box.bottom());
  constexpr double kClose = 12;
  if (std::hypot(near_x - x, near_y - y) > kClose) {
    set_ink(context);
    cairo_set_line_width(context, 0.7);
    cairo_move_to(context, x, y);
    cairo_line_to(context, near_x, near_y);
    cairo_stroke(context);
  }
  draw_text(context, name, box.left, box.bottom() - 0.2 * kFont, kFont);
}

/// A plot while it is drawn.
class Drawing {
 public:
  Drawing(cairo_t* context, const Plot& plot) : context_(context), plot_(plot) {}

  void draw() {
    draw_grid();
    draw_titles();
    draw_series();
    draw_legend();
    draw_names();
  }

 private:
  double place_x(double value) const { return kLeft + wide_ * x_.at(value); }
  double place_y(double value) const { return kTop + high_ * (1 - y_.at(value)); }
  /// A point's place; none where it is not shown.
  std::optional<Eigen::Vector2d> place(const PlotSeries& s, std::size_t i) const {
    if (!shown(plot_.x, s.x[i]) || !shown(plot_.y, s.y[i])) return std::nullopt;
    return Eigen::Vector2d(place_x(s.x[i]), place_y(s.y[i]));
  }
  void use_color(std::size_t series) {
    const auto& [red, green, blue] = kColors[series % kColors.size()];
    cairo_set_source_rgb(context_, red, green, blue);
  }
  void draw_grid_line(double x0, double y0, double x1, double y1) {
    cairo_set_source_rgb(context_, 0.86, 0.86, 0.86);
    cairo_move_to(context_, x0, y0);
    cairo_line_to(context_, x1, y1);
    cairo_stroke(context_);
  }

  void draw_grid() {
    cairo_set_line_width(context_, 1);
    for (const double tick : x_.ticks()) {
      draw_grid_line(place_x(tick), kTop, place_x(tick), kTop + high_);
      draw_text(context_, fmt::format("{:.6g}", tick), place_x(tick), kTop + high_ + 1.4 * kFont,
                kFont, Anchor::middle);
    }
    for (const double tick : y_.ticks()) {
      draw_grid_line(kLeft, place_y(tick), kLeft + wide_, place_y(tick));
      draw_text(context_, fmt::format("{:.6g}", tick), kLeft - 6, place_y(tick) + 0.35 * kFont,
                kFont, Anchor::right);
    }
  }

  void draw_titles() {
    set_ink(context_);
    cairo_rectangle(context_, kLeft, kTop, wide_, high_);
    cairo_stroke(context_);
    draw_text(context_, plot_.title, kLeft, 0.65 * kTop, 1.15 * kFont);
    draw_text(context_, plot_.x.label, kLeft + 0.5 * wide_, plot_.height - 0.7 * kFont, kFont,
              Anchor::middle);
    cairo_save(context_);
    cairo_translate(context_, 1.2 * kFont, kTop + 0.5 * high_);
    cairo_rotate(context_, -0.5 * std::numbers::pi);
    draw_text(context_, plot_.y.label, 0, 0, kFont, Anchor::middle);
    cairo_restore(context_);
  }

  void draw_series() {
    cairo_save(context_);
    cairo_rectangle(context_, kLeft, kTop, wide_, high_);
    cairo_clip(context_);
    for (std::size_t k = 0; k < plot_.series.size(); ++k) {
      const PlotSeries& s = plot_.series[k];
      use_color(k);
      cairo_set_line_width(context_, 1.8);
      bool drawing = false;
      for (std::size_t i = 0; i < s.x.size(); ++i) {
        const auto p = place(s, i);
        if (p && s.line) (drawing ? cairo_line_to : cairo_move_to)(context_, p->x(), p->y());
        drawing = p.has_value();
      }
      cairo_stroke(context_);
      for (std::size_t i = 0; s.points && i < s.x.size(); ++i) {
        const auto p = place(s, i);
        if (!p) continue;
        cairo_arc(context_, p->x(), p->y(), 3.5, 0, 2 * std::numbers::pi);
        cairo_fill(context_);
      }
    }
    cairo_restore(context_);
  }

  /// At the upper right.
  void draw_legend() {
    double row = kTop + 1.5 * kFont;
    for (std::size_t k = 0; k < plot_.series.size(); ++k) {
      if (plot_.series[k].label.empty()) continue;
      const double reach = 28 + text_width(context_, plot_.series[k].label, kFont);
      cairo_set_source_rgba(context_, 1, 1, 1, 0.8);  // lines that pass behind grow faint
      cairo_rectangle(context_, kLeft + wide_ - reach - 4, row - kFont, reach - 1, 1.4 * kFont);
      cairo_fill(context_);
      use_color(k);
      cairo_rectangle(context_, kLeft + wide_ - 22, row - 0.5 * kFont, 14, 4);
      cairo_fill(context_);
      draw_text(context_, plot_.series[k].label, kLeft + wide_ - 28, row, kFont, Anchor::right);
      for (const double y : {row, row - 0.8 * kFont}) {
        names_.keep_clear(kLeft + wide_ - reach, y, kLeft + wide_, y);
      }
      row += 1.5 * kFont;
    }
  }

  void draw_names() {
    for (const PlotSeries& s : plot_.series) {
      for (std::size_t i = 0; i < s.x.size(); ++i) {
        const auto p = place(s, i);
        if (!p) continue;
        names_.keep_clear(p->x(), p->y());
        const auto before = s.line && i > 0 ? place(s, i - 1) : std::nullopt;
        if (before) names_.keep_clear(before->x(), before->y(), p->x(), p->y());
      }
    }
    for (const PlotSeries& s : plot_.series) {
      for (std::size_t i = 0; i < s.names.size(); ++i) {
        if (const auto p = place(s, i)) draw_name(context_, names_, s.names[i], p->x(), p->y());
      }
    }
  }

  cairo_t* context_;
  const Plot& plot_;
  Scale x_{plot_.x, plot_.series, &PlotSeries::x}, y_{plot_.y, plot_.series, &PlotSeries::y};
  double wide_ = plot_.width - kLeft - kRight, high_ = plot_.height - kTop - kBottom;
  /// Names stand clear of the legend, lines, points and each other.
  PlotLabels names_{{kLeft, kTop, wide_, high_}};
};

cairo_status_t append(void* text, const unsigned char* bytes, unsigned int count) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(bytes), count);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

void Plot::validate() const {
  if (width < 200 || height < 150 || width > 16384 || height > 16384) {
    throw InputError(
        fmt::format("a plot of {} x {} pixels: give 200 x 150 or more", width, height));
  }
  for (const PlotSeries& s : series) {
    if (s.x.size() != s.y.size()) {
      throw InputError(
          fmt::format("plot series '{}' has {} x and {} y", s.label, s.x.size(), s.y.size()));
    }
    if (s.names.size() > s.x.size()) {
      throw InputError(fmt::format("plot series '{}' has {} names of {} points", s.label,
                                   s.names.size(), s.x.size()));
    }
  }
  for (const PlotAxis* axis : {&x, &y}) {
    if (!axis->range) continue;
    const auto [low, high] = *axis->range;
    if (!(low < high) || !shown(*axis, low) || !shown(*axis, high)) {
      throw InputError(
          fmt::format("plot axis '{}' from {} to {} cannot be drawn", axis->label, low, high));
    }
  }
}

std::vector<double> plot_ticks(double low, double high, bool logarithmic) {
  std::vector<double> ticks;
  const bool is_drawn = low < high && std::isfinite(high - low) && (!logarithmic || low > 0);
  if (!is_drawn) return ticks;
  if (logarithmic) {
    const int first = static_cast<int>(std::floor(std::log10(low)));
    const int last = static_cast<int>(std::ceil(std::log10(high)));
    const int apart = 1 + (last - first) / kMostTicks;
    for (int power = first; power <= last; power += apart) {
      const double unit = std::pow(10.0, power);
      for (const double part : {1.0, 2.0, 5.0}) {
        if (part > 1 && last - first > 3) continue;
        if (unit * part >= low && unit * part <= high) ticks.push_back(unit * part);
      }
    }
    return ticks;
  }
  const double unit = std::pow(10.0, std::floor(std::log10((high - low) / kMostTicks)));
  double step = unit;
  for (const double part : {1.0, 2.0, 5.0, 10.0}) {
    step = unit * part;
    if ((high - low) / step <= kMostTicks) break;
  }
  // Adding 0 makes -0 positive.
  const double first = std::ceil(low / step);
  for (int k = 0; k <= kMostTicks && (first + k) * step <= high; ++k) {
    ticks.push_back((first + k) * step + 0.0);
  }
  return ticks;
}

Image draw_plot(const Plot& plot) {
  plot.validate();
  const CairoCanvas canvas(plot.width, plot.height);
  Drawing(canvas.context(), plot).draw();
  return canvas.image();
}

std::string plot_svg(const Plot& plot) {
  plot.validate();
  std::string text;
  {
    const CairoSurface surface(
        cairo_svg_surface_create_for_stream(append, &text, plot.width, plot.height));
    const CairoContext context(cairo_create(surface.get()));
    Drawing(context.get(), plot).draw();
    check(cairo_status(context.get()), "a plot");
    cairo_surface_finish(surface.get());
    check(cairo_surface_status(surface.get()), "a plot");
  }
  return text;
}

}  // namespace qjulia::report

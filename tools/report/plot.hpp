#pragma once
/// Small plots: lines and points over linear or logarithmic axes.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "qjulia/picture/picture.hpp"

namespace qjulia::report {

struct PlotAxis {
  std::string label;
  bool logarithmic = false;                        ///< values that are not positive are left out
  std::optional<std::pair<double, double>> range;  ///< default: what holds all values
};

struct PlotSeries {
  std::string label;  ///< in the legend; none when empty
  std::vector<double> x, y;
  bool line = true;
  bool points = false;
  std::vector<std::string> names{};  ///< the points', in their order; points without one have none
};

struct Plot {
  std::string title;
  PlotAxis x, y;
  std::vector<PlotSeries> series;
  int width = 800;
  int height = 500;
  /// @throws InputError: no size, series whose x and y differ in number, more names than points, an
  /// empty range, or a
  ///   logarithmic one that is not positive.
  void validate() const;
};

/// Round places along an axis, few enough to be labelled: 1, 2 or 5 times a power of ten apart, or
/// on a logarithmic axis powers of ten, and where these are fewer than three, 2 and 5 times them.
/// Empty when there is no such axis, because `low` is not below `high` or one is not finite.
std::vector<double> plot_ticks(double low, double high, bool logarithmic);

/// The plot as pixels. Lines break at values that are not finite or beyond ±1e100.
/// @throws InputError
Image draw_plot(const Plot& plot);

/// The plot as the text of an SVG file, to stand in a page. @throws InputError
std::string plot_svg(const Plot& plot);

}  // namespace qjulia::report

// Plots: ticks, places, and what is refused.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <regex>

#include "qjulia/base/error.hpp"
#include "report/plot.hpp"
#include "report/plot_labels.hpp"

using namespace qjulia;
using namespace qjulia::report;

namespace {

/// Columns and rows of the pixels of the first series' colour, (0, 115, 179), nearly.
std::vector<std::array<int, 2>> blue_pixels(const Image& image) {
  std::vector<std::array<int, 2>> places;
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const auto* rgb = image.pixels.data() + 3 * (std::ptrdiff_t{row} * image.width + column);
      if (rgb[0] < 20 && rgb[1] > 100 && rgb[1] < 130 && rgb[2] > 165 && rgb[2] < 195) {
        places.push_back({column, row});
      }
    }
  }
  return places;
}

Plot one_point(double x, double y) {
  Plot plot;
  plot.x.range = plot.y.range = {1, 100};
  plot.series = {{"", {x}, {y}, false, true}};
  return plot;
}

}  // namespace

TEST_CASE("ticks are round and few") {
  CHECK(plot_ticks(0.1, 1.05, false).size() <= 8);
  const auto linear = plot_ticks(-1, 9, false);
  CHECK_FALSE(std::signbit(plot_ticks(-0.1, 5, false).front()));
  CHECK(linear.front() == Catch::Approx(0).margin(1e-12));
  CHECK(linear[1] - linear[0] == Catch::Approx(2));
  CHECK(plot_ticks(1, 1000, true) == std::vector<double>{1, 2, 5, 10, 20, 50, 100, 200, 500, 1000});
  const auto wide = plot_ticks(1e-9, 1e9, true);
  CHECK(wide.size() >= 3);
  CHECK(wide.size() <= 8);
}

TEST_CASE("a point lies where its axes say") {
  const auto middle_of = [](const Plot& plot) {
    double x = 0, y = 0;
    const auto pixels = blue_pixels(draw_plot(plot));
    REQUIRE(pixels.size() > 10);
    REQUIRE(pixels.size() < 100);
    for (const auto& [column, row] : pixels) x += column, y += row;
    return std::pair{x / static_cast<double>(pixels.size()),
                     y / static_cast<double>(pixels.size())};
  };
  Plot plot = one_point(50.5, 50.5);
  const auto centre = middle_of(plot);
  // Half way along a logarithmic axis from 1 to 100 stands 10.
  plot.x.logarithmic = plot.y.logarithmic = true;
  plot.series[0].x = plot.series[0].y = {10};
  const auto same = middle_of(plot);
  CHECK(same.first == Catch::Approx(centre.first).margin(1));
  CHECK(same.second == Catch::Approx(centre.second).margin(1));
  // Greater is to the right and up.
  plot.series[0].x = plot.series[0].y = {50};
  CHECK(middle_of(plot).first > centre.first + 50);
  CHECK(middle_of(plot).second < centre.second - 50);
}

TEST_CASE("values that cannot be drawn are left out") {
  Plot plot = one_point(10, std::numeric_limits<double>::quiet_NaN());
  CHECK(blue_pixels(draw_plot(plot)).empty());
  plot.y.logarithmic = true;
  plot.series[0].y = {-3};
  CHECK(blue_pixels(draw_plot(plot)).empty());
  plot.x.range.reset();
  plot.y.range.reset();
  CHECK_NOTHROW(draw_plot(plot));
}

TEST_CASE("an SVG has its points and lines where the pixels have them") {
  Plot plot = one_point(30, 80);
  plot.series[0].x.push_back(60);
  plot.series[0].y.push_back(80);
  const Image image = draw_plot(plot);
  const auto pixels = blue_pixels(image);
  const std::string svg = plot_svg(plot);
  CHECK_THAT(svg, Catch::Matchers::ContainsSubstring(
                      fmt::format("viewBox=\"0 0 {} {}\"", plot.width, plot.height)));
  // Colours are in a style (cairo 1.16) or in attributes (1.18).
  const std::string color = "(?::|=\")rgb\\(0%, ?45%, ?70%\\)";
  // Each point is a filled circle of radius 3.5, begun at its right.
  const std::regex circle("fill" + color + "[^>]* d=\"M ([0-9.]+) ([0-9.]+) C");
  std::vector<std::array<double, 2>> centers;
  for (std::sregex_iterator match(svg.begin(), svg.end(), circle), end; match != end; ++match) {
    centers.push_back({std::stod((*match)[1]) - 3.5, std::stod((*match)[2])});
  }
  REQUIRE(centers.size() == 2);
  for (const auto& [column, row] : pixels) {
    const auto distance = [&](const auto& center) {
      return std::hypot(column + 0.5 - center[0], row + 0.5 - center[1]);
    };
    CHECK(std::min(distance(centers[0]), distance(centers[1])) < 4.5);
  }
  CHECK(centers[0][0] < centers[1][0]);
  CHECK(centers[0][1] == centers[1][1]);
  const std::regex stroke("[ ;]stroke" + color);
  CHECK_FALSE(std::regex_search(svg, stroke));
  plot.series[0].line = true;
  CHECK(std::regex_search(plot_svg(plot), stroke));
}

TEST_CASE("plots that make no sense are refused") {
  Plot plot = one_point(10, 10);
  plot.series[0].y.push_back(3);
  CHECK_THROWS_AS(draw_plot(plot), InputError);
  plot = one_point(10, 10);
  plot.x.range = {5, 5};
  CHECK_THROWS_AS(draw_plot(plot), InputError);
  plot.x.range = {-1, 5};
  CHECK_NOTHROW(draw_plot(plot));
  plot.x.logarithmic = true;
  CHECK_THROWS_AS(draw_plot(plot), InputError);
  plot = one_point(10, 10);
  plot.series[0].names = {"a", "b"};
  CHECK_THROWS_AS(draw_plot(plot), InputError);
  plot = one_point(10, 10);
  plot.width = 0;
  CHECK_THROWS_AS(plot_svg(plot), InputError);
}

TEST_CASE("names stand within the frame, clear of points, lines and each other") {
  const LabelBox frame{0, 0, 400, 300};
  PlotLabels labels(frame);
  for (int x = 0; x < 400; x += 3) labels.keep_clear(x, 100);
  for (int i = 0; i < 8; ++i) labels.keep_clear(200 + i, 110);
  std::vector<LabelBox> boxes;
  for (int i = 0; i < 8; ++i) boxes.push_back(labels.place(200 + i, 110, 90, 13));
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const LabelBox& a = boxes[i];
    CHECK(a.left >= 0);
    CHECK(a.right() <= 400);
    CHECK(a.bottom() <= 300);
    CHECK((a.bottom() < 100 || a.top > 100));
    CHECK_FALSE((a.left < 200 && a.right() > 200 && a.top < 110 && a.bottom() > 110));
    for (std::size_t j = 0; j < i; ++j) {
      const LabelBox& b = boxes[j];
      CHECK((a.right() <= b.left || b.right() <= a.left || a.bottom() <= b.top ||
             b.bottom() <= a.top));
    }
  }
  // At the right edge a name stands to the left.
  CHECK(PlotLabels(frame).place(395, 200, 50, 13).right() <= 395);
}

TEST_CASE("a named point has its name beside it") {
  Plot plot = one_point(10, 10);
  plot.x.range = plot.y.range = {0, 20};
  const Image bare = draw_plot(plot);
  plot.series[0].names = {"here"};
  const Image named = draw_plot(plot);
  int changed = 0, far_off = 0;
  const double x = 0.5 * (74 + plot.width - 18), y = 0.5 * (34 + plot.height - 50);
  for (int row = 0; row < named.height; ++row) {
    for (int column = 0; column < named.width; ++column) {
      const auto at = static_cast<std::size_t>(3 * (std::ptrdiff_t{row} * named.width + column));
      if (named.pixels[at] == bare.pixels[at]) continue;
      ++changed;
      far_off += std::abs(column - x) > 60 || std::abs(row - y) > 20;
    }
  }
  CHECK(changed > 20);
  CHECK(far_off == 0);
}

TEST_CASE("no number that a plot may get does harm") {
  for (const double x :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e300,
        -1e300, -1.0, 0.0, 1e-300}) {
    CAPTURE(x);
    for (const bool logarithmic : {false, true}) {
      CHECK(plot_ticks(x, 1, logarithmic).size() < 40);
      CHECK(plot_ticks(1, x, logarithmic).size() < 40);
      CHECK(plot_ticks(x, x * (1 + 1e-15), logarithmic).size() < 40);
      Plot plot;
      plot.series = {{"a", {x, 1, 2}, {x, x, 1}}};
      plot.x.logarithmic = plot.y.logarithmic = logarithmic;
      CHECK_NOTHROW(draw_plot(plot));
      CHECK_NOTHROW(plot_svg(plot));
    }
  }
}

TEST_CASE("a text that is no UTF-8 is refused") {
  Plot plot = one_point(10, 10);
  plot.title = "a\xff title";
  CHECK_THROWS_AS(draw_plot(plot), Error);
  CHECK_THROWS_AS(plot_svg(plot), Error);
}

// Pictures of the unit ball, which q² has for its filled Julia set, against closed forms.

#include <Eigen/Geometry>
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "armed_ball.hpp"
#include "device/context.hpp"
#include "distance_map.hpp"
#include "layout/picture_layout.h"
#include "map/reference_iteration.hpp"
#include "picture/band_grid.hpp"
#include "picture/depth_source.hpp"
#include "picture/ground_light.hpp"
#include "picture/image_lattice.hpp"
#include "png_file.hpp"
#include "qjulia/detail.hpp"
#include "qjulia/field.hpp"
#include "qjulia/picture.hpp"
#include "qjulia/surface.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"
#include "worse.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

RationalMap square() {
  RationalMap map;
  map.factors = {Factor{{0, 0, 0, 0}, 2}};
  map.box = Box{Vector3d::Constant(-1), Vector3d::Constant(1)};
  return map;
}

Device with_width(int width) { return test::device().with_lane_width(width); }

picture::View ball_view(int width, int height, int samples) {
  return picture::camera_view({}, *square().box, width, height, samples);
}

Vector3d direction(const picture::View& view, int column, int row) {
  return (view.dir + (column + 0.5) * view.dir_dx + (row + 0.5) * view.dir_dy).normalized();
}

/// Depth at which a pixel's ray meets the unit sphere; negative where it passes by.
double sphere_depth(const picture::View& view, int column, int row) {
  const Vector3d d = direction(view, column, row);
  const double middle = -view.eye.dot(d);
  const double half2 = middle * middle - view.eye.squaredNorm() + 1;
  return half2 < 0 ? -1 : middle - std::sqrt(half2);
}

PictureOptions small(int width, int height) {
  PictureOptions options;
  options.width = width;
  options.height = height;
  return options;
}

}  // namespace

TEST_CASE("rays meet the ball where they must, at every lane width") {
  for (const int width : test::lane_widths()) {
    for (const int iterations : {1, 6}) {
      CAPTURE(width, iterations);
      const auto source = picture::march_source(with_width(width),
                                                {square(), iterations, {}, {}, Precision::single});
      const picture::View view = ball_view(101, 67, 1);
      const auto depths = source->depths(view, 0, view.rows);
      REQUIRE(depths.size() == 101 * 67);
      int hits = 0, wrong = 0;
      double worst = 0;
      for (int row = 0; row < view.rows; ++row) {
        for (int column = 0; column < view.columns; ++column) {
          const double found = depths[static_cast<std::size_t>(row * view.columns + column)];
          const double expected = sphere_depth(view, column, row);
          if (found >= 0) ++hits;
          if ((found >= 0) != (expected >= 0)) {
            ++wrong;
          } else if (expected >= 0) {
            const double slope = std::abs((view.eye + expected * direction(view, column, row))
                                              .dot(direction(view, column, row)));
            worst = test::worse(worst, std::abs(found - expected) * slope);
          }
        }
      }
      // Rays that graze the ball inside one step's reach may pass it by.
      CHECK(wrong <= 0.01 * hits);
      CHECK(worst < view.tolerance);
    }
  }
}

TEST_CASE("a ball's silhouette is the ellipse that perspective makes of it") {
  // The ball stands in a corner of what is framed, off the picture's middle.
  RationalMap map = square();
  map.box = Box{{-1, -1, -1}, {4, 2.5, 1.5}};
  const auto [width, iterations] = GENERATE(table<int, int>({{1, 6}, {8, 6}, {16, 1}, {16, 6}}));
  if (std::ranges::count(test::lane_widths(), width) == 0) return;
  CAPTURE(width, iterations);
  PictureOptions options = small(320, 240);
  options.iterations = iterations;
  options.samples_per_axis = 1;
  const Image image = render(with_width(width), map, options);

  // The rays that meet the ball fill a cone of half angle α about the direction of its centre, at
  // an angle θ to the view's axis. A plane at distance 1 cuts the cone in an ellipse of half axes
  // sin α cos α / (cos²θ − sin²α) and sin α / √(cos²θ − sin²α).
  const picture::View view = picture::camera_view(options.camera, *map.box, 320, 240, 1);
  const Vector3d axis = (view.dir + 160 * view.dir_dx + 120 * view.dir_dy).normalized();
  const double sine2 = 1 / view.eye.squaredNorm();
  const double cosine_to_axis = axis.dot(-view.eye.normalized());
  CHECK(std::acos(cosine_to_axis) > 0.09);
  const double apart = cosine_to_axis * cosine_to_axis - sine2;
  const double area = std::numbers::pi * sine2 * std::sqrt(1 - sine2) / std::pow(apart, 1.5) /
                      view.dir_dx.squaredNorm();
  CHECK(static_cast<double>(image.covered) == Approx(area).epsilon(0.01));
}

TEST_CASE("a pixel's depth depends neither on the strip it is asked for in nor on lane width") {
  const auto source =
      picture::march_source(with_width(8), {square(), 6, {}, {}, Precision::single});
  const auto other =
      picture::march_source(with_width(16), {square(), 6, {}, {}, Precision::single});
  const picture::View view = ball_view(37, 29, 2);
  const auto whole = source->depths(view, 0, view.rows);
  std::vector<float> strips;
  for (int row = 0; row < view.rows; row += 7) {
    const auto strip = source->depths(view, row, std::min(7, view.rows - row));
    strips.insert(strips.end(), strip.begin(), strip.end());
  }
  CHECK(strips == whole);
  const auto wider = other->depths(view, 0, view.rows);
  int differ = 0;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (std::abs(whole[i] - wider[i]) > 2 * view.tolerance) ++differ;
  }
  CHECK(differ <= 2);
}

TEST_CASE("refined samples lie on the ball") {
  const auto source =
      picture::march_source(with_width(16), {square(), 6, {}, {}, Precision::single});
  const picture::View view = ball_view(80, 60, 2);
  const auto depths = source->depths(view, 0, view.rows);
  double worst = 0;
  int hits = 0;
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.columns; ++column) {
      const double t = depths[static_cast<std::size_t>(row * view.columns + column)];
      if (t < 0) continue;
      ++hits;
      worst =
          test::worse(worst, std::abs((view.eye + t * direction(view, column, row)).norm() - 1));
    }
  }
  CHECK(hits > 1000);
  CHECK(worst < 0.5 * view.footprint);
}

TEST_CASE("rays in double precision find the ball's depths as well") {
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const Device device = with_width(width);
    if (!test::can_check(device, Precision::dbl)) return;
    const picture::View view = ball_view(61, 47, 1);
    const auto depths = picture::march_source(device, {square(), 6, {}, {}, Precision::dbl})
                            ->depths(view, 0, view.rows);
    const auto single = picture::march_source(device, {square(), 6, {}, {}, Precision::single})
                            ->depths(view, 0, view.rows);
    int wrong = 0;
    for (std::size_t i = 0; i < depths.size(); ++i) {
      if ((depths[i] >= 0) != (single[i] >= 0)) ++wrong;
      if (std::abs(depths[i] - single[i]) > 2 * view.tolerance) ++wrong;
    }
    // Rays that graze the ball.
    CHECK(wrong < 5);
    CHECK(depths != single);
  }
}

TEST_CASE("a part of the ball is cut open at the faces of its box") {
  // The half behind z = 0.25, seen from the front: the cut's flat face, then the ball's rest.
  const Box part{{-2, -2, -2}, {2, 2, 0.25}};
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const auto source =
        picture::march_source(with_width(width), {square(), 6, {}, part, Precision::single});
    picture::View view = picture::parallel_view(Vector3d::UnitZ(), *square().box, 64);
    for (const bool coarse : {false, true}) {
      view.coarse_will_do = coarse;
      const auto depths = source->depths(view, 0, view.rows);
      int on_cut = 0, beyond = 0;
      double worst = 0;
      for (int row = 0; row < view.rows; ++row) {
        for (int column = 0; column < view.columns; ++column) {
          const Vector3d eye = view.eye + (column + 0.5) * view.eye_dx + (row + 0.5) * view.eye_dy;
          const double aside = std::hypot(eye.x(), eye.y());
          if (aside > 0.9) continue;
          const double depth = depths[static_cast<std::size_t>(row * view.columns + column)];
          const double z = eye.z() - depth;
          if (depth >= 0 && z > -0.5) ++on_cut;
          worst = test::worse(worst, std::abs(z - 0.25));
          if (z > 0.27) ++beyond;
        }
      }
      CHECK(on_cut > 1500);
      CHECK(beyond == 0);
      CHECK(worst < (coarse ? 0.05 : 1e-3));
    }
    CHECK(source->bounds().high.z() == 0.25);
  }
}

namespace {

/// |q|³ |q − 2| in logarithms: about the origin a body, and about (2, 0, 0) a ball with 0.4 % of
/// its volume.
RationalMap body_and_flake() {
  RationalMap map;
  map.factors = {Factor{{0, 0, 0, 0}, 3}, Factor{{2, 0, 0, 0}, 1}};
  map.box = Box{{-1, -1, -1}, {2.2, 1, 1}};
  return map;
}

/// Depth at which a ray enters the body or, where it is seen, the flake; negative where it does
/// not. By short steps in double precision.
double entered(const Vector3d& eye, const Vector3d& d, bool sees_flake) {
  const auto is_inside = [&](double t) {
    const Vector3d p = eye + t * d;
    const double flake = (p - Vector3d(2, 0, 0)).norm();
    return std::pow(p.norm(), 3) * flake < 1 && (sees_flake || p.x() < 1.4);
  };
  const double middle = -eye.dot(d), step = 0.002;
  for (double t = std::max(0.0, middle - 3); t < middle + 3; t += step) {
    if (!is_inside(t)) continue;
    double low = t - step, high = t;
    for (int i = 0; i < 30; ++i) (is_inside(0.5 * (low + high)) ? high : low) = 0.5 * (low + high);
    return high;
  }
  return -1;
}

/// Views of a body and its flake, of `side` × `side` rays, against short steps.
void check_flake(const Device& device, const picture::MarchedSet& set, const Vector3d& from,
                 int side) {
  const auto source = picture::march_source(device, set);
  CHECK(source->loose_pieces().count == (set.keeps_loose ? 0 : 1));
  picture::View view = picture::parallel_view(from, *set.map.box, side);
  for (const bool coarse : {false, true}) {
    CAPTURE(device.info().name, to_string(set.precision), set.keeps_loose, from.x(), coarse);
    view.coarse_will_do = coarse;
    const auto depths = source->depths(view, 0, view.rows);
    int hits = 0, wrong = 0, on_flake = 0;
    double worst = 0;
    for (int row = 0; row < view.rows; ++row) {
      for (int column = 0; column < view.columns; ++column) {
        const Vector3d eye = view.eye + (column + 0.5) * view.eye_dx + (row + 0.5) * view.eye_dy;
        const Vector3d d = direction(view, column, row);
        const double expected = entered(eye, d, set.keeps_loose);
        const double found = depths[static_cast<std::size_t>(row * view.columns + column)];
        if (found >= 0) ++hits;
        if (found >= 0 && (eye + found * d).x() > 1.4) ++on_flake;
        if ((found >= 0) != (expected >= 0)) {
          ++wrong;
        } else if (found >= 0) {
          worst = test::worse(worst, std::abs(found - expected));
        }
      }
    }
    CHECK(hits > 0.04 * side * side);
    // Rays that graze what they meet.
    CHECK(wrong <= 2 + 0.02 * hits);
    CHECK((on_flake > 0) == set.keeps_loose);
    if (!coarse) CHECK(worst < 0.3);
  }
}

}  // namespace

TEST_CASE("rays pass through loose pieces, and meet what is behind them") {
  for (const int width : test::lane_widths()) {
    const Device device = with_width(width);
    for (const Precision precision : {Precision::single, Precision::dbl}) {
      if (!test::can_check(device, precision)) continue;
      for (const bool keeps : {false, true}) {
        picture::MarchedSet set{body_and_flake(), 1, {}, {}, precision};
        set.keeps_loose = keeps;
        for (const Vector3d& from : {Vector3d(1, 0, 0), Vector3d(0, 0, 1)}) {
          check_flake(device, set, from, 96);
        }
      }
    }
  }
}

TEST_CASE("a few rays pass through a loose piece that a coarse grid shows") {
  for (const int width : test::lane_widths()) {
    picture::MarchedSet set{body_and_flake(), 1, {}, {}, Precision::single};
    set.keeps_loose = false;
    set.cells = 12;
    check_flake(with_width(width), set, {1, 0, 0}, 12);
  }
}

TEST_CASE("a part of the set has the loose pieces that the whole has") {
  const RationalMap map = body_and_flake();
  // The flake alone; and half of the body without the flake.
  for (const bool keeps : {false, true}) {
    picture::MarchedSet set{map, 1, {}, Box{{1.5, -1, -1}, {3, 1, 1}}, Precision::single};
    set.keeps_loose = keeps;
    const auto alone = picture::march_source(with_width(8), set);
    const picture::View view = picture::parallel_view({1, 0, 0}, *map.box, 64);
    const auto depths = alone->depths(view, 0, view.rows);
    CHECK((std::ranges::max(depths) >= 0) == keeps);
    set.part = Box{{-2, -2, -2}, {0, 2, 2}};
    const auto half = picture::march_source(with_width(8), set);
    const auto cut = half->depths(view, 0, view.rows);
    CHECK(std::ranges::count_if(cut, [](float d) { return d >= 0; }) > 500);
  }
}

TEST_CASE("pictures without loose pieces hide nothing else") {
  const Device device = test::device();
  PictureOptions options = small(80, 60);
  options.samples_per_axis = 1;
  PictureLayers without, with;
  const Image plain = render(device, square(), options);
  options.keep_loose = true;
  CHECK(render(device, square(), options).pixels == plain.pixels);
  CHECK(plain.loose.count == 0);
  // Wild enough to have flakes.
  const RationalMap map = calibrated(device, steepened(test::armed_ball_map(60), 3));
  const Image all = render(device, map, options, {}, &with);
  options.keep_loose = false;
  const Image some = render(device, map, options, {}, &without);
  CHECK(all.loose.count == 0);
  CHECK(some.loose.count > 0);
  CHECK(some.loose.volume > 0);
  CHECK(some.covered < all.covered);
  CHECK(10 * some.covered > 8 * all.covered);
  int nearer = 0;
  for (std::size_t i = 0; i < with.depth.size(); ++i) {
    if (without.depth[i] < with.depth[i] - 0.02F) ++nearer;
  }
  CHECK(nearer == 0);
}

TEST_CASE("cuts show the inside, and leave the rest where it is seen") {
  const Device device = test::device();
  RationalMap map = square();
  map.shape_to_map = {2, {0, 1, 0}};  // the ball has radius 0.5 about (0, -0.5, 0)
  map.box = Box{{-0.5, -1, -0.5}, {0.5, 0, 0.5}};
  PictureOptions options = small(60, 45);
  PictureLayers whole, cut;
  render(device, map, options, {}, &whole);
  options.cuts = {{'z', 0.1, false}, {'y', 1, false}};
  const Image image = render(device, map, options, {}, &cut);
  int flat = 0, beyond = 0, elsewhere = 0;
  for (std::size_t i = 0; i < cut.depth.size(); ++i) {
    const float z = cut.position[3 * i + 2];
    if (z > 0.11F) ++beyond;
    if (std::abs(z - 0.1F) < 0.005F) ++flat;
    if (whole.position[3 * i + 2] < 0.08F && std::abs(whole.depth[i] - cut.depth[i]) > 0.01F) {
      ++elsewhere;
    }
  }
  CHECK(flat > 300);
  CHECK(beyond == 0);
  CHECK(elsewhere == 0);
  options.cuts = {{'z', 60, true}};
  CHECK(render(device, map, options).pixels == image.pixels);
  options.cuts = {{'w', 60, true}};
  CHECK_THROWS_WITH(render(device, map, options), Catch::Contains("cut: 'w'"));
  options.box = map.box;
  options.cuts = {{'x', 0, true}};
  CHECK_THROWS_WITH(render(device, map, options), Catch::Contains("cut: nothing is left"));
  options.box.reset();
  map.box.reset();
  CHECK_THROWS_WITH(render(device, map, options), Catch::Contains("give a coordinate"));
}

TEST_CASE("interpolated images give the picture that computed ones give") {
  // A distance's modulus is never interpolated, its versor is. Nor is paint.
  const auto [distance, painted] =
      GENERATE(table<bool, bool>({{false, false}, {true, false}, {false, true}}));
  RationalMap map = distance ? test::distance_map(0.1, 60) : test::armed_ball_map(60);
  if (distance) {
    for (Factor& factor : map.factors)
      factor.exponent *= 0.06;  // it turns about as fast as F rises
  } else {
    map = calibrated(test::device(), steepened(map, 12));
  }
  if (painted) {
    Paint paint;
    paint.cells = {9, 9, 9};
    paint.origin = Vector3d::Constant(-2);
    paint.step = 0.45;
    for (int i = 0; i < 729; ++i) paint.shares.push_back(painted_share(0.2 + 0.1 * (i % 9)));
    map.paint = paint;
  }
  for (const int width : test::lane_widths()) {
    const Device device = with_width(width);
    for (const Precision precision : {Precision::single, Precision::dbl}) {
      if (precision == Precision::dbl && (painted || !test::can_check(device, precision))) continue;
      CAPTURE(distance, painted, width, precision == Precision::dbl);
      picture::MarchedSet set{map, 6, {}, {}, precision};
      const picture::View view = picture::camera_view(
          {}, {map.shape_to_map.to_map(map.box->low), map.shape_to_map.to_map(map.box->high)}, 120,
          90, 1);
      const auto found = picture::march_source(device, set)->depths(view, 0, view.rows);
      set.foretells = false;
      const auto expected = picture::march_source(device, set)->depths(view, 0, view.rows);
      CHECK(found != expected);
      const auto seen = [&](int column, int row) {
        return expected[static_cast<std::size_t>(row * 120 + column)] >= 0;
      };
      int edges = 0, one = 0, hits = 0, far = 0;
      for (int row = 1; row < 89; ++row) {
        for (int column = 1; column < 119; ++column) {
          const auto i = static_cast<std::size_t>(row * 120 + column);
          const bool here = seen(column, row);
          if (here != seen(column + 1, row) || here != seen(column, row + 1)) ++edges;
          if (here != (found[i] >= 0)) ++one;
          if (here) ++hits;
          if (here && found[i] >= 0 && std::abs(found[i] - expected[i]) > view.footprint) ++far;
        }
      }
      // An eighth of a pixel is what the set may be displaced by.
      CHECK(edges > 200);
      CHECK(one <= edges / 16);
      CHECK(far <= 0.02 * hits);
    }
  }
}

TEST_CASE("a lattice trusts cells where it foretells images, and no others") {
  const Device any = test::device();
  const RationalMap map = calibrated(any, steepened(test::armed_ball_map(60), 12));
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const Device device = with_width(width);
    const picture::MarchedSet set{map, 6, {}, {}, Precision::single};
    const picture::Band band = picture::find_band(device, set, *map.box);
    const picture::BandGrid grid(device, set, band);
    const map::DeviceMap device_map(device, map, band.stops, Precision::single);
    const double allowed = 0.02;
    const picture::ImageLattice lattice(device_map, grid, grid.bounds(), allowed / band.steepest,
                                        band.steepest);
    std::vector<double> layout(QJ_GRID_SIZE), field(lattice.field().size()),
        versors(lattice.versors().size());
    std::vector<std::uint8_t> trusted(lattice.trusted().size());
    device::Context& context = device.context();
    context.read(lattice.layout(), layout);
    context.read(lattice.field(), field);
    context.read(lattice.versors(), versors);
    context.read(lattice.trusted(), std::span(trusted));
    const int nx = static_cast<int>(layout[QJ_GRID_POINTS]);
    const int ny = static_cast<int>(layout[QJ_GRID_POINTS + 1]);
    // Lagrange's polynomial through four nodes, written as it stands in books.
    const auto weight = [](int m, double s) {
      double w = 1;
      for (int j = -1; j <= 2; ++j) {
        if (j != m) w *= (s - j) / (m - j);
      }
      return w;
    };
    int checked = 0, wrong = 0;
    for (std::size_t cell = 0; cell < trusted.size(); ++cell) {
      if (trusted[cell] == 0 || cell % 7 != 0) continue;
      const int number = static_cast<int>(cell), row = number / nx;
      const std::array<int, 3> at{number % nx, row % ny, row / ny};
      const std::array<double, 3> way{std::fmod(0.37 * number, 1), std::fmod(0.71 * number, 1),
                                      std::fmod(0.13 * number, 1)};
      double f = 0;
      Eigen::Vector4d u = Eigen::Vector4d::Zero();
      for (int k = -1; k <= 2; ++k) {
        for (int j = -1; j <= 2; ++j) {
          for (int i = -1; i <= 2; ++i) {
            const auto node =
                static_cast<std::size_t>(((at[2] + k) * ny + at[1] + j) * nx + at[0] + i);
            const double w = weight(i, way[0]) * weight(j, way[1]) * weight(k, way[2]);
            f += w * field[node];
            u += w * Eigen::Vector4d(versors[4 * node], versors[4 * node + 1],
                                     versors[4 * node + 2], versors[4 * node + 3]);
          }
        }
      }
      const auto place = [&](std::size_t axis) {
        return layout[QJ_GRID_ORIGIN + axis] + layout[QJ_GRID_STEP] * (at[axis] + way[axis]);
      };
      const auto step = reference::step(map, {place(0), place(1), place(2), map.slice});
      const Eigen::Vector4d expected(step.versor.x, step.versor.y, step.versor.z, step.versor.w);
      ++checked;
      if (std::abs(f - step.log_norm) + (u - expected).norm() > 2 * allowed) ++wrong;
    }
    CHECK(checked > 500);
    CHECK(wrong <= 0.01 * checked);
    const auto share =
        static_cast<double>(std::ranges::count(trusted, 1)) / static_cast<double>(trusted.size());
    CHECK(share < 0.9);  // far from the band nothing is known beforehand
  }
}

TEST_CASE("a studio's pictures are those drawn one by one, and tell when they will be done") {
  const Device device = test::device();
  const RationalMap map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  PictureOptions options = small(48, 36);
  Studio studio(device, map, options);
  for (const double azimuth : {30.0, 150.0}) {
    options.camera.azimuth = azimuth;
    std::vector<Progress> told;
    ProgressMonitor monitor;
    monitor.on_progress = [&](const Progress& progress) { told.push_back(progress); };
    CHECK(studio.picture(options.camera, monitor).pixels == render(device, map, options).pixels);
    REQUIRE(told.size() > 1);
    CHECK(told.back().fraction == Approx(1));
    for (std::size_t i = 0; i < told.size(); ++i) {
      CHECK(told[i].seconds_left >= 0);
      if (i > 0) CHECK(told[i].fraction > told[i - 1].fraction);
    }
  }
}

TEST_CASE("an escape radius cuts the set, and one that would empty it is refused") {
  // q² at the circle of radius 1: orbits from 0.9 stay, whatever the escape radius above 1.
  const picture::View view = ball_view(41, 31, 1);
  const auto depths = [&](std::optional<double> escape, double shift) {
    RationalMap map = square();
    map.log_scale = shift;  // the set's radius is e^-shift
    return picture::march_source(with_width(8), {map, 6, escape, {}, Precision::single})
        ->depths(view, 0, view.rows);
  };
  CHECK(depths(1.5, 0) == depths(30.0, 0));
  const auto hits = [](const std::vector<float>& all) {
    return std::ranges::count_if(all, [](float depth) { return depth >= 0; });
  };
  // e^-0.3 q²: a ball of radius 1.35, of which orbits that reach 1.1 are cut.
  CHECK(hits(depths(1.1, -0.3)) < hits(depths({}, -0.3)));
  CHECK_THROWS_WITH(depths(0.9, 0), Catch::Contains("escape: 0.9 "));
  CHECK_THROWS_WITH(depths(1e10, 0), Catch::Contains("escape: 10000000000"));
}

TEST_CASE("safe steps never lead into the ball, and the grid's coarse depths lie within a cell") {
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const Device device = with_width(width);
    const picture::MarchedSet set{square(), 6, {}, {}, Precision::single};
    const picture::Band band = picture::find_band(device, set, *square().box);
    CHECK(band.radius >= 1);
    picture::BandGrid grid(device, set, band);
    for (const Vector3d& corner : {grid.bounds().low, grid.bounds().high}) {
      CHECK(corner.cwiseAbs().minCoeff() > 1);
      CHECK(corner.cwiseAbs().maxCoeff() < 1.3);
    }
    std::vector<double> safe(grid.safe().size()), layout(grid.layout().size());
    device.context().read(grid.safe(), safe);
    device.context().read(grid.layout(), layout);
    const int nx = static_cast<int>(layout[QJ_GRID_POINTS]);
    const int ny = static_cast<int>(layout[QJ_GRID_POINTS + 1]);
    double longest = -10, total = 0;
    for (std::size_t i = 0; i < safe.size(); ++i) {
      const int at = static_cast<int>(i), row = at / nx;
      const Vector3d index(at % nx, row % ny, row / ny);
      const Vector3d p = Vector3d(layout[0], layout[1], layout[2]) + layout[QJ_GRID_STEP] * index;
      longest = std::max(longest, safe[i] - (p.norm() - 1));
      total += std::max(0.0, safe[i]);
    }
    CHECK(longest < 1e-4);
    CHECK(total / static_cast<double>(safe.size()) > 0.05);

    const picture::View view = ball_view(61, 47, 1);
    const auto depths = grid.depths(view, 0, view.rows);
    int wrong = 0;
    for (int row = 0; row < view.rows; ++row) {
      for (int column = 0; column < view.columns; ++column) {
        const double found = depths[static_cast<std::size_t>(row * view.columns + column)];
        const Vector3d ray = direction(view, column, row);
        // Rays that pass close by the ball may go either way.
        const double passes = view.eye.cross(ray).norm();
        if (std::abs(passes - 1) < grid.step()) continue;
        if ((found >= 0) != (passes < 1)) ++wrong;
        if (found >= 0 && std::abs((view.eye + found * ray).norm() - 1) > grid.step()) ++wrong;
      }
    }
    CHECK(wrong == 0);
  }
}

TEST_CASE("at n = 1 the silhouette and the depths are those of the extracted mesh") {
  const Device device = test::device();
  const RationalMap map = steepened(test::armed_ball_map(60), 10);
  const auto marched = picture::march_source(device, {map, 1, {}, {}, Precision::single});
  SurfaceOptions options;
  options.resolution = 160;
  options.iterations = 1;
  TriangleMesh mesh = extract_surface(device, map, options);
  for (Vector3d& vertex : mesh.vertices) vertex = map.shape_to_map.to_map(vertex);
  for (const double azimuth : {30.0, 140.0}) {
    Camera camera;
    camera.azimuth = azimuth;
    const picture::View view = picture::camera_view(camera, mesh.box(), 320, 240, 1);
    const auto set = marched->depths(view, 0, view.rows);
    const auto drawn = picture::mesh_source(mesh)->depths(view, 0, view.rows);
    int both = 0, either = 0;
    double apart = 0;
    for (std::size_t i = 0; i < set.size(); ++i) {
      if (set[i] >= 0 || drawn[i] >= 0) ++either;
      if (set[i] < 0 || drawn[i] < 0) continue;
      ++both;
      apart += std::abs(set[i] - drawn[i]);
    }
    CHECK(either > 5000);
    CHECK(both >= 0.995 * either);
    CHECK(apart / both < 0.5 * view.footprint);
  }
}

TEST_CASE("normals of depth point away from the ball's middle") {
  const Device device = with_width(1);
  device::Context& context = device.context();
  const picture::View view = ball_view(80, 60, 1);
  std::vector<float> depths;
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.columns; ++column) {
      depths.push_back(static_cast<float>(sphere_depth(view, column, row)));
    }
  }
  const auto normals = context.allocate<float>(3 * depths.size());
  const auto kernel = context.kernel("shade.cl", "normals_of_depth", {1, Precision::single, {}});
  context.launch(kernel, {{80, 60, 1}, {0, 0, 0}},
                 {context.upload_real(view.packed(), Precision::single), 80, 0, 60,
                  context.upload<float>(std::span<const float>(depths)),
                  device::Argument::real(5 * view.footprint, Precision::single), normals});
  std::vector<float> found(normals.size());
  context.read(normals, std::span(found));
  double least = 1;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (depths[i] < 0) continue;
    const Vector3d ray = direction(view, static_cast<int>(i % 80), static_cast<int>(i / 80));
    const Vector3d expected = view.eye + depths[i] * ray;
    const Vector3d normal(found[3 * i], found[3 * i + 1], found[3 * i + 2]);
    CHECK(normal.norm() == Approx(1).margin(1e-4));
    if (-ray.dot(expected) > 0.4) least = std::min(least, normal.dot(expected));
  }
  CHECK(least > std::cos(3 * std::numbers::pi / 180));
}

TEST_CASE("layers hold what each pixel shows, in the shape's coordinates") {
  RationalMap map = square();
  map.shape_to_map = {2, {0, 1, 0}};  // the ball has radius 0.5 about (0, -0.5, 0)
  map.box = Box{{-0.5, -1, -0.5}, {0.5, 0, 0.5}};
  // The last is made in two strips.
  const auto [width, height, samples] =
      GENERATE(table<int, int, int>({{40, 30, 1}, {40, 30, 2}, {100, 80, 8}}));
  PictureOptions options = small(width, height);
  options.samples_per_axis = samples;
  PictureLayers layers;
  const Image image = render(test::device(), map, options, {}, &layers);
  if (samples < 8) CHECK(image.pixels == render(test::device(), map, options).pixels);
  REQUIRE(layers.depth.size() ==
          static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  REQUIRE(layers.normal.size() == 3 * layers.depth.size());
  REQUIRE(layers.position.size() == 3 * layers.depth.size());
  const picture::View view = picture::camera_view(options.camera, *square().box, width, height, 1);
  const Vector3d eye = (view.eye - Vector3d(0, 1, 0)) / 2;
  int hits = 0, wrong = 0;
  for (std::size_t i = 0; i < layers.depth.size(); ++i) {
    const int column = static_cast<int>(i) % width, row = static_cast<int>(i) / width;
    const bool seen = std::isfinite(layers.depth[i]);
    if (seen != (sphere_depth(view, column, row) >= 0)) ++wrong;
    const float* n = &layers.normal[3 * i];
    const float* x = &layers.position[3 * i];
    const Vector3d normal(n[0], n[1], n[2]), position(x[0], x[1], x[2]);
    if (!seen) {
      CHECK((normal.isZero() && position.array().isNaN().all()));
      continue;
    }
    ++hits;
    const Vector3d from_center = position - Vector3d(0, -0.5, 0);
    CHECK(from_center.norm() == Approx(0.5).margin(0.8 / (height * samples)));
    CHECK((position - eye).norm() == Approx(layers.depth[i]).margin(1e-3));
    // The pixel's middle, or the sample next to it.
    CHECK((position - eye).normalized().dot(direction(view, column, row)) > 1 - 1e-4);
    CHECK(normal.norm() == Approx(1).margin(1e-4));
    if (-from_center.dot(position - eye) > 0.5 * 0.5 * layers.depth[i]) {
      CHECK(normal.dot(from_center) > 0.5 * 0.98);
    }
  }
  CHECK(hits > 200);
  CHECK(wrong < 0.08 * hits);
}

TEST_CASE("a comparison shows where the set is outside the mesh in red, and inside in blue") {
  const Device device = test::device();
  const PictureOptions options = small(60, 40);
  for (const double radius : {0.9, 1.1}) {
    TriangleMesh mesh = shapes::sphere(3);
    for (auto& vertex : mesh.vertices) vertex *= radius;
    const Image image = comparison(device, square(), mesh, options);
    REQUIRE(image.width >= 120);
    REQUIRE(image.height > 80);
    // The middle of the fourth picture; under it the scale.
    const auto at = [&](int column, int row) {
      return &image.pixels[3 * static_cast<std::size_t>(row * image.width + column)];
    };
    const int cell = (image.width - 60);
    const int caption = 22, gap = 8;
    const auto* seen = at(cell + 30, 40 + caption + gap + 20);
    CAPTURE(radius, int(seen[0]), int(seen[1]), int(seen[2]));
    CHECK((radius < 1 ? seen[0] > 1.3 * seen[2] : seen[2] > 1.3 * seen[0]));
  }
}

TEST_CASE("points are coloured by the orbits they have") {
  RationalMap map = test::random_map(7, 0.3, 0.5, 3);
  map.factors.push_back({{0, 0, 0, 0}, 3});
  map.box = Box{{-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}};
  const Material material = GENERATE(Material::iterations, Material::trap);
  const int n = 5;
  for (const int width : test::lane_widths()) {
    const Device device = with_width(width);
    const auto source =
        picture::march_source(device, {map, n, {}, {}, Precision::single, material});
    const StopRadii stops = find_stop_radii(device, map);
    const double below = std::log(stops.inner);
    const double above = std::log(std::min(stops.outer, stops.escape));
    std::vector<Vector3d> points;
    for (int i = 0; i < 301; ++i) {
      points.emplace_back(std::sin(0.7 * i) * 1.2, std::cos(1.3 * i) * 0.9, std::sin(2.1 * i));
    }
    std::vector<double> arrays;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      for (const Vector3d& point : points) arrays.push_back(point[axis]);
    }
    const auto found = source->traits(arrays);
    REQUIRE(found.size() == points.size());
    int wrong = 0;
    std::set<float> seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
      Quaternion q{points[i].x(), points[i].y(), points[i].z(), map.slice};
      int last = 0;
      double closest = 1;
      for (int m = 1; m <= n; ++m) {
        const auto step = reference::step(map, q);
        last = m;
        if (m <= 2) closest = std::min(closest, std::abs(step.versor.x));
        if (step.log_norm <= below || step.log_norm >= above) break;
        const double r = std::exp(step.log_norm);
        q = {r * step.versor.x, r * step.versor.y, r * step.versor.z, r * step.versor.w};
      }
      const double expected = material == Material::trap ? closest : (last - 1) / double(n - 1);
      if (std::abs(found[i] - expected) > 1e-3) ++wrong;
      seen.insert(found[i]);
    }
    // Orbits that are chaotic, or pass close to a stop radius.
    CHECK(wrong <= 6);
    CHECK(seen.size() >= 4);
  }
}

TEST_CASE("a picture's material changes the set's colours alone") {
  const Device device = test::device();
  PictureOptions options = small(40, 30);
  PictureLayers layers;
  const Image clay = render(device, square(), options, {}, &layers);
  options.material = Material::trap;
  const Image trap = render(device, square(), options);
  std::size_t same = 0, behind = 0;
  for (std::size_t i = 0; i < layers.depth.size(); ++i) {
    const bool empty = std::isinf(layers.depth[i]);
    behind += empty ? 1 : 0;
    same += std::equal(&clay.pixels[3 * i], &clay.pixels[3 * i] + 3, &trap.pixels[3 * i]) ? 1 : 0;
  }
  CHECK(same < behind + 20);
  CHECK(10 * same > 9 * behind);
}

TEST_CASE("layers are written as arrays and to look at") {
  const test::TemporaryFolder folder;
  PictureLayers layers;
  layers.depth = {2, INFINITY, 3, 4, 2.5F, 6};
  layers.normal.assign(18, 0);
  layers.normal[2] = -1;
  layers.position.assign(18, 7);
  const auto paths = write_layers(layers, 3, folder.path() / "a.b");
  REQUIRE(paths.size() == 5);
  auto names = folder.names();
  std::ranges::sort(names);
  CHECK(names == std::vector<std::string>{"a.b.depth.npy", "a.b.depth.png", "a.b.normal.npy",
                                          "a.b.normal.png", "a.b.position.npy"});
  const std::string depth = test::read_text(folder.path() / "a.b.depth.npy");
  CHECK_THAT(depth, Catch::Contains("'shape': (2, 3)") && Catch::Contains("<f4"));
  REQUIRE(depth.size() == 128 + 6 * sizeof(float));
  CHECK(std::memcmp(depth.data() + 128, layers.depth.data(), 6 * sizeof(float)) == 0);
  const std::string normal = test::read_text(folder.path() / "a.b.normal.npy");
  CHECK_THAT(normal, Catch::Contains("'shape': (2, 3, 3)"));
  CHECK(normal.size() == 128 + 18 * sizeof(float));
}

TEST_CASE("the same picture twice is the same bytes; tiny pictures work") {
  const Device device = test::device();
  const Image first = render(device, square(), small(24, 17));
  CHECK(first.pixels.size() == 3 * 24 * 17);
  CHECK(render(device, square(), small(24, 17)).pixels == first.pixels);
  CHECK(render(device, square(), small(1, 1)).pixels.size() == 3);
}

TEST_CASE("shading gives the stored pictures") {
  const Device device = test::device();
  const RationalMap map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  const auto check = [](const Image& image, const std::string& name) {
    const auto path =
        std::filesystem::path(QJULIA_TEST_DATA) / "pictures" / ("armed_ball_" + name + ".png");
    if (std::getenv("QJULIA_TEST_WRITE_PICTURES") != nullptr) write_png(image, path);
    CAPTURE(name);
    CHECK(test::mean_difference(image, test::read_png(path)) <= 1);
  };
  PictureOptions options = small(96, 72);
  options.camera.zoom = 2.5;  // little but the body
  options.keep_loose = true;
  std::vector<Image> images;
  for (const Material material : {Material::clay, Material::iterations, Material::trap}) {
    options.material = material;
    images.push_back(render(device, map, options));
    check(images.back(), to_string(material));
  }
  CHECK(test::mean_difference(images[0], images[1]) > 5);
  CHECK(test::mean_difference(images[1], images[2]) > 5);
  options.material = Material::clay;
  const TriangleMesh mesh = extract_surface(device, map, {64, 1, {}});
  check(render_mesh(device, mesh, *map.box, options), "mesh");
}

TEST_CASE("shadows on the ground are soft, without hatching, and nowhere black") {
  const Device device = test::device();
  const TriangleMesh sphere = shapes::sphere(4);
  PictureLayers layers;
  const PictureOptions options = small(320, 240);
  const Image image = render_mesh(device, sphere, sphere.box(), options, {}, &layers);
  const auto brightness = [&](int column, int row) {
    const std::uint8_t* rgb = &image.pixels[3 * static_cast<std::size_t>(row * 320 + column)];
    return (rgb[0] + rgb[1] + rgb[2]) / 3.0;
  };
  const auto is_ground = [&](int column, int row) {
    for (int j = row - 3; j <= row + 3; ++j) {
      for (int i = column - 3; i <= column + 3; ++i) {
        if (std::isfinite(layers.depth[static_cast<std::size_t>(j * 320 + i)])) return false;
      }
    }
    return true;
  };
  double darkest = 255, brightest = 0, roughest = 0;
  for (int row = 3; row < 237; ++row) {
    for (int column = 3; column < 317; ++column) {
      if (!is_ground(column, row)) continue;
      const double here = brightness(column, row);
      darkest = std::min(darkest, here);
      brightest = std::max(brightest, here);
      const double across = brightness(column - 1, row) + brightness(column + 1, row) - 2 * here;
      const double down = brightness(column, row - 1) + brightness(column, row + 1) - 2 * here;
      roughest = std::max({roughest, std::abs(across), std::abs(down)});
    }
  }
  CHECK(darkest > 65);
  CHECK(darkest < 0.7 * brightest);  // there is a shadow
  CHECK(roughest < 40);
}

TEST_CASE("the sky's shadow on the ground is as smooth and round as the ball that casts it") {
  const Device device = test::device();
  const double fineness = GENERATE(0.2, 1.0);
  const auto source = picture::mesh_source(shapes::sphere(4));
  const auto sky = picture::sky_lights(UpAxis::y, source->bounds(), fineness, 64);
  std::vector<std::vector<float>> maps;
  for (const auto& light : sky) maps.push_back(source->depths(light.view, 0, light.view.rows));
  picture::Scene scene;
  scene.ground = -1;
  const auto ground = picture::ground_light(device, scene, sky, maps, fineness);
  REQUIRE(ground.shares.size() == static_cast<std::size_t>(ground.side * ground.side));
  const auto radius = [&](int i) {
    const double u = 2.0 * i / (ground.side - 1) - 1;
    return u / (1 - QJ_GROUND_CROWDING * std::abs(u));
  };
  // Shares by distance from the point that the ball touches.
  std::vector<double> low(60, 1), high(60, 0);
  for (int j = 0; j < ground.side; ++j) {
    for (int i = 0; i < ground.side; ++i) {
      const auto ring = static_cast<std::size_t>(20 * std::hypot(radius(i), radius(j)));
      if (ring >= low.size()) continue;
      const double share = ground.shares[static_cast<std::size_t>(j * ground.side + i)];
      low[ring] = std::min(low[ring], share);
      high[ring] = std::max(high[ring], share);
    }
  }
  double widest = 0;
  for (std::size_t ring = 0; ring < low.size(); ++ring) {
    if (high[ring] > 0) widest = std::max(widest, high[ring] - low[ring]);
  }
  CHECK(high[2] < 0.25);
  CHECK(low[59] > 0.9);
  CHECK(widest < 0.12);  // within 0.05 of a distance; 64 lights with hard shadows: 0.2
}

TEST_CASE("what is behind the set is plain or transparent where asked for, and the set stays") {
  const Device device = test::device();
  PictureOptions options = small(64, 48);
  const Image studio = render(device, square(), options);
  CHECK(studio.alpha.empty());
  options.backdrop = Backdrop::transparent;
  const Image shadowed = render(device, square(), options);
  options.ground = false;
  const Image clear = render(device, square(), options);
  options.backdrop = Backdrop::plain;
  options.background = color_named("1e90ff").value();
  const Image plain = render(device, square(), options);
  options.ground = true;
  const Image on_ground = render(device, square(), options);
  REQUIRE(clear.alpha.size() == 64 * 48);
  std::size_t empty = 0, full = 0, shaded = 0, darker = 0;
  for (std::size_t i = 0; i < clear.alpha.size(); ++i) {
    const std::uint8_t *of_plain = &plain.pixels[3 * i], *of_ground = &on_ground.pixels[3 * i];
    if (clear.alpha[i] == 0) {
      ++empty;
      CHECK((of_plain[0] == 0x1e && of_plain[1] == 0x90 && of_plain[2] == 0xff));
      if (shadowed.alpha[i] > 0) {
        ++shaded;
        CHECK(shadowed.alpha[i] < 255);
        CHECK(shadowed.pixels[3 * i] == 0);
      }
      darker += of_ground[1] + 20 < of_plain[1] ? 1 : 0;
    } else if (clear.alpha[i] == 255) {
      ++full;
      for (const Image* image : {&shadowed, &clear, &plain, &on_ground}) {
        CHECK(std::equal(of_plain, of_plain + 3, &image->pixels[3 * i]));
        CHECK(std::equal(of_plain, of_plain + 3, &studio.pixels[3 * i]));
      }
    }
  }
  CHECK(full > 500);
  CHECK(empty > 500);
  CHECK(shaded > 50);
  CHECK(darker > 20);
}

TEST_CASE("a palette colours clay and materials") {
  const Device device = test::device();
  PictureOptions options = small(48, 36);
  options.palette.clay = Rgb(0, 0.8, 0);
  const auto middle = [&] {
    const Image image = render(device, square(), options);
    const std::uint8_t* rgb = &image.pixels[3 * (18 * 48 + 24)];
    return std::array{int{rgb[0]}, int{rgb[1]}, int{rgb[2]}};
  };
  const auto green = middle();
  CHECK(green[1] > green[0] + 60);
  CHECK(green[1] > green[2] + 60);
  options.material = Material::iterations;
  options.palette.stops.assign(Palette::kMostStops, Rgb(0.8, 0, 0));
  const auto red = middle();
  CHECK(red[0] > red[1] + 60);
  CHECK(red[0] > red[2] + 60);
}

TEST_CASE("a map says what is up in its pictures, unless the camera does") {
  const Device device = test::device();
  const RationalMap map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  RationalMap standing = map;
  standing.up = UpAxis::minus_x;
  PictureOptions options = small(32, 24);
  const Image by_map = render(device, standing, options);
  CHECK(by_map.covered > 50);
  CHECK(by_map.pixels != render(device, map, options).pixels);
  options.camera.up = UpAxis::minus_x;
  CHECK(by_map.pixels == render(device, map, options).pixels);
}

TEST_CASE("a picture counts the pixels that show the set") {
  const Device device = test::device();
  PictureLayers layers;
  PictureOptions options = small(40, 30);
  options.samples_per_axis = 1;
  const Image image = render(device, square(), options, {}, &layers);
  const auto seen = std::ranges::count_if(layers.depth, [](float d) { return std::isfinite(d); });
  CHECK(image.covered == static_cast<std::size_t>(seen));
  CHECK(image.covered > 100);
  options.samples_per_axis = 3;
  CHECK(render(device, square(), options).covered > image.covered);
  RationalMap map = square();
  map.slice = 50;
  CHECK(render(device, map, options).covered == 0);
  options.box = Box{{3, 3, 3}, {4, 4, 4}};
  CHECK(render(device, square(), options).covered == 0);
  const TriangleMesh sphere = shapes::sphere(3);
  CHECK(render_mesh(device, sphere, sphere.box(), options).covered > 100);
}

TEST_CASE("a stopped rendering gives no picture") {
  std::stop_source stop;
  stop.request_stop();
  ProgressMonitor monitor;
  monitor.stop = stop.get_token();
  CHECK_THROWS_AS(render(test::device(), square(), small(8, 8), monitor), Interrupted);
}

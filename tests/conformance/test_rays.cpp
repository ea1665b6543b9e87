// Rays that meet the unit ball and other sets, against closed forms and whole orbits.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>

#include "armed_ball.hpp"
#include "ball_view.hpp"
#include "base/larger_error.hpp"
#include "device/context.hpp"
#include "distance_map.hpp"
#include "lattice/image_lattice.hpp"
#include "layout/image_lattice.h"
#include "layout/picture_layout.h"
#include "map/reference_iteration.hpp"
#include "picture/band_grid.hpp"
#include "picture/specks.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/surface/surface.hpp"
#include "random_maps.hpp"

using namespace qjulia;
using Eigen::Vector3d;

TEST_CASE("rays meet the ball where they must, at every lane width") {
  for (const int width : test::lane_widths()) {
    for (const int iterations : {1, 6}) {
      CAPTURE(width, iterations);
      const auto source = picture::march_source(
          test::with_width(width), {check::unit_ball(), iterations, {}, {}, Precision::single});
      const picture::View view = test::ball_view(101, 67, 1);
      const auto depths = source->depths(view, 0, view.rows);
      REQUIRE(depths.size() == 101 * 67);
      int hits = 0, wrong = 0;
      double worst = 0;
      test::for_pixels(view, depths, [&](int column, int row, double found) {
        const double expected = check::sphere_depth(view, column, row);
        if (found >= 0) ++hits;
        if ((found >= 0) != (expected >= 0)) {
          ++wrong;
        } else if (expected >= 0) {
          const Vector3d ray = check::ray_direction(view, column, row);
          const double slope = std::abs((view.eye + expected * ray).dot(ray));
          worst = base::larger_error(worst, std::abs(found - expected) * slope);
        }
      });
      // Rays that graze the ball inside one step's reach may pass it by.
      CHECK(wrong <= 0.01 * hits);
      CHECK(worst < view.tolerance);
    }
  }
}

TEST_CASE("a pixel's depth depends neither on the strip it is asked for in nor on lane width") {
  const auto source = picture::march_source(test::with_width(8),
                                            {check::unit_ball(), 6, {}, {}, Precision::single});
  const auto other = picture::march_source(test::with_width(16),
                                           {check::unit_ball(), 6, {}, {}, Precision::single});
  const picture::View view = test::ball_view(37, 29, 2);
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
  const auto source = picture::march_source(test::with_width(16),
                                            {check::unit_ball(), 6, {}, {}, Precision::single});
  const picture::View view = test::ball_view(80, 60, 2);
  const auto depths = source->depths(view, 0, view.rows);
  double worst = 0;
  int hits = 0;
  test::for_pixels(view, depths, [&](int column, int row, double t) {
    if (t < 0) return;
    ++hits;
    worst = base::larger_error(
        worst, std::abs((view.eye + t * check::ray_direction(view, column, row)).norm() - 1));
  });
  CHECK(hits > 1000);
  CHECK(worst < 0.5 * view.footprint);
}

TEST_CASE("rays in double precision find the ball's depths as well") {
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const Device device = test::with_width(width);
    if (!test::can_check(device, Precision::dbl)) return;
    const picture::View view = test::ball_view(61, 47, 1);
    const auto depths =
        picture::march_source(device, {check::unit_ball(), 6, {}, {}, Precision::dbl})
            ->depths(view, 0, view.rows);
    const auto single =
        picture::march_source(device, {check::unit_ball(), 6, {}, {}, Precision::single})
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
    const auto source = picture::march_source(test::with_width(width),
                                              {check::unit_ball(), 6, {}, part, Precision::single});
    picture::View view =
        picture::parallel_view(Vector3d::UnitZ(), *check::unit_ball().frame.box, 64);
    for (const bool coarse : {false, true}) {
      view.coarse_will_do = coarse;
      const auto depths = source->depths(view, 0, view.rows);
      int on_cut = 0, beyond = 0;
      double worst = 0;
      test::for_pixels(view, depths, [&](int column, int row, double depth) {
        const Vector3d from = check::ray_start(view, column, row);
        if (std::hypot(from.x(), from.y()) > 0.9) return;
        const double z = from.z() - depth;
        if (depth >= 0 && z > -0.5) ++on_cut;
        worst = base::larger_error(worst, std::abs(z - 0.25));
        if (z > 0.27) ++beyond;
      });
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
Map body_and_flake() {
  Map map;
  map.dynamics.factors = {Factor{{0, 0, 0, 0}, 3}, Factor{{2, 0, 0, 0}, 1}};
  map.frame.box = Box{{-1, -1, -1}, {2.2, 1, 1}};
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

/// A view of a body and its flake along `from`, of `side` × `side` rays, and the depths that short
/// steps find, row after row; -1 where a ray meets nothing.
struct FlakeView {
  picture::View view;
  std::vector<double> expected;

  FlakeView(const Vector3d& from, int side, bool keeps_loose)
      : view(picture::parallel_view(from, *body_and_flake().frame.box, side)) {
    for (int row = 0; row < view.rows; ++row) {
      for (int column = 0; column < view.columns; ++column) {
        expected.push_back(
            entered(eye(column, row), check::ray_direction(view, column, row), keeps_loose));
      }
    }
  }
  Vector3d eye(int column, int row) const {
    return view.eye + (column + 0.5) * view.eye_dx + (row + 0.5) * view.eye_dy;
  }
};

void check_flake(const Device& device, const picture::MarchedSet& set, const FlakeView& reference) {
  const auto source = picture::march_source(device, set);
  picture::View view = reference.view;
  for (const bool coarse : {false, true}) {
    CAPTURE(device.info().name, to_string(set.precision), set.keeps_loose, coarse);
    view.coarse_will_do = coarse;
    const auto depths = source->depths(view, 0, view.rows);
    CHECK(source->loose_pieces().count == (set.keeps_loose ? 0 : 1));
    int hits = 0, wrong = 0, on_flake = 0;
    double worst = 0;
    for (int row = 0; row < view.rows; ++row) {
      for (int column = 0; column < view.columns; ++column) {
        const auto ray = static_cast<std::size_t>(row * view.columns + column);
        const double expected = reference.expected[ray];
        const double found = depths[ray];
        if (found >= 0) ++hits;
        const Vector3d at =
            reference.eye(column, row) + found * check::ray_direction(view, column, row);
        if (found >= 0 && at.x() > 1.4) ++on_flake;
        if ((found >= 0) != (expected >= 0)) {
          ++wrong;
        } else if (found >= 0) {
          worst = base::larger_error(worst, std::abs(found - expected));
        }
      }
    }
    CHECK(hits > 0.04 * view.rows * view.columns);
    // Rays that graze what they meet.
    CHECK(wrong <= 2 + 0.02 * hits);
    CHECK((on_flake > 0) == set.keeps_loose);
    if (!coarse) CHECK(worst < 0.3);
  }
}

}  // namespace

TEST_CASE("rays pass through loose pieces, and meet what is behind them") {
  for (const bool keeps : {false, true}) {
    for (const Vector3d& from : {Vector3d(1, 0, 0), Vector3d(0, 0, 1)}) {
      CAPTURE(from.x());
      const FlakeView view(from, 96, keeps);
      for (const int width : test::lane_widths()) {
        const Device device = test::with_width(width);
        for (const Precision precision : {Precision::single, Precision::dbl}) {
          if (!test::can_check(device, precision)) continue;
          picture::MarchedSet set{body_and_flake(), 1, {}, {}, precision};
          set.keeps_loose = keeps;
          check_flake(device, set, view);
        }
      }
    }
  }
}

TEST_CASE("a few rays pass through a loose piece that a coarse grid shows") {
  const FlakeView view({1, 0, 0}, 12, false);
  for (const int width : test::lane_widths()) {
    picture::MarchedSet set{body_and_flake(), 1, {}, {}, Precision::single};
    set.keeps_loose = false;
    set.cells = 12;
    check_flake(test::with_width(width), set, view);
  }
}

TEST_CASE("rays go on behind a piece that they come out of") {
  const FlakeView all({1, 0, 0}, 96, true), body({1, 0, 0}, 96, false);
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    picture::MarchedSet set{body_and_flake(), 1, {}, {}, Precision::single};
    const auto source = picture::march_source(test::with_width(width), set);
    CHECK(source->largest_speck() == 0);
    const auto depths = source->depths(all.view, 0, all.view.rows);
    std::vector<picture::PassingRay> deep, shallow;
    std::vector<double> expected;
    test::for_pixels(all.view, depths, [&](int column, int row, double depth) {
      if (depth < 0 || all.view.at(column + 0.5, row + 0.5, depth).x() < 1.5) return;
      const auto hit = static_cast<float>(depth);
      deep.push_back({column, row, hit, hit + 0.6F});
      shallow.push_back({column, row, hit, hit + 0.02F});
      expected.push_back(body.expected[static_cast<std::size_t>(row * 96 + column)]);
    });
    REQUIRE(deep.size() > 20);
    const auto behind = source->depths_beyond(all.view, deep);
    const auto within = source->depths_beyond(all.view, shallow);
    REQUIRE(behind.size() == deep.size());
    int stopped = 0;
    for (std::size_t i = 0; i < deep.size(); ++i) {
      CHECK(std::abs(behind[i] - expected[i]) < 0.05);
      if (std::abs(within[i] - shallow[i].until) < all.view.footprint) ++stopped;
    }
    // Some rays graze the flake.
    CHECK(stopped > 0.7 * static_cast<double>(deep.size()));
    // Rays that hit the face of a cut do not go on.
    set.part = Box{{-2, -2, -2}, {2, 2, 2}};
    const auto cut = picture::march_source(test::with_width(width), set);
    for (auto& ray : deep) ray.until = (ray.hit += 0.1F) + 0.6F;
    const auto unknown = cut->depths_beyond(all.view, deep);
    for (std::size_t i = 0; i < deep.size(); ++i) CHECK(unknown[i] == deep[i].until);
  }
}

TEST_CASE("rays find what stands between a light and a point, within the given range") {
  // The flake stands one unit in front of the body.
  const FlakeView light({1, 0, 0}, 32, true);
  const picture::View seen_by = picture::parallel_view({0, 0, 1}, *body_and_flake().frame.box, 96);
  for (const int width : test::lane_widths()) {
    const picture::MarchedSet set{body_and_flake(), 1, {}, {}, Precision::single};
    const auto source = picture::march_source(test::with_width(width), set);
    std::vector<picture::LightRay> far, near;
    std::vector<bool> expected;
    for (int row = 0; row < light.view.rows; ++row) {
      for (int column = 0; column < light.view.columns; ++column) {
        const double body = entered(light.eye(column, row), {-1, 0, 0}, false);
        if (body < 0) continue;
        const double first = light.expected[static_cast<std::size_t>(row * 32 + column)];
        const auto to = static_cast<float>(body);
        far.push_back({column + 0.5, row + 0.5, 0, to});
        near.push_back({column + 0.5, row + 0.5, to - 0.3F, to});
        expected.push_back(first < body - 0.3);
      }
    }
    REQUIRE(far.size() > 200);
    const auto behind = std::ranges::count(expected, true);
    CHECK(behind > 1);
    CHECK(source->blocked(light.view, seen_by, far) == expected);
    const auto clear = source->blocked(light.view, seen_by, near);
    CHECK(std::ranges::count(clear, true) == 0);
    CHECK(clear.size() == far.size());
  }
}

TEST_CASE("removing specks leaves a picture without specks unchanged") {
  const auto source = picture::march_source(
      test::with_width(8),
      {check::unit_ball(), 6, {}, {}, Precision::single, {}, {}, true, 144, 0, false});
  for (const int samples : {1, 2}) {
    const picture::View view = test::ball_view(80, 60, samples);
    CHECK(picture::speckless_depths(*source, view) == source->depths(view, 0, view.rows));
    CHECK(source->largest_speck() > 0);
  }
}

TEST_CASE("a part of the set has the loose pieces that the whole has") {
  const Map map = body_and_flake();
  // The flake alone; and half of the body without the flake.
  for (const bool keeps : {false, true}) {
    picture::MarchedSet set{map, 1, {}, Box{{1.5, -1, -1}, {3, 1, 1}}, Precision::single};
    set.keeps_loose = keeps;
    const auto alone = picture::march_source(test::with_width(8), set);
    const picture::View view = picture::parallel_view({1, 0, 0}, *map.frame.box, 64);
    const auto depths = alone->depths(view, 0, view.rows);
    CHECK((std::ranges::max(depths) >= 0) == keeps);
    set.part = Box{{-2, -2, -2}, {0, 2, 2}};
    const auto half = picture::march_source(test::with_width(8), set);
    const auto cut = half->depths(view, 0, view.rows);
    CHECK(std::ranges::count_if(cut, [](float d) { return d >= 0; }) > 500);
  }
}

namespace {

/// Which points of a map's set hang on its core, which no orbit leaves. Inside points of a lattice
/// through the origin are followed along the lattice's edges; each is found by a whole orbit.
class Hanging {
 public:
  Hanging(const Device& device, const Map& map, int iterations, double step)
      : field_(device, map, Precision::single),
        map_(map),
        iterations_(iterations),
        step_(step),
        core_(std::log(find_stop_radii(device, map).inner)) {}

  /// Whether the lattice's inside point nearest to p hangs on the core; nothing if none is next to
  /// p.
  std::optional<bool> at(const Vector3d& p) {
    const Eigen::Array3i middle = (p / step_).array().round().cast<int>();
    std::optional<Node> nearest;
    for (int i = 0; i < 27; ++i) {
      const Node node{middle[0] + i % 3 - 1, middle[1] + i / 3 % 3 - 1, middle[2] + i / 9 - 1};
      const auto away = [&](const Node& n) { return (point(n) - p).norm(); };
      if (kinds_of({node})[0] == Kind::outside) continue;
      if (!nearest || away(node) < away(*nearest)) nearest = node;
    }
    if (!nearest) return std::nullopt;
    return hangs(*nearest);
  }

 private:
  using Node = std::array<int, 3>;
  enum class Kind { outside, inside, core };

  Vector3d point(const Node& n) const { return step_ * Vector3d(n[0], n[1], n[2]); }

  std::vector<Kind> kinds_of(const std::vector<Node>& nodes) const {
    std::vector<Quaternion> points;
    for (const Node& node : nodes) {
      const Vector3d p = point(node);
      points.push_back({p.x(), p.y(), p.z(), map_.dynamics.slice});
    }
    const auto first = field_.at(points, 1), last = field_.decided_at(points, iterations_);
    std::vector<Kind> kinds;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const bool is_inside = last[i] < map_.dynamics.surface_level;
      kinds.push_back(!is_inside ? Kind::outside : first[i] < core_ ? Kind::core : Kind::inside);
    }
    return kinds;
  }

  bool hangs(const Node& start) {
    std::vector<Node> layer{start}, followed;
    std::set<Node> seen(layer.begin(), layer.end());
    std::optional<bool> found;
    while (!found) {
      const std::vector<Kind> kinds = kinds_of(layer);
      std::vector<Node> next;
      for (std::size_t i = 0; i < layer.size() && !found; ++i) {
        if (kinds[i] == Kind::outside) continue;
        if (kinds[i] == Kind::core) found = true;
        const auto known = known_.find(layer[i]);
        if (known != known_.end()) found = known->second;
        followed.push_back(layer[i]);
        for (std::size_t axis = 0; axis < 3; ++axis) {
          for (const int by : {-1, 1}) {
            Node beside = layer[i];
            beside[axis] += by;
            if (seen.insert(beside).second) next.push_back(beside);
          }
        }
      }
      layer = next;
      if (layer.empty() && !found) found = false;
    }
    for (const Node& node : followed) known_[node] = *found;
    return *found;
  }

  Field field_;
  Map map_;
  int iterations_;
  double step_, core_;
  std::map<Node, bool> known_;
};

}  // namespace

TEST_CASE("close views without loose pieces lose nothing of the body", "[slow]") {
  const Device device = test::shared_device();
  // Wild enough to have flakes.
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 3));
  picture::MarchedSet set{map, 6, {}, {}, Precision::single};
  set.cells = 100;
  const auto all = picture::march_source(device, set);
  set.keeps_loose = false;
  const auto some = picture::march_source(device, set);
  Camera camera;
  camera.azimuth = 30;
  camera.zoom = 10;
  camera.up = UpAxis::y;
  const picture::View view = picture::camera_view(camera, *map.frame.box, 160, 120, 1);
  const auto kept = all->depths(view, 0, view.rows);
  some->prepare(view);
  const auto left = some->depths(view, 0, view.rows);
  Hanging body(device, map, set.iterations, 1.5 * view.footprint);
  int nearer = 0, of_body = 0, of_pieces = 0;
  test::for_pixels(view, kept, [&](int column, int row, double depth) {
    const double found = left[static_cast<std::size_t>(row * view.columns + column)];
    const double slack = 4 * view.footprint;
    if (found >= 0 && (depth < 0 || found < depth - slack)) ++nearer;
    if (depth < 0 || (found >= 0 && found < depth + slack)) return;
    const auto hangs = body.at(view.at(column + 0.5, row + 0.5, depth + 0.5 * view.footprint));
    if (hangs) ++(*hangs ? of_body : of_pieces);
  });
  // Of 19,200 rays: flakes and hairs thinner than a step are met or not, as steps happen to lie,
  // and they lie elsewhere where a piece is left out that rays about them met.
  CHECK(nearer <= 96);
  CHECK(of_pieces > 300);
  CHECK(of_body <= 20);
  // What a ray meets does not depend on the strip of the picture in which it is asked for.
  for (const int rows : {48, 49, 50}) {
    CAPTURE(rows);
    std::vector<float> strips = some->depths(view, 0, rows);
    const auto rest = some->depths(view, rows, view.rows - rows);
    strips.insert(strips.end(), rest.begin(), rest.end());
    CHECK(strips == left);
  }
}

TEST_CASE("interpolated images give the picture that computed ones give", "[slow]") {
  // A distance's modulus is never interpolated, its versor is. Nor is paint.
  const auto [distance, painted] =
      GENERATE(table<bool, bool>({{false, false}, {true, false}, {false, true}}));
  Map map = distance ? test::distance_map(0.1, 60) : test::armed_ball_map(60);
  if (distance) {
    for (Factor& factor : map.dynamics.factors)
      factor.exponent *= 0.06;  // it turns about as fast as F rises
  } else {
    map = calibrated(test::shared_device(), steepened(map, 12));
  }
  if (painted) {
    Paint paint;
    paint.cells = {9, 9, 9};
    paint.origin = Vector3d::Constant(-2);
    paint.step = 0.45;
    for (int i = 0; i < 729; ++i) paint.shares.push_back(painted_share(0.2 + 0.1 * (i % 9)));
    map.layers.paint = paint;
  }
  for (const int width : test::lane_widths()) {
    const Device device = test::with_width(width);
    for (const Precision precision : {Precision::single, Precision::dbl}) {
      if (precision == Precision::dbl && (painted || !test::can_check(device, precision))) continue;
      CAPTURE(distance, painted, width, precision == Precision::dbl);
      picture::MarchedSet set{map, 6, {}, {}, precision};
      const picture::View view =
          picture::camera_view({},
                               {map.frame.shape_to_map.to_map(map.frame.box->low),
                                map.frame.shape_to_map.to_map(map.frame.box->high)},
                               120, 90, 1);
      const auto found = picture::march_source(device, set)->depths(view, 0, view.rows);
      set.interpolates_images = false;
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

namespace {

/// What kernels read of a lattice.
struct ReadLattice {
  std::vector<double> layout, field, versors;
  std::vector<std::uint8_t> trusted;
  std::vector<std::int32_t> places;

  ReadLattice(device::Context& context, const surface::ImageLattice& lattice, std::size_t levels)
      : layout(levels * QJ_LEVEL_SIZE),
        field(lattice.field().size()),
        versors(lattice.versors().size()),
        trusted(lattice.trusted().size()),
        places(lattice.places().size()) {
    context.read(lattice.layout(), layout);
    context.read(lattice.field(), field);
    context.read(lattice.versors(), versors);
    context.read(lattice.trusted(), std::span(trusted));
    context.read(lattice.places(), std::span(places));
  }

  /// A number of a level's description.
  double of(std::size_t level, std::size_t number) const {
    return layout.at(level * QJ_LEVEL_SIZE + number);
  }
  int count(std::size_t level, std::size_t axis) const {
    return static_cast<int>(of(level, QJ_GRID_POINTS + axis));
  }
  std::array<int, 3> index(std::size_t level, int number) const {
    const int row = number / count(level, 0);
    return {number % count(level, 0), row % count(level, 1), row / count(level, 1)};
  }
  /// Map coordinates, at `way` from a cell's lowest node.
  Vector3d point(std::size_t level, int number, const Vector3d& way) const {
    Vector3d p = Vector3d::Zero();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double along =
          of(level, QJ_GRID_ORIGIN + axis) +
          of(level, QJ_GRID_STEP) * (index(level, number).at(axis) + way[Eigen::Index(axis)]);
      for (std::size_t c = 0; c < 3; ++c) {
        p[Eigen::Index(c)] += along * of(level, QJ_LEVEL_AXES + 3 * axis + c);
      }
    }
    return p;
  }
  /// Where the place of a node's group stands.
  std::size_t group_of(std::size_t level, int number) const {
    const auto page = static_cast<std::size_t>(of(level, QJ_LEVEL_PAGES)) +
                      static_cast<std::size_t>(number / QJ_LATTICE_PAGE_NODES);
    return static_cast<std::size_t>(places.at(page)) +
           static_cast<std::size_t>(number % QJ_LATTICE_PAGE_NODES / QJ_LATTICE_GROUP);
  }
  bool is_trusted(std::size_t level, int cell) const {
    return trusted.at(group_of(level, cell) * QJ_LATTICE_GROUP +
                      static_cast<std::size_t>(cell % QJ_LATTICE_GROUP)) != 0;
  }
  /// Whether a level tells the image of p, which is not near the side of a cell, map coordinates.
  bool tells(std::size_t level, const Vector3d& p) const {
    int number = 0;
    for (int axis = 2; axis >= 0; --axis) {
      double along = -of(level, static_cast<std::size_t>(QJ_GRID_ORIGIN + axis));
      for (int c = 0; c < 3; ++c) {
        along += p[c] * of(level, static_cast<std::size_t>(QJ_LEVEL_AXES + 3 * axis + c));
      }
      const int at = static_cast<int>(std::floor(along / of(level, QJ_GRID_STEP)));
      const int points = count(level, static_cast<std::size_t>(axis));
      if (at < 0 || at >= points - 1) return false;
      number = number * points + at;
    }
    return is_trusted(level, number);
  }
  /// F and U of a node, which is stored.
  std::pair<double, Eigen::Vector4d> node(std::size_t level, int number) const {
    const int group = places.at(group_of(level, number));
    const int member = number % QJ_LATTICE_GROUP;
    REQUIRE((group >> member & 1) == 1);
    const auto at = static_cast<std::size_t>((group >> QJ_LATTICE_GROUP) + member);
    return {field.at(at),
            {versors.at(4 * at), versors.at(4 * at + 1), versors.at(4 * at + 2),
             versors.at(4 * at + 3)}};
  }
  /// The same at `way` from a cell's lowest node, by Lagrange's polynomial through four nodes along
  /// each axis, written as it stands in books.
  std::pair<double, Eigen::Vector4d> image(std::size_t level, int number,
                                           const Vector3d& way) const {
    const auto weight = [](int m, double s) {
      double w = 1;
      for (int j = -1; j <= 2; ++j) {
        if (j != m) w *= (s - j) / (m - j);
      }
      return w;
    };
    double f = 0;
    Eigen::Vector4d u = Eigen::Vector4d::Zero();
    for (int k = -1; k <= 2; ++k) {
      for (int j = -1; j <= 2; ++j) {
        for (int i = -1; i <= 2; ++i) {
          const auto [node_f, node_u] =
              node(level, number + (k * count(level, 1) + j) * count(level, 0) + i);
          const double w = weight(i, way[0]) * weight(j, way[1]) * weight(k, way[2]);
          f += w * node_f;
          u += w * node_u;
        }
      }
    }
    return {f, u};
  }
};

/// F and U after so many iterates, U times e^-(F of the iterates before).
std::pair<double, Eigen::Vector4d> composed(const Map& map, const Vector3d& p, int iterates) {
  Quaternion q{p.x(), p.y(), p.z(), map.dynamics.slice};
  double before = 0;
  for (int n = 1;; ++n) {
    const auto [f, u] = reference::step(map, q);
    if (n == iterates) return {f, std::exp(-before) * Eigen::Vector4d(u.x, u.y, u.z, u.w)};
    before += f;
    q = std::exp(f) * u;
  }
}

/// How far apart two such images are, in F and U.
double apart(const std::pair<double, Eigen::Vector4d>& a,
             const std::pair<double, Eigen::Vector4d>& b) {
  return std::abs(a.first - b.first) + (a.second.normalized() - b.second.normalized()).norm() +
         std::abs(std::log(a.second.norm() / b.second.norm()));
}

/// A close-up of a map, seen by few pixels.
picture::View close_view(const Map& map) {
  Camera camera;
  camera.zoom = 60;
  const ShapeToMap& to_map = map.frame.shape_to_map;
  return picture::camera_view(camera, to_map.to_map(*map.frame.box), 80, 60, 1);
}

}  // namespace

TEST_CASE("a lattice trusts cells where it interpolates_images images, and no others") {
  const Device any = test::shared_device();
  const Map map = calibrated(any, steepened(test::armed_ball_map(60), 12));
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const Device device = test::with_width(width);
    const picture::MarchedSet set{map, 6, {}, {}, Precision::single};
    const picture::Band band = picture::find_band(device, set, *map.frame.box);
    const picture::BandGrid grid(device, set, band);
    const map::DeviceMap device_map(device, map, band.stops, Precision::single);
    const double allowed = 0.02;
    constexpr double kMostNodes = 1e7;
    const auto cells = [&](const surface::Grid& nodes) {
      std::vector<std::int32_t> numbers;
      surface::for_points(nodes.points.array() - 3, [&](std::size_t, const Eigen::Vector3i& inner) {
        const Eigen::Vector3i cell = inner.array() + 1;
        if (!grid.has_orbits_near(nodes.at(cell.cast<double>().array() + 0.5), nodes.step)) return;
        numbers.push_back(static_cast<std::int32_t>(surface::number_of(cell, nodes.points)));
      });
      return numbers;
    };
    const surface::ImageLattice lattice(
        device_map, grid.bounds(), cells,
        {allowed / band.steepest, 0.3 * allowed / band.steepest, band.steepest, kMostNodes}, {});
    const ReadLattice read(device.context(), lattice, 1);
    int checked = 0, wrong = 0, trusted = 0;
    const int all = read.count(0, 0) * read.count(0, 1) * read.count(0, 2);
    for (int number = 0; number < all; ++number) {
      if (!read.is_trusted(0, number)) continue;
      ++trusted;
      if (number % 7 != 0) continue;
      const Vector3d way(std::fmod(0.37 * number, 1), std::fmod(0.71 * number, 1),
                         std::fmod(0.13 * number, 1));
      const auto [f, u] = read.image(0, number, way);
      const Vector3d p = read.point(0, number, way);
      const auto step = reference::step(map, {p.x(), p.y(), p.z(), map.dynamics.slice});
      const Eigen::Vector4d expected(step.versor.x, step.versor.y, step.versor.z, step.versor.w);
      ++checked;
      if (std::abs(f - step.log_norm) + (u - expected).norm() > 2 * allowed) ++wrong;
    }
    CHECK(checked > 500);
    CHECK(wrong <= 0.01 * checked);
    CHECK(trusted < 0.9 * all);  // far from the band nothing is known beforehand
  }
}

TEST_CASE("levels of a lattice compose iterates, as orbits do, in any frame") {
  const Map map = calibrated(test::shared_device(), steepened(test::armed_ball_map(60), 12));
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const Device device = test::with_width(width);
    const StopRadii stops = find_stop_radii(device, map);
    const map::DeviceMap device_map(device, map, stops, Precision::single);
    const Eigen::Matrix3d axes =
        Eigen::AngleAxisd(0.7, Vector3d(1, -2, 3).normalized()).toRotationMatrix();
    // About a point of the surface, each level finer than the one that composes less.
    const Vector3d middle = axes * Vector3d(0, 0.75, 0);
    constexpr double kDisplacement = 1e-4;
    std::vector<surface::ImageLattice::Level> levels;
    for (const int iterates : {3, 2, 1}) {
      surface::ImageLattice::Level level{iterates, kDisplacement, axes, {}, {}};
      const double step = 0.02 * std::pow(15, 1 - iterates);
      const Vector3d reach = Vector3d::Constant(4 * step);
      level.grid = surface::ImageLattice::grid_about({middle - reach, middle + reach}, step);
      const Eigen::Vector3i inner = level.grid.points.array() - 3;
      surface::for_points(inner, [&](std::size_t, const Eigen::Vector3i& at) {
        level.cells.push_back(static_cast<std::int32_t>(
            surface::number_of(Eigen::Vector3i(at.array() + 1), level.grid.points)));
      });
      levels.push_back(level);
    }
    const surface::ImageLattice lattice(device_map, levels, {});
    CHECK(lattice.iterates() == 3);
    const ReadLattice read(device.context(), lattice, levels.size());
    for (std::size_t i = 0; i < levels.size(); ++i) {
      const surface::ImageLattice::Level& level = levels[i];
      CAPTURE(level.iterates);
      // How far the image moves with the point.
      const auto moved = [&](const Vector3d& p, double way) {
        const auto here = composed(map, p, level.iterates);
        double squares = 0;
        for (int axis = 0; axis < 3; ++axis) {
          const Vector3d by = way * axes.row(axis).transpose();
          squares += std::pow(apart(composed(map, p + by, level.iterates), here), 2);
        }
        return std::sqrt(squares);
      };
      int trusted = 0, wrong = 0, told = 0, wrongly_told = 0;
      double worst = 0;
      for (const std::int32_t cell : level.cells) {
        const Vector3d at_node = read.point(i, cell, Vector3d::Zero());
        const double off = apart(read.node(i, cell), composed(map, at_node, level.iterates));
        bool is_told = false;
        for (std::size_t j = i + 1; j < levels.size(); ++j) {
          is_told = is_told || read.tells(j, at_node);
        }
        if (is_told) {
          // It goes on from the image that a level of fewer iterates tells.
          ++told;
          if (off > 2 * moved(at_node, kDisplacement)) ++wrongly_told;
        } else {
          // What rounding does to the point shows in the image as a move of the point does.
          worst = std::max(worst, off / (1e-4 + moved(at_node, 1e-6)));
        }
        if (!read.is_trusted(i, cell)) continue;
        ++trusted;
        const Vector3d way(std::fmod(0.37 * cell, 1), std::fmod(0.71 * cell, 1),
                           std::fmod(0.13 * cell, 1));
        const Vector3d p = read.point(i, cell, way);
        const double away = apart(read.image(i, cell, way), composed(map, p, level.iterates));
        if (away > 2 * moved(p, kDisplacement)) ++wrong;
      }
      CHECK(worst < 4);
      CHECK((told > 0) == (i + 1 < levels.size()));
      CHECK(wrongly_told <= 0.03 * told);
      CHECK(trusted > 0.05 * static_cast<double>(level.cells.size()));
      CHECK(wrong <= 0.03 * trusted);
    }
  }
}

TEST_CASE(
    "a close-up by composed images differs less than a move by an eighth of a pixel makes it") {
  const Map map = calibrated(test::shared_device(), steepened(test::armed_ball_map(60), 12));
  const picture::View view = close_view(map);
  picture::View moved = view;
  moved.eye += 0.125 * view.footprint * view.dir_dx.normalized();
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const Device device = test::with_width(width);
    picture::MarchedSet set{map, 6, {}, {}, Precision::single};
    set.rays = 1e5;  // as many as make a table worth its making
    const auto depths = [&](const picture::View& seen) {
      return picture::march_source(device, set)->depths(seen, 0, seen.rows);
    };
    const auto source = picture::march_source(device, set);
    source->prepare(view);
    CHECK(source->lookups().iterates >= 2);
    CHECK(source->lookups().trusted_share > 0.6);
    const std::vector<float> found = source->depths(view, 0, view.rows);
    set.interpolates_images = false;
    const std::vector<float> expected = depths(view);
    // A few places where one ray passes what another meets do not outweigh the rest.
    const auto difference = [&](const std::vector<float>& other) {
      double sum = 0;
      for (std::size_t i = 0; i < expected.size(); ++i) {
        const bool hits = expected[i] >= 0, other_hits = other[i] >= 0;
        if (!hits && !other_hits) continue;
        sum += hits != other_hits
                   ? 4
                   : std::min(std::abs(double{expected[i] - other[i]}) / view.footprint, 4.0);
      }
      return sum;
    };
    CHECK(difference(found) > 0);
    CHECK(difference(found) < difference(depths(moved)));
    // Whatever is asked for first, and in whatever parts.
    set.interpolates_images = true;
    const auto again = picture::march_source(device, set);
    again->prepare(view);
    std::vector<float> strips = again->depths(view, 30, view.rows - 30);
    const auto top = again->depths(view, 0, 30);
    strips.insert(strips.begin(), top.begin(), top.end());
    CHECK(strips == found);
  }
}

TEST_CASE("an escape radius cuts the set, and one that would empty it is refused") {
  // q² at the circle of radius 1: orbits from 0.9 stay, whatever the escape radius above 1.
  const picture::View view = test::ball_view(41, 31, 1);
  const auto depths = [&](std::optional<double> escape, double shift) {
    Map map = check::unit_ball();
    map.dynamics.log_scale = shift;  // the set's radius is e^-shift
    return picture::march_source(test::with_width(8), {map, 6, escape, {}, Precision::single})
        ->depths(view, 0, view.rows);
  };
  CHECK(depths(1.5, 0) == depths(30.0, 0));
  const auto hits = [](const std::vector<float>& all) {
    return std::ranges::count_if(all, [](float depth) { return depth >= 0; });
  };
  // e^-0.3 q²: a ball of radius 1.35, of which orbits that reach 1.1 are cut.
  CHECK(hits(depths(1.1, -0.3)) < hits(depths({}, -0.3)));
  CHECK_THROWS_WITH(depths(0.9, 0), Catch::Matchers::ContainsSubstring("escape: 0.9 "));
  CHECK_THROWS_WITH(depths(1e10, 0), Catch::Matchers::ContainsSubstring("escape: 10000000000"));
}

TEST_CASE("safe steps never lead into the ball, and the grid's coarse depths lie within a cell") {
  for (const int width : test::lane_widths()) {
    CAPTURE(width);
    const Device device = test::with_width(width);
    const picture::MarchedSet set{check::unit_ball(), 6, {}, {}, Precision::single};
    const picture::Band band = picture::find_band(device, set, *check::unit_ball().frame.box);
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

    const picture::View view = test::ball_view(61, 47, 1);
    const auto depths = grid.depths(view, 0, view.rows);
    int wrong = 0;
    test::for_pixels(view, depths, [&](int column, int row, double found) {
      const Vector3d ray = check::ray_direction(view, column, row);
      // Rays that pass close by the ball may go either way.
      const double passes = view.eye.cross(ray).norm();
      if (std::abs(passes - 1) < grid.step()) return;
      if ((found >= 0) != (passes < 1)) ++wrong;
      if (found >= 0 && std::abs((view.eye + found * ray).norm() - 1) > grid.step()) ++wrong;
    });
    CHECK(wrong == 0);
  }
}

TEST_CASE("at n = 1 the silhouette and the depths are those of the extracted mesh") {
  const Device device = test::shared_device();
  const Map map = steepened(test::armed_ball_map(60), 10);
  const auto marched = picture::march_source(device, {map, 1, {}, {}, Precision::single});
  SurfaceOptions options;
  options.resolution = 160;
  options.iterations = 1;
  TriangleMesh mesh = extract_surface(device, map, options);
  for (Vector3d& vertex : mesh.vertices) vertex = map.frame.shape_to_map.to_map(vertex);
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

namespace {

/// The values that colour points, computed step by step in double precision.
class TraitReference {
 public:
  TraitReference(const Map& map, const StopRadii& stops, int iterations)
      : map_(map), iterations_(iterations), level_(map.dynamics.surface_level) {
    low_ = std::clamp(std::log(stops.inner), level_ - 2, level_ - 1e-3);
    high_ = std::clamp(std::log(std::min(stops.outer, stops.escape)), level_ + 1e-3, level_ + 2);
  }

  double operator()(const Vector3d& point, double width, Material material) const {
    std::array<Quaternion, 4> corners;
    const std::array<Vector3d, 4> away{{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}};
    for (std::size_t i = 0; i < 4; ++i) {
      const Vector3d p = point + 0.5 * width / std::sqrt(3.0) * away[i];
      corners[i] = {p.x(), p.y(), p.z(), map_.dynamics.slice};
    }
    double open = 1, count = 0, told = 1, groove = 0;
    std::array<double, 2> angles{}, known{};
    for (int m = 0; m < iterations_; ++m) {
      const Images images = iterate(corners);
      const double middle = (level_ - low_) / (high_ - low_);
      const double share = std::clamp((images.f - low_) / (high_ - low_), 0.0, 1.0);
      const double narrow = std::min(middle, 1 - middle);
      if (m == 0) groove = std::lerp(middle, share, resolved(narrow * narrow * images.risen));
      open *= std::lerp(0.7, images.openness, told * resolved(images.risen));
      count += open;
      told *= resolved(images.turned);
      if (m > 1) continue;
      angles[static_cast<std::size_t>(m)] = images.angle;
      known[static_cast<std::size_t>(m)] = told;
    }
    if (material == Material::iterations) return count / iterations_;
    if (material == Material::groove) return groove;
    const double both = std::lerp(mean_lesser(angles[0]), std::min(angles[0], angles[1]), known[1]);
    return std::lerp(0.27242, both, known[0]);
  }

 private:
  struct Images {
    double angle = 0, openness = 0, f = 0, turned = 0, risen = 0;
  };

  static double resolved(double square) {
    const double t = std::clamp((square - 0.01) / 0.07, 0.0, 1.0);
    return 1 - t * t * (3 - 2 * t);
  }
  /// The mean of min(a, |X|) over unit quaternions, by its integral.
  static double mean_lesser(double a) {
    constexpr int kSteps = 2000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double t = a * (i + 0.5) / kSteps;
      sum += 1 - 2 / std::numbers::pi * (t * std::sqrt(1 - t * t) + std::asin(t));
    }
    return sum * a / kSteps;
  }
  double openness(double f) const {
    return std::clamp(std::min((f - low_) / (level_ - low_), (high_ - f) / (high_ - level_)), 0.0,
                      1.0);
  }
  Images iterate(std::array<Quaternion, 4>& corners) const {
    Images images;
    Quaternion mean;
    double squares = 0, sum = 0;
    for (Quaternion& q : corners) {
      const auto step = reference::step(map_, q);
      const double r = std::exp(std::min(step.log_norm, 40.0));
      q = r * step.versor;
      mean = mean + 0.25 * step.versor;
      images.angle += 0.25 * std::abs(step.versor.x);
      images.openness += 0.25 * openness(step.log_norm);
      const double f = std::clamp(step.log_norm, low_ - 1, high_ + 1);
      sum += 0.25 * f;
      squares += 0.25 * f * f;
    }
    const double narrow = std::min(level_ - low_, high_ - level_);
    images.f = sum;
    images.turned = 1 - dot(mean, mean);
    images.risen = (squares - sum * sum) / (narrow * narrow);
    return images;
  }

  Map map_;
  int iterations_;
  double level_, low_ = 0, high_ = 0;
};

}  // namespace

TEST_CASE("points are coloured by the orbits about them, as far as these stay together") {
  Map map = test::random_map(7, 0.3, 0.5, 3);
  map.dynamics.factors.push_back({{0, 0, 0, 0}, 3});
  map.frame.box = Box{{-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}};
  const Material material = GENERATE(Material::iterations, Material::trap, Material::groove);
  const int n = 5;
  for (const int lanes : test::lane_widths()) {
    const Device device = test::with_width(lanes);
    const auto source =
        picture::march_source(device, {map, n, {}, {}, Precision::single, material});
    const TraitReference reference(map, find_stop_radii(device, map), n);
    std::vector<Vector3d> points;
    std::vector<double> widths;
    for (int i = 0; i < 301; ++i) {
      points.emplace_back(std::sin(0.7 * i) * 1.2, std::cos(1.3 * i) * 0.9, std::sin(2.1 * i));
      widths.push_back(std::pow(10, -1 - i % 3));
    }
    const auto found = source->traits(points, widths);
    REQUIRE(found.size() == points.size());
    int wrong = 0;
    std::set<int> seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (std::abs(found[i] - reference(points[i], widths[i], material)) > 4e-3) ++wrong;
      seen.insert(static_cast<int>(20 * found[i]));
    }
    // Orbits that rounding changes.
    CHECK(wrong <= 6);
    CHECK(seen.size() >= 5);
  }
}

TEST_CASE("a point has the number of the nearest factor, and edges are soft") {
  Map map = test::random_map(7, 0.3, 0.5, 3);
  map.frame.box = Box{{-1.5, -1.5, -1.5}, {1.5, 1.5, 1.5}};
  map.dynamics.factors.push_back({{0, 0, 0, 0}, 3});
  const Device device = test::shared_device();
  const auto source =
      picture::march_source(device, {map, 3, {}, {}, Precision::single, Material::factor});
  std::vector<Vector3d> points;
  for (int i = 0; i < 200; ++i) {
    points.emplace_back(std::sin(0.7 * i) * 1.2, std::cos(1.3 * i) * 0.9, std::sin(2.1 * i));
  }
  const double width = 1e-4, all = 1e4;
  const auto found = source->traits(points, std::span(&width, 1));
  const auto flat = source->traits(points, std::span(&all, 1));
  const auto& factors = map.dynamics.factors;
  int wrong = 0;
  std::set<int> rulers;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Quaternion q{points[i].x(), points[i].y(), points[i].z(), map.dynamics.slice};
    const auto ruler = std::ranges::min_element(
        factors, {}, [&](const Factor& factor) { return norm(q - factor.center); });
    const double turns = static_cast<double>(ruler - factors.begin() + 1) * 0.618034;
    const double own = 0.5 * (turns - std::floor(turns)) + (ruler->exponent > 0 ? 0.5 : 0);
    if (std::abs(found[i] - own) > 1e-3) ++wrong;
    rulers.insert(static_cast<int>(ruler - factors.begin()));
    CHECK(std::abs(flat[i] - flat[0]) < 1e-2);
  }
  CHECK(wrong <= 2);  // points on an edge
  CHECK(rulers.size() >= 4);
}

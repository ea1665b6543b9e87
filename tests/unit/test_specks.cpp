// Specks and pits in depths of sets built by hand, and shadows in close-ups of them.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <functional>
#include <vector>

#include "layout/picture_layout.h"
#include "picture/near_shadow.hpp"
#include "picture/specks.hpp"

using namespace qjulia;
using namespace qjulia::picture;
using Eigen::Vector3d;

namespace {

constexpr float kMiss = QJ_NO_HIT;

DepthGrid grid_of(int columns, const std::vector<float>& depths) {
  return {columns, static_cast<int>(depths.size()) / columns, depths};
}

/// A set that is drawn by short steps.
class Solid : public DepthSource {
 public:
  using Inside = std::function<bool(const Vector3d&)>;
  Solid(Inside is_inside, double largest, double largest_free = 0)
      : is_inside_(std::move(is_inside)),
        largest_(largest),
        largest_free_(std::max(largest, largest_free)) {}

  std::vector<float> depths(const View& view, int first_row, int rows) override {
    rows_asked += rows;
    std::vector<float> found;
    for (int row = first_row; row < first_row + rows; ++row) {
      for (int column = 0; column < view.columns; ++column) {
        found.push_back(first_inside(view, column, row, 0));
      }
    }
    return found;
  }
  double largest_speck() const override { return largest_; }
  double largest_free_speck() const override { return largest_free_; }
  std::vector<float> depths_beyond(const View& view, const std::vector<PassingRay>& rays) override {
    std::vector<float> found;
    for (const PassingRay& ray : rays) {
      double t = double{ray.hit} + kStep;
      while (t < double{ray.until} && is_inside_(at(view, ray.column, ray.row, t))) t += kStep;
      found.push_back(first_inside(view, ray.column, ray.row, t));
      passed.push_back(ray);
    }
    return found;
  }
  std::vector<bool> blocked(const View& light, const View& /*seen_by*/,
                            const std::vector<LightRay>& rays) override {
    std::vector<bool> found;
    for (const LightRay& ray : rays) {
      lit.push_back(light.at(ray.x, ray.y, double{ray.to}));
      reach = double{ray.to} - double{ray.from};
      found.push_back(lit.back().x() < -0.5);
    }
    return found;
  }
  std::vector<Vector3d> outline() override { return {}; }
  Box bounds() const override { return {{-1, -1, -1}, {1, 1, 1}}; }

  std::vector<PassingRay> passed;
  std::vector<Vector3d> lit;  ///< ends of rays of light
  double reach = 0;
  int rows_asked = 0;

 private:
  static constexpr double kStep = 1.0 / 128, kFar = 3;

  static Vector3d at(const View& view, int column, int row, double depth) {
    return view.at(column + 0.5, row + 0.5, depth);
  }
  float first_inside(const View& view, int column, int row, double from) const {
    for (double t = from; t < kFar; t += kStep) {
      if (is_inside_(at(view, column, row, t))) return static_cast<float>(t);
    }
    return kMiss;
  }

  Inside is_inside_;
  double largest_, largest_free_;
};

/// The view from above; pixels are 1/32 wide.
View view_from_above(int samples = 1) {
  View view = parallel_view(Vector3d::UnitZ(), {{-1, -1, -1}, {1, 1, 1}}, 64);
  view.samples = samples;
  return view;
}

Solid::Inside ball(const Vector3d& center, double radius) {
  return [=](const Vector3d& p) { return (p - center).norm() < radius; };
}

/// A slab under the plane z = −0.5, for x < 0.
bool is_in_slab(const Vector3d& p) { return p.z() < -0.5 && p.x() < 0; }

std::vector<float> depths_of(Solid& solid, const View& view = view_from_above()) {
  return solid.depths(view, 0, view.rows);
}

}  // namespace

TEST_CASE("islands are small groups of samples with everything around them far behind") {
  // The second number of the fourth row hangs on the first row's end by a diagonal.
  const DepthGrid grid = grid_of(8, {kMiss, kMiss, kMiss, kMiss, kMiss, kMiss, kMiss, kMiss,  //
                                     kMiss, 2.0F,  2.1F,  kMiss, 9.0F,  9.0F,  9.0F,  9.0F,   //
                                     kMiss, kMiss, kMiss, 2.2F,  9.0F,  5.0F,  9.0F,  9.0F,   //
                                     kMiss, kMiss, kMiss, kMiss, 9.0F,  9.0F,  9.0F,  9.0F,   //
                                     kMiss, 3.0F,  kMiss, kMiss, kMiss, kMiss, kMiss, kMiss});
  using Groups = std::vector<SampleGroup>;
  CHECK(islands(grid, 0.5, 3) == Groups{{9, 10, 19}, {21}});
  CHECK(islands(grid, 0.5, 2) == Groups{{21}});
  CHECK(islands(grid, 4.5, 3) == Groups{{9, 10, 19}});
  // A group that reaches an edge may go on beyond it, and a group next to something nearer may be
  // attached to it.
  CHECK(islands(grid_of(3, std::vector<float>{kMiss, kMiss, kMiss, kMiss, 2.0F, 1.0F, kMiss, kMiss,
                                              kMiss}),
                0.5, 3)
            .empty());
  // A step within a group, whose sides hang together by another way, leaves it whole.
  CHECK(islands(grid_of(5, {kMiss, kMiss, kMiss, kMiss, kMiss,  //
                            kMiss, 2.0F,  2.9F,  kMiss, kMiss,  //
                            kMiss, 2.4F,  2.8F,  kMiss, kMiss,  //
                            kMiss, kMiss, kMiss, kMiss, kMiss}),
                0.5, 3) == Groups{{6, 11, 7, 12}});
  // A tip in front hangs together with what it stands on.
  const DepthGrid tipped = grid_of(4, {kMiss, kMiss, kMiss, kMiss,  //
                                       kMiss, 1.0F, 2.0F, kMiss,    //
                                       kMiss, kMiss, kMiss, kMiss});
  std::vector<bool> tips(12);
  tips[5] = true;
  CHECK(islands(tipped, 0.5, 3) == Groups{{5}});
  CHECK(islands(tipped, 0.5, 3, tips) == Groups{{5, 6}});
}

TEST_CASE("pits are small groups of samples with everything around them far in front of them") {
  const DepthGrid grid = grid_of(6, {1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F,   //
                                     1.0F, 3.0F, 1.0F, 1.0F, kMiss, 1.0F,  //
                                     1.0F, 1.0F, 1.0F, 1.0F, 1.0F, 1.0F});
  using Groups = std::vector<SampleGroup>;
  CHECK(pits(grid, 1, 1) == Groups{{7}, {10}});
  CHECK(pits(grid, 2.5, 1) == Groups{{10}});
  CHECK(islands(grid, 1, 6).empty());
}

TEST_CASE("specks are removed, and what is behind them is seen") {
  // Specks lie beside the slab's edge, in front of the slab, and one behind another.
  const auto specks = [](const Vector3d& p) {
    return ball({0.5, 0.5, 0}, 0.08)(p) || ball({-0.5, 0.5, 0}, 0.08)(p) ||
           ball({-0.5, -0.5, 0}, 0.08)(p) || ball({-0.5, -0.5, 0.4}, 0.05)(p);
  };
  Solid all([&](const Vector3d& p) { return is_in_slab(p) || specks(p); }, 0.2);
  Solid slab(is_in_slab, 0.2);
  const View view = view_from_above();
  REQUIRE((depths_of(all) != depths_of(slab)));
  CHECK((speckless_depths(all, view) == depths_of(slab)));
  // Larger pieces stay, and everything stays where all is to be drawn.
  Solid few([&](const Vector3d& p) { return is_in_slab(p) || specks(p); }, 0.14);
  const auto left = speckless_depths(few, view);
  CHECK((left != depths_of(slab)));
  CHECK((left != depths_of(few)));
  Solid kept([&](const Vector3d& p) { return is_in_slab(p) || specks(p); }, 0);
  CHECK((speckless_depths(kept, view) == depths_of(kept)));
}

TEST_CASE("wide pieces are specks only where nothing is seen around them") {
  const auto free = ball({0.5, 0.5, 0}, 0.2), in_front = ball({-0.5, 0.5, 0}, 0.2);
  Solid all([&](const Vector3d& p) { return is_in_slab(p) || free(p) || in_front(p); }, 0.2, 0.5);
  Solid left([&](const Vector3d& p) { return is_in_slab(p) || in_front(p); }, 0);
  CHECK((speckless_depths(all, view_from_above()) == depths_of(left)));
}

TEST_CASE("eight specks in a row are removed") {
  const auto row_of = [](int count) {
    return [count](const Vector3d& p) {
      for (int i = 0; i < count; ++i) {
        if (ball({0.5, 0.5, 0.9 - 0.2 * i}, 0.06)(p)) return true;
      }
      return is_in_slab(p);
    };
  };
  Solid slab(is_in_slab, 0.2), eight(row_of(8), 0.2), nine(row_of(9), 0.2);
  CHECK((speckless_depths(eight, view_from_above()) == depths_of(slab)));
  CHECK((speckless_depths(nine, view_from_above()) != depths_of(slab)));
}

TEST_CASE("the tip of an attached piece is not a speck") {
  // A spike on the slab, seen from its tip, and a cap on a thin stem.
  Solid solid(
      [](const Vector3d& p) {
        const bool is_on_spike = std::hypot(p.x() + 0.5, p.y() - 0.5) < 0.06 && p.z() < 0.5;
        const bool is_on_stem = std::hypot(p.x() + 0.5, p.y() + 0.5) < 0.03 && p.z() < 0.5;
        return is_in_slab(p) || (is_on_spike && p.z() > -1) || (is_on_stem && p.z() > -1) ||
               ball({-0.5, -0.5, 0.5}, 0.1)(p);
      },
      0.3);
  CHECK((speckless_depths(solid, view_from_above()) == depths_of(solid)));
  CHECK(!solid.passed.empty());
}

TEST_CASE("pits of a pixel are filled to their rims, and wider ones are left") {
  const auto slab_with_hole = [](double radius) {
    return [radius](const Vector3d& p) {
      return p.z() < -0.5 && std::hypot(p.x() - 0.015, p.y() - 0.015) > radius;
    };
  };
  Solid slab([](const Vector3d& p) { return p.z() < -0.5; }, 0);
  Solid pitted(slab_with_hole(0.02), 0), bored(slab_with_hole(0.06), 0);
  const View view = view_from_above();
  REQUIRE((depths_of(pitted) != depths_of(slab)));
  CHECK((speckless_depths(pitted, view) == depths_of(slab)));
  CHECK((speckless_depths(bored, view) == depths_of(bored)));
  // With several samples a pixel, pits of up to so many samples are narrower than two pixels.
  CHECK((speckless_depths(bored, view_from_above(4)) == depths_of(slab)));
}

TEST_CASE("specks do not depend on how rows are divided") {
  // There are many specks of many sizes and depths, some in front of others.
  Solid solid(
      [](const Vector3d& p) {
        if (is_in_slab(p)) return true;
        for (int i = 0; i < 20; ++i) {
          const Vector3d center(std::sin(1.7 * i), std::cos(2.9 * i), 0.4 * std::sin(5.3 * i));
          if (ball(0.9 * center, 0.02 + 0.004 * (i % 20))(p)) return true;
        }
        return false;
      },
      0.15);
  const View view = view_from_above(2);
  const auto whole = speckless_depths(solid, view);
  CHECK((whole != depths_of(solid)));
  for (const int rows : {7, 30}) {
    solid.rows_asked = 0;
    SpecklessDepths parts(solid, view, static_cast<std::size_t>(rows * view.columns));
    std::vector<float> all;
    for (int row = 0; row < view.rows; row += 5) {
      const auto some = parts.rows(row, std::min(5, view.rows - row));
      all.insert(all.end(), some.begin(), some.end());
    }
    CHECK(all == whole);
    CHECK(solid.rows_asked == view.rows);  // each once, though slabs look beyond their rows
  }
}

TEST_CASE(
    "rays of the key light end in what pixels see, where its texels are wider than they are") {
  Solid slab(is_in_slab, 0);
  const View view = view_from_above(2);
  Strip strip{.first_row = 10, .rows = 12, .samples = 2, .halo = 2};
  strip.depths = slab.depths(view, 18, 28);
  const auto light = [&](const Vector3d& towards, int texels) {
    return Light{
        towards.normalized(), {}, 0, parallel_view(towards.normalized(), slab.bounds(), texels)};
  };
  const Light low = light({1, 0.3, 1}, 12);
  const auto shadow = near_shadow(slab, view, low, strip);
  const double pixel = 2 * view.footprint;
  REQUIRE(low.view.footprint > 2 * pixel);
  CHECK(slab.reach == Catch::Approx(3 * (low.view.footprint - 2 * pixel)).epsilon(1e-3));
  REQUIRE(shadow.size() == 32 * 12);
  std::size_t ray = 0;
  // One more row of pixels above and below is needed to smooth the strip's own.
  for (int row = -1; row < 13; ++row) {
    const bool is_inside = row >= 0 && row < 12;
    for (int column = 0; column < 32; ++column) {
      const int i = 2 * column + 1, j = 2 * (row + 10) + 1;
      const float depth = strip.depths[index(i, j - 18, view.columns)];
      const bool is_shaded = is_inside && shadow[index(column, row, 32)] >= 128;
      if (depth < 0) {
        CHECK(!is_shaded);
        continue;
      }
      const Vector3d p = view.at(i + 0.5, j + 0.5, double{depth});
      REQUIRE(ray < slab.lit.size());
      CHECK((slab.lit[ray++] - p).norm() < 1e-5);
      if (is_inside) CHECK(is_shaded == (p.x() < -0.5));
    }
  }
  CHECK(ray == slab.lit.size());
  CHECK(ray > 100);
  CHECK(narrowest_penumbra(view, low) > 1);
  // No rays are cast for surfaces that face away from the light, nor where texels are fine.
  slab.lit.clear();
  near_shadow(slab, view, light({0.2, 0.1, -1}, 12), strip);
  CHECK(slab.lit.size() < ray / 8);
  slab.lit.clear();
  CHECK(near_shadow(slab, view, light({1, 0.3, 1}, 64), strip).empty());
  CHECK(narrowest_penumbra(view, light({1, 0.3, 1}, 64)) == 1);
  CHECK(slab.lit.empty());
}

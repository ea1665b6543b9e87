// What settings of light, matter and lens do to pictures of the unit ball.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <numeric>

#include "ball_view.hpp"
#include "base/srgb.hpp"
#include "environment_file.hpp"
#include "png_file.hpp"
#include "qjulia/picture/look.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;

namespace {

PictureOptions ball_options() {
  PictureOptions options = test::picture_of(48, 36);
  options.samples = 1;
  return options;
}

Image ball(const PictureOptions& options) {
  return render(test::shared_device(), check::unit_ball(), options);
}

/// A pixel's linear colour.
Rgb at(const Image& image, int column, int row) {
  const auto first = 3 * static_cast<std::size_t>(row * image.width + column);
  Rgb color;
  for (Eigen::Index i = 0; i < 3; ++i) {
    color[i] = base::srgb_decoded(image.pixels[first + static_cast<std::size_t>(i)] / 255.0);
  }
  return color;
}

Rgb middle(const PictureOptions& options) { return at(ball(options), 24, 18); }

/// Without any light but this lamp.
PictureOptions lit_by(const char* lamp) {
  PictureOptions options = ball_options();
  options.light.fill = 0;
  options.light.lamps = {lamp_from(lamp), lamp_from("0,0,0")};
  return options;
}

/// A black ball before white, without light, so that only its outline shows.
PictureOptions black_before_white() {
  PictureOptions options = test::picture_of(96, 72);
  options.ground = false;
  options.background = background_from("white");
  options.palette.clay = Rgb::Zero();
  options.matter.roughness = 1;
  options.light.fill = 0;
  options.light.lamps = {lamp_from("0,0,0"), lamp_from("0,0,0")};
  return options;
}

}  // namespace

TEST_CASE("a stop more doubles the light, and a lamp's strength does the same") {
  PictureOptions options = lit_by("0,20,0.3");
  options.tone = ToneCurve::none;
  const Rgb once = middle(options);
  REQUIRE(once.minCoeff() > 0.02);
  options.exposure = 1;
  CHECK(middle(options).isApprox(2 * once, 0.03));
  options.exposure = 0;
  options.light.lamps[0].strength = 0.6;
  CHECK(middle(options).isApprox(2 * once, 0.03));
}

TEST_CASE("an automatic exposure makes up for the lamps, and is repeated when it is given") {
  PictureOptions options = ball_options();
  options.exposure.reset();
  const Image usual = ball(options);
  options.light.lamps = rig_named(RigName::studio).lamps;
  for (Lamp& lamp : options.light.lamps) lamp.strength *= 8;
  options.light.fill = 8;
  CHECK(test::mean_difference(ball(options), usual) < 1);
  options.background = background_from("102030");  // as drafts and other looks may have
  Studio studio(test::shared_device(), check::unit_ball(), options);
  const Image metered = studio.picture(options.camera);
  CHECK(studio.exposure() == Catch::Approx(-3).margin(0.2));
  options.exposure = studio.exposure();
  CHECK(ball(options).pixels == metered.pixels);
}

TEST_CASE("without any light the set is black, and a plain background keeps its colour") {
  PictureOptions options = lit_by("0,0,0");
  options.background = background_from("8090a0");
  const Image image = ball(options);
  CHECK(at(image, 24, 18).maxCoeff() < 0.001);
  for (const auto& [column, row] : {std::pair{0, 0}, {47, 35}, {0, 35}}) {
    CHECK(color_name(at(image, column, row)) == "#8090a0");
  }
}

TEST_CASE("a coloured lamp colours no shadow in light that it does not send") {
  PictureOptions options = lit_by("-60,40,1,ff0000");
  options.background = background_from("white");
  const Image image = ball(options);
  for (int row = 0; row < 36; ++row) {
    const Rgb left = at(image, 0, row), right = at(image, 47, row);
    CHECK(left.maxCoeff() - left.minCoeff() < 0.02);
    CHECK(right.maxCoeff() - right.minCoeff() < 0.02);
  }
  options.background = background_from("transparent");
  CHECK(ball(options).alpha[0] == 0);
}

TEST_CASE("wax lets light through from behind, and glow and fog need none") {
  PictureOptions options = lit_by("180,0,4");
  const double dark = middle(options).sum();
  options.matter.wax = 1;
  options.light.lamps[0] = lamp_from("100,0,4");
  const Rgb through = at(ball(options), 20, 18);
  options.matter.wax = 0;
  CHECK(through.sum() > at(ball(options), 20, 18).sum() + 0.01);
  CHECK(dark < 0.01);

  PictureOptions glowing = lit_by("0,0,0");
  glowing.material = Material::height;
  glowing.palette = palette_from(std::vector<std::string>{"000000", "ffffff"}, glowing.material);
  glowing.matter.glow = 1;
  glowing.matter.glow_from = 0.5;
  const Image image = ball(glowing);
  CHECK(at(image, 24, 30).sum() < 0.01);  // the lower half of the palette
  CHECK(at(image, 24, 8).sum() > 0.1);
  // The lower part glows where the glow is strongest below its beginning.
  glowing.palette = palette_from(std::vector<std::string>{"ffffff", "808080"}, glowing.material);
  glowing.matter.glow_full = 0;
  const Image lower = ball(glowing);
  CHECK(at(lower, 24, 30).sum() > 0.1);
  CHECK(at(lower, 24, 8).sum() < 0.01);

  PictureOptions foggy = ball_options();
  foggy.background = background_from("0000ff");
  const double clear = at(ball(foggy), 24, 6).z();
  foggy.matter.fog = 1;
  CHECK(at(ball(foggy), 24, 6).z() > clear + 0.1);
}

TEST_CASE("metal is dark where nothing is around, and sheen is brightest at the edge") {
  PictureOptions options = lit_by("180,0,1");
  options.matter.metal = 1;
  CHECK(middle(options).sum() < 0.01);
  PictureOptions velvet = ball_options();
  velvet.ground = false;
  const Image plain = ball(velvet);
  velvet.matter.sheen = 1;
  const Image soft = ball(velvet);
  const auto gain = [&](int column) {
    return at(soft, column, 18).sum() - at(plain, column, 18).sum();
  };
  CHECK(gain(24) < 0.02);
  CHECK(gain(10) > 0.03);
}

TEST_CASE("every rig lights the ball, and no two are alike") {
  std::vector<Image> images;
  for (const auto rig : {RigName::studio, RigName::rim, RigName::low_key, RigName::noon,
                         RigName::dusk, RigName::museum}) {
    PictureOptions options = ball_options();
    options.light.rig = rig;
    images.push_back(ball(options));
    for (std::size_t i = 0; i + 1 < images.size(); ++i) {
      CHECK(test::mean_difference(images[i], images.back()) > 4);
    }
  }
  // A lamp that is the rig's own changes nothing.
  PictureOptions options = ball_options();
  options.light.lamps = {lamp_from("-61.7,41.4,1")};
  CHECK(ball(options).pixels == images.front().pixels);
}

TEST_CASE("white in an even environment cannot be told from it, and is as in an even sky") {
  const test::TemporaryFolder folder;
  const double radiance = GENERATE(0.5, 0.9);
  PictureOptions options = ball_options();
  options.light.environment = folder.file("even.hdr", test::even_hdr_bytes(radiance)).string();
  options.background = background_from("environment");
  options.ground = false;
  options.tone = ToneCurve::none;
  options.palette.clay = Rgb::Ones();
  options.matter.roughness = GENERATE(0.1, 0.55, 1.0);
  options.matter.metal = GENERATE(0.0, 1.0);
  const Image image = ball(options);
  const Rgb behind = at(image, 0, 0);
  CHECK(behind.x() == Catch::Approx(0.62 * radiance).epsilon(0.015));
  double least = 9, most = 0;
  for (int row = 0; row < 36; ++row) {
    for (int column = 0; column < 48; ++column) {
      least = std::min(least, at(image, column, row).x() / behind.x());
      most = std::max(most, at(image, column, row).x() / behind.x());
    }
  }
  CAPTURE(radiance, options.matter.roughness, options.matter.metal,
          middle(options).x() / behind.x());
  CHECK(least > 0.97);
  CHECK(most < 1.03);
}

TEST_CASE("an environment that is turned with the camera looks the same, and else does not") {
  PictureOptions options = ball_options();
  options.light.environment = GENERATE("evening", "studio");
  options.background = background_from("environment");
  options.matter.metal = 1;
  options.matter.roughness = 0.2;
  const Image first = ball(options);
  options.light.environment_turn = 90;
  CHECK(test::mean_difference(ball(options), first) > 4);
  options.camera.azimuth += 90;
  CHECK(test::mean_difference(ball(options), first) < 1);
  // A film's camera goes around in an environment that stays.
  Studio studio(test::shared_device(), check::unit_ball(), options);
  const Image again = studio.picture(options.camera);
  CHECK(again.pixels == ball(options).pixels);
}

TEST_CASE("lamps are added to an environment, and a rig's are left out") {
  PictureOptions options = ball_options();
  options.light.environment = "overcast";
  const Image sky = ball(options);
  options.light.rig = RigName::dusk;
  CHECK(ball(options).pixels == sky.pixels);
  options.light.lamps = {lamp_from("-60,30,1")};
  CHECK(at(ball(options), 18, 14).x() > at(sky, 18, 14).x() + 0.1);
  options.light.lamps.clear();
  options.light.fill = 0;
  CHECK(middle(options).maxCoeff() < 0.001);
  PictureOptions none = ball_options();
  none.background = background_from("environment");
  CHECK_THROWS_WITH(ball(none),
                    Catch::Matchers::ContainsSubstring("background: there is no environment"));
  none.light.environment = "dawn";
  CHECK_THROWS_WITH(ball(none),
                    Catch::Matchers::ContainsSubstring("environment: 'dawn' is not known"));
}

TEST_CASE("a mesh takes a look's light and matter, and clay of its palette") {
  PictureOptions options = ball_options();
  apply_look(options, "bone");
  const TriangleMesh mesh = shapes::sphere(4);
  const Image image = render_mesh(test::shared_device(), mesh, mesh.box(), options);
  CHECK(test::mean_difference(image, ball(options)) < 8);
}

TEST_CASE("a lens blurs what is out of focus, as wide as geometry says") {
  // Edges of the ball lie behind its front: the silhouette is blurred, and the front is sharp.
  PictureOptions options = black_before_white();
  // Pixels of the middle row that are neither black nor white.
  const auto grey = [&] {
    const Image image = ball(options);
    int count = 0;
    for (int column = 0; column < 96; ++column) {
      const double value = at(image, column, 36).x();
      if (value > 0.02 && value < 0.98) ++count;
    }
    return count;
  };
  CHECK(grey() <= 2);
  options.camera.distance = 6;
  options.camera.look_at = Eigen::Vector3d::Zero();
  options.camera.aperture = 0.3;
  options.camera.focus = Eigen::Vector3d::Zero();
  CHECK(grey() <= 6);  // the outline lies about as far as the middle
  // In focus at half the distance: a disc of aperture · focus seen from the ball's distance, over
  // the plane in focus, is .3 · 3 · (6 − 3) / 6 = .45 wide there, or .45 / 3 of a radian.
  const picture::CameraAxes axes = picture::camera_axes([&] {
    Camera camera = options.camera;
    camera.up = kDefaultUp;
    return camera;
  }());
  options.camera.focus = 3 * axes.back;
  const double pixels = 72 / (2 * std::tan(15 * std::numbers::pi / 180));
  CHECK(grey() / 2.0 == Catch::Approx(0.15 * pixels).epsilon(0.25));
}

TEST_CASE("an open shutter blurs edges as far as they move, in linear light") {
  // A black ball before white passes over the picture.
  PictureOptions options = black_before_white();
  options.tone = ToneCurve::none;
  options.samples = 4;
  options.camera.azimuth = options.camera.elevation = 0;
  options.camera.distance = 6;
  options.camera.look_at = Eigen::Vector3d::Zero();
  Studio studio(test::shared_device(), check::unit_ball(), options);
  const double pixels = 72 / (2 * std::tan(15 * std::numbers::pi / 180)) / 6;  // a shape unit
  constexpr int kWay = 12;                                                     // pixels
  Camera camera = options.camera;
  camera.up = kDefaultUp;
  const Eigen::Vector3d right = picture::camera_axes(camera).right;
  std::vector<Camera> moving;
  for (int i = 0; i < 64; ++i) {
    camera.look_at = ((i + 0.5) / 64 - 0.5) * kWay / pixels * right;
    moving.push_back(camera);
  }
  const Image still = studio.picture(options.camera),
              blurred = studio.picture(options.camera, moving);
  CHECK(studio.picture(options.camera, moving).pixels == blurred.pixels);
  // An edge becomes a ramp of linear light as long as the way.
  const auto row_of = [&](const Image& image) {
    std::vector<double> row;
    for (int column = 0; column < 48; ++column) row.push_back(at(image, column, 36).x());
    return row;
  };
  const std::vector<double> sharp = row_of(still), soft = row_of(blurred);
  const auto edge = static_cast<int>(std::ranges::find_if(sharp, [](double v) { return v < 0.5; }) -
                                     sharp.begin());
  REQUIRE(edge > kWay);
  for (int i = -kWay / 2 + 1; i < kWay / 2; ++i) {
    CAPTURE(i);
    CHECK(soft[static_cast<std::size_t>(edge + i)] ==
          Catch::Approx(0.5 - (i + 0.5) / kWay).margin(0.12));
  }
  CHECK(std::accumulate(soft.begin(), soft.end(), 0.0) ==
        Catch::Approx(std::accumulate(sharp.begin(), sharp.end(), 0.0)).margin(0.5));
}

TEST_CASE("without a focus the middle of the picture is in focus") {
  PictureOptions options = ball_options();
  options.camera.aperture = 0.1;
  options.camera.look_at = Eigen::Vector3d::Zero();
  options.camera.distance = 6;
  const Image chosen = ball(options);
  Camera camera = options.camera;
  camera.up = kDefaultUp;
  options.camera.focus = picture::camera_axes(camera).back;  // the ball's nearest point
  CHECK(test::mean_difference(ball(options), chosen) < 0.2);
  options.camera.focus = 7 * picture::camera_axes(camera).back;
  CHECK_THROWS_WITH(ball(options), Catch::Matchers::ContainsSubstring("focus: it lies behind"));
}

TEST_CASE("a studio whose light is set draws what a new one draws") {
  PictureOptions options;
  options.width = 48;
  options.height = 36;
  options.samples = 1;
  Studio studio(test::shared_device(), check::unit_ball(), options);
  const auto first = studio.picture(options.camera).pixels;
  const auto expect_same = [&](const auto& change) {
    change(options);
    Studio anew(test::shared_device(), check::unit_ball(), options);
    studio.set_light(options);
    const auto drawn = studio.picture(options.camera).pixels;
    CHECK((drawn == anew.picture(options.camera).pixels));  // bytes are not for eyes
    CHECK((drawn != first));
  };
  expect_same([](auto& o) { o.light.lamp_turn = 100; });
  expect_same([](auto& o) { o.matter.roughness = 0.1; });
  expect_same([](auto& o) { o.light.fill = 0.2; });
  expect_same([](auto& o) { o.palette.clay = Rgb(0.2, 0.5, 0.3); });
  expect_same([](auto& o) { o.ground = false; });
  expect_same([](auto& o) { o.light.environment = "evening"; });
  expect_same([](auto& o) { o.light.environment_turn = 70; });
  expect_same([](auto& o) { o.exposure = -1; });
  expect_same([](auto& o) { o.background = {Backdrop::plain, Rgb(1, 0, 0)}; });
}

TEST_CASE("a studio reads an environment once, whatever else of its light is set") {
  const test::TemporaryFolder folder;
  PictureOptions options = ball_options();
  options.light.environment = folder.file("sky.hdr", test::even_hdr_bytes(1));
  Studio studio(test::shared_device(), check::unit_ball(), options);
  const auto first = studio.picture(options.camera).pixels;
  folder.file("sky.hdr", "no environment");
  options.light.fill = 0.3;
  studio.set_light(options);
  CHECK((studio.picture(options.camera).pixels != first));
  options.light.environment = folder.file("other.hdr", "no environment");
  CHECK_THROWS_AS(studio.set_light(options), InputError);
}

TEST_CASE("lamps that stand still throw their light where they did while the camera goes around") {
  // From above, a turn of the camera alone turns the picture of a ball in still light.
  PictureOptions options;
  options.width = options.height = 48;
  options.samples = 1;
  options.camera.elevation = 90;
  options.ground = false;
  options.light.lamp_turn = 0;
  const auto mean_side = [&](double azimuth) {
    options.camera.azimuth = azimuth;
    const Image image = render(test::shared_device(), check::unit_ball(), options);
    double left = 0, right = 0;
    for (int y = 0; y < 48; ++y) {
      for (int x = 0; x < 48; ++x) {
        (x < 24 ? left : right) += image.pixels[static_cast<std::size_t>(3 * (48 * y + x))];
      }
    }
    return left / right;
  };
  const double still = mean_side(0), opposite = mean_side(180);
  CHECK(still > 1.05);  // the key lamp is on the left
  CHECK(opposite == Catch::Approx(1 / still).epsilon(0.02));
  options.light.lamp_turn.reset();
  CHECK(mean_side(180) == Catch::Approx(still).epsilon(0.02));
}

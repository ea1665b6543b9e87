// Pictures of the unit ball, which q² has for its filled Julia set, against closed forms.

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>

#include "armed_ball.hpp"
#include "ball_view.hpp"
#include "device/context.hpp"
#include "layout/picture_layout.h"
#include "picture/shading.hpp"
#include "png_file.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/surface/surface.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Eigen::Vector3d;

TEST_CASE("a ball's silhouette is the ellipse that perspective makes of it") {
  // The ball stands in a corner of what is framed, off the picture's middle.
  Map map = check::unit_ball();
  map.frame.box = Box{{-1, -1, -1}, {4, 2.5, 1.5}};
  const auto [width, iterations] = GENERATE(table<int, int>({{1, 6}, {8, 6}, {16, 1}, {16, 6}}));
  if (std::ranges::count(test::lane_widths(), width) == 0) return;
  CAPTURE(width, iterations);
  PictureOptions options = test::picture_of(320, 240);
  options.iterations = iterations;
  options.samples = 1;
  options.camera.look_at = map.frame.box->center();
  options.camera.distance = 12;
  const Image image = render(test::with_width(width), map, options);

  // The rays that meet the ball fill a cone of half angle α about the direction of its centre, at
  // an angle θ to the view's axis. A plane at distance 1 cuts the cone in an ellipse of half axes
  // sin α cos α / (cos²θ − sin²α) and sin α / √(cos²θ − sin²α).
  const picture::View view = picture::camera_view(options.camera, *map.frame.box, 320, 240, 1);
  const Vector3d axis = (view.dir + 160 * view.dir_dx + 120 * view.dir_dy).normalized();
  const double sine2 = 1 / view.eye.squaredNorm();
  const double cosine_to_axis = axis.dot(-view.eye.normalized());
  CHECK(std::acos(cosine_to_axis) > 0.09);
  const double apart = cosine_to_axis * cosine_to_axis - sine2;
  const double area = std::numbers::pi * sine2 * std::sqrt(1 - sine2) / std::pow(apart, 1.5) /
                      view.dir_dx.squaredNorm();
  CHECK(static_cast<double>(image.covered) == Catch::Approx(area).epsilon(0.01));
}

TEST_CASE("parallel rays see a ball as large wherever it is") {
  Map map = check::unit_ball();
  map.frame.box = Box{{-1, -1, -1}, {4, 2.5, 1.5}};
  PictureOptions options = test::picture_of(320, 240);
  options.samples = 1;
  options.camera.field_of_view = 0;
  options.camera.azimuth = options.camera.elevation = 0;
  options.camera.look_at = map.frame.box->center();
  options.camera.distance = 12;
  const double pixel = 2 * 12 * std::tan(std::numbers::pi / 12) / 240;
  const double area = std::numbers::pi / (pixel * pixel);
  const LayeredImage picture = layered_render(test::shared_device(), map, options);
  CHECK(static_cast<double>(picture.image.covered) == Catch::Approx(area).epsilon(0.01));
  // All that is seen lies on the ball.
  std::size_t seen = 0;
  for (std::size_t i = 0; i < picture.layers.depth.size(); ++i) {
    if (std::isinf(picture.layers.depth[i])) continue;
    const float* p = picture.layers.position.data() + 3 * i;
    CHECK(Vector3d(p[0], p[1], p[2]).norm() == Catch::Approx(1).margin(0.02));
    ++seen;
  }
  CHECK(static_cast<double>(seen) > area / 2);
  options.camera.look_at->z() -= 9;
  const Image moved = render(test::shared_device(), map, options);
  CHECK(std::abs(static_cast<double>(moved.covered) - static_cast<double>(picture.image.covered)) <
        0.01 * area);
}

TEST_CASE("pictures without loose pieces hide nothing else") {
  const Device device = test::shared_device();
  PictureOptions options = test::picture_of(80, 60);
  options.samples = 1;
  const Image plain = render(device, check::unit_ball(), options);
  options.keep_loose = true;
  CHECK(render(device, check::unit_ball(), options).pixels == plain.pixels);
  CHECK(plain.loose.count == 0);
  // Wild enough to have flakes, and thin ones: where nodes of interpolated images lie decides which
  // of them a ray meets, and nodes follow what is seen.
  options.exact = true;
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 3));
  const auto [all, with] = layered_render(device, map, options);
  options.keep_loose = false;
  const auto [some, without] = layered_render(device, map, options);
  CHECK(all.loose.count == 0);
  CHECK(some.loose.count > 0);
  CHECK(some.loose.volume > 0);
  CHECK(some.covered < all.covered);
  CHECK(10 * some.covered > 8 * all.covered);
  int nearer = 0;
  for (std::size_t i = 0; i < with.depth.size(); ++i) {
    if (without.depth[i] < with.depth[i]) ++nearer;
  }
  CHECK(nearer == 0);
}

TEST_CASE("cuts show the inside, and leave the rest where it is seen") {
  const Device device = test::shared_device();
  Map map = check::unit_ball();
  map.frame.shape_to_map = {2, {0, 1, 0}};  // the ball has radius 0.5 about (0, -0.5, 0)
  map.frame.box = Box{{-0.5, -1, -0.5}, {0.5, 0, 0.5}};
  PictureOptions options = test::picture_of(60, 45);
  const PictureLayers whole = layered_render(device, map, options).layers;
  options.cuts = {{'z', 0.1, false}, {'y', 1, false}};
  const auto [image, cut] = layered_render(device, map, options);
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
  CHECK_THROWS_WITH(render(device, map, options), Catch::Matchers::ContainsSubstring("cut: 'w'"));
  options.box = map.frame.box;
  options.cuts = {{'x', 0, true}};
  CHECK_THROWS_WITH(render(device, map, options),
                    Catch::Matchers::ContainsSubstring("cut: nothing is left"));
  options.box.reset();
  map.frame.box.reset();
  CHECK_THROWS_WITH(render(device, map, options),
                    Catch::Matchers::ContainsSubstring("give a coordinate"));
}

TEST_CASE("a studio's pictures are those drawn one by one, and tell when they will be done") {
  const Device device = test::shared_device();
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  PictureOptions options = test::picture_of(48, 36);
  Studio studio(device, map, options);
  for (const double azimuth : {30.0, 150.0}) {
    options.camera.azimuth = azimuth;
    std::vector<Progress> told;
    ProgressMonitor monitor;
    monitor.on_progress = [&](const Progress& progress) { told.push_back(progress); };
    CHECK(studio.picture(options.camera, monitor).pixels == render(device, map, options).pixels);
    REQUIRE(told.size() > 1);
    CHECK(told.back().fraction == Catch::Approx(1));
    for (std::size_t i = 0; i < told.size(); ++i) {
      CHECK(told[i].seconds_left >= 0);
      if (i > 0) CHECK(told[i].fraction > told[i - 1].fraction);
    }
  }
}

TEST_CASE("a studio whose picture was stopped anywhere draws the next as it should") {
  const Device device = test::shared_device();
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  const PictureOptions options = test::picture_of(48, 36);
  const auto whole = render(device, map, options).pixels;
  Studio studio(device, map, options);
  for (int reports = 1; reports < 60; reports += 19) {
    std::stop_source stop;
    ProgressMonitor monitor;
    monitor.stop = stop.get_token();
    int told = 0;
    monitor.on_progress = [&](const Progress&) {
      if (++told == reports) stop.request_stop();
    };
    CHECK_THROWS_AS(studio.picture(options.camera, monitor), Interrupted);
    CHECK(told == reports);
  }
  CHECK(studio.picture(options.camera).pixels == whole);
}

TEST_CASE("drafts of several sizes are drawn in one light, and look like the whole") {
  const Device device = test::shared_device();
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  PictureOptions options = test::picture_of(96, 72);
  Studio studio = Studio::of_drafts(device, map, options);
  studio.picture(options.camera);
  studio.resize(160, 120);
  options = test::picture_of(160, 120);
  const Image draft = studio.picture(options.camera), whole = render(device, map, options);
  REQUIRE(draft.pixels.size() == whole.pixels.size());
  CHECK(draft.covered == Catch::Approx(whole.covered).epsilon(0.02));
  double off = 0;
  for (std::size_t i = 0; i < whole.pixels.size(); ++i) {
    off += std::abs(draft.pixels[i] - whole.pixels[i]);
  }
  CHECK(off / static_cast<double>(whole.pixels.size()) < 4);
}

TEST_CASE("normals of depth point away from the ball's middle") {
  const Device device = test::with_width(1);
  device::Context& context = device.context();
  const picture::View view = test::ball_view(80, 60, 1);
  std::vector<float> depths;
  for (int row = 0; row < view.rows; ++row) {
    for (int column = 0; column < view.columns; ++column) {
      depths.push_back(static_cast<float>(check::sphere_depth(view, column, row)));
    }
  }
  const auto normals = context.allocate<float>(3 * depths.size());
  const auto kernel = context.kernel("shade.cl", "normals_of_depth", {1, Precision::single, {}});
  context.launch(kernel, {{80, 60, 1}, {0, 0, 0}},
                 {context.upload_real(view.packed(), Precision::single), 80, 0, 60,
                  context.upload<float>(std::span<const float>(depths)),
                  device::Argument::real(5 * view.footprint, Precision::single), normals},
                 device::kNotCounted);
  std::vector<float> found(normals.size());
  context.read(normals, std::span(found));
  double least = 1;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    if (depths[i] < 0) continue;
    const Vector3d ray =
        check::ray_direction(view, static_cast<int>(i % 80), static_cast<int>(i / 80));
    const Vector3d expected = view.eye + depths[i] * ray;
    const Vector3d normal(found[3 * i], found[3 * i + 1], found[3 * i + 2]);
    CHECK(normal.norm() == Catch::Approx(1).margin(1e-4));
    if (-ray.dot(expected) > 0.4) least = std::min(least, normal.dot(expected));
  }
  CHECK(least > std::cos(3 * std::numbers::pi / 180));
}

TEST_CASE("layers hold what each pixel shows, in the shape's coordinates") {
  Map map = check::unit_ball();
  map.frame.shape_to_map = {2, {0, 1, 0}};  // the ball has radius 0.5 about (0, -0.5, 0)
  map.frame.box = Box{{-0.5, -1, -0.5}, {0.5, 0, 0.5}};
  // The last is made in two strips.
  const auto [width, height, samples] =
      GENERATE(table<int, int, int>({{40, 30, 1}, {40, 30, 2}, {100, 80, 8}}));
  PictureOptions options = test::picture_of(width, height);
  options.samples = samples;
  options.camera.look_at = Vector3d(0, -0.5, 0);
  options.camera.distance = 2.5;
  const auto [image, layers] = layered_render(test::shared_device(), map, options);
  if (samples < 8) CHECK(image.pixels == render(test::shared_device(), map, options).pixels);
  REQUIRE(layers.depth.size() ==
          static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  REQUIRE(layers.normal.size() == 3 * layers.depth.size());
  REQUIRE(layers.position.size() == 3 * layers.depth.size());
  // In map coordinates.
  Camera camera = options.camera;
  camera.look_at = Vector3d::Zero();
  *camera.distance *= 2;
  const picture::View view =
      picture::camera_view(camera, *check::unit_ball().frame.box, width, height, 1);
  const Vector3d eye = (view.eye - Vector3d(0, 1, 0)) / 2;
  int hits = 0, wrong = 0;
  for (std::size_t i = 0; i < layers.depth.size(); ++i) {
    const int column = static_cast<int>(i) % width, row = static_cast<int>(i) / width;
    const bool seen = std::isfinite(layers.depth[i]);
    if (seen != (check::sphere_depth(view, column, row) >= 0)) ++wrong;
    const float* n = &layers.normal[3 * i];
    const float* x = &layers.position[3 * i];
    const Vector3d normal(n[0], n[1], n[2]), position(x[0], x[1], x[2]);
    if (!seen) {
      CHECK((normal.isZero() && position.array().isNaN().all()));
      continue;
    }
    ++hits;
    const Vector3d from_center = position - Vector3d(0, -0.5, 0);
    CHECK(from_center.norm() == Catch::Approx(0.5).margin(0.8 / (height * samples)));
    CHECK((position - eye).norm() == Catch::Approx(layers.depth[i]).margin(1e-3));
    // The pixel's middle, or the sample next to it.
    CHECK((position - eye).normalized().dot(check::ray_direction(view, column, row)) > 1 - 1e-4);
    CHECK(normal.norm() == Catch::Approx(1).margin(1e-4));
    if (-from_center.dot(position - eye) > 0.5 * 0.5 * layers.depth[i]) {
      CHECK(normal.dot(from_center) > 0.5 * 0.98);
    }
  }
  CHECK(hits > 200);
  CHECK(wrong < 0.08 * hits);
}

TEST_CASE("a comparison shows where the set is outside the mesh in red, and inside in blue") {
  const Device device = test::shared_device();
  const PictureOptions options = test::picture_of(60, 40);
  for (const double radius : {0.9, 1.1}) {
    TriangleMesh mesh = shapes::sphere(3);
    for (auto& vertex : mesh.vertices) vertex *= radius;
    const Image image = comparison(device, check::unit_ball(), mesh, options);
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

TEST_CASE("a picture's material changes the set's colours alone") {
  const Device device = test::shared_device();
  PictureOptions options = test::picture_of(40, 30);
  const auto [clay, layers] = layered_render(device, check::unit_ball(), options);
  options.material = Material::trap;
  const Image trap = render(device, check::unit_ball(), options);
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
  CHECK_THAT(depth, Catch::Matchers::ContainsSubstring("'shape': (2, 3)") &&
                        Catch::Matchers::ContainsSubstring("<f4"));
  REQUIRE(depth.size() == 128 + 6 * sizeof(float));
  CHECK(std::memcmp(depth.data() + 128, layers.depth.data(), 6 * sizeof(float)) == 0);
  const std::string normal = test::read_text(folder.path() / "a.b.normal.npy");
  CHECK_THAT(normal, Catch::Matchers::ContainsSubstring("'shape': (2, 3, 3)"));
  CHECK(normal.size() == 128 + 18 * sizeof(float));
}

TEST_CASE("the same picture twice is the same bytes; tiny pictures work") {
  const Device device = test::shared_device();
  const Image first = render(device, check::unit_ball(), test::picture_of(24, 17));
  CHECK(first.pixels.size() == 3 * 24 * 17);
  CHECK(render(device, check::unit_ball(), test::picture_of(24, 17)).pixels == first.pixels);
  CHECK(render(device, check::unit_ball(), test::picture_of(1, 1)).pixels.size() == 3);
}

namespace {

/// The distance at which a camera frames the map's box, shape units.
double framing_distance(const Map& map) {
  const picture::View view = picture::camera_view({}, *map.frame.box, 96, 72, 1);
  return (view.eye - map.frame.box->center()).norm();
}

}  // namespace

TEST_CASE("shading gives the stored pictures") {
  const Device device = test::shared_device();
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  const auto check = [](const Image& image, const std::string& name) {
    const auto path =
        std::filesystem::path(QJULIA_TEST_DATA) / "pictures" / ("armed_ball_" + name + ".png");
    if (std::getenv("QJULIA_TEST_WRITE_PICTURES") != nullptr) write_png(image, path);
    CAPTURE(name);
    CHECK(test::mean_difference(image, test::read_png(path)) <= 1);
  };
  PictureOptions options = test::picture_of(96, 72);
  // The camera frames the box of the map, zoomed in on the body.
  options.camera.look_at = map.frame.box->center();
  options.camera.distance = framing_distance(map);
  options.camera.zoom = 2.5;
  options.keep_loose = true;
  options.range = MaterialRange{0, 1};
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
  check(render_mesh(device, mesh, *map.frame.box, options), "mesh");
}

TEST_CASE("a shape stands on the ground whichever way is up") {
  const Device device = test::shared_device();
  const TriangleMesh box = shapes::box();
  PictureOptions options = test::picture_of(160, 120);
  const auto standing = [&](UpAxis up) {
    options.camera.up = up;
    return render_mesh(device, box, box.box(), options);
  };
  for (const auto& [up, down] : {std::pair{UpAxis::x, UpAxis::minus_x},
                                 {UpAxis::y, UpAxis::minus_y},
                                 {UpAxis::z, UpAxis::minus_z}}) {
    CHECK(test::mean_difference(standing(up), standing(down)) < 2);
  }
}

TEST_CASE("an eye within a mesh sees all around it") {
  const Device device = test::shared_device();
  const TriangleMesh box = shapes::box();
  PictureOptions options = test::picture_of(64, 48);
  options.camera.elevation = 0;
  options.camera.azimuth = 0;
  options.camera.field_of_view = 100;
  // Looks from well within, past the middle.
  for (const double ahead : {-1.9865, -1.7}) {
    options.camera.look_at = Eigen::Vector3d(0, 0, ahead);
    options.camera.up = UpAxis::y;
    const PictureLayers layers =
        Studio(device, box, box.box(), options).layered_picture(options.camera).layers;
    CHECK(std::ranges::all_of(layers.depth, [](float depth) { return std::isfinite(depth); }));
  }
}

TEST_CASE("a sheet that no canvas holds is refused before anything is drawn") {
  CHECK_THROWS_WITH(
      comparison(test::shared_device(), check::unit_ball(), shapes::sphere(2),
                 test::picture_of(16'384, 2)),
      Catch::Matchers::ContainsSubstring("width") && Catch::Matchers::ContainsSubstring("16379"));
}

TEST_CASE("shadows on the ground are soft, without hatching, and nowhere black") {
  const Device device = test::shared_device();
  const TriangleMesh sphere = shapes::sphere(4);
  const PictureOptions options = test::picture_of(320, 240);
  const LayeredImage drawn =
      Studio(device, sphere, sphere.box(), options).layered_picture(options.camera);
  const auto& image = drawn.image;
  const auto& layers = drawn.layers;
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
  const Device device = test::shared_device();
  const double fineness = GENERATE(0.2, 1.0);
  const auto source = picture::mesh_source(shapes::sphere(4));
  auto sky = picture::sky_lights(rig_named(RigName::studio), nullptr, UpAxis::y, source->bounds(),
                                 fineness, 64);
  for (auto& light : sky) light.depths = source->depths(light.view, 0, light.view.rows);
  picture::Scene scene;
  scene.ground_height = -1;
  const auto ground = picture::ground_light(device, scene, sky, fineness);
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
  const Device device = test::shared_device();
  PictureOptions options = test::picture_of(64, 48);
  const Image studio = render(device, check::unit_ball(), options);
  CHECK(studio.alpha.empty());
  options.background = background_from("transparent");
  const Image shadowed = render(device, check::unit_ball(), options);
  options.ground = false;
  const Image clear = render(device, check::unit_ball(), options);
  options.background = background_from("1e90ff");
  const Image plain = render(device, check::unit_ball(), options);
  options.ground = true;
  const Image on_ground = render(device, check::unit_ball(), options);
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

TEST_CASE("materials have no grain, however near or far") {
  const Device device = test::shared_device();
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  const Material material =
      GENERATE(Material::iterations, Material::trap, Material::groove, Material::factor);
  const double zoom = GENERATE(1.0, 2.5, 10.0, 60.0);
  CAPTURE(to_string(material), zoom);
  PictureOptions options = test::picture_of(72, 54);
  options.material = material;
  options.camera.zoom = zoom;
  options.keep_loose = true;
  options.ground = false;
  // A part of the surface, in the middle at every zoom.
  options.camera.look_at = Eigen::Vector3d(0.35, 0.35, 0.8);
  const Image image = render(device, map, options);
  options.samples *= 2;
  CHECK(test::mean_difference(image, render(device, map, options)) < 3);
}

TEST_CASE("a palette is spread over what a picture shows, over a film, or as given") {
  const Device device = test::shared_device();
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  PictureOptions options = test::picture_of(48, 36);
  options.material = Material::height;
  Studio studio(device, map, options);
  const Image whole = studio.picture(options.camera);
  const MaterialRange range = studio.range();
  CHECK(range.high - range.low > 1);
  Camera near = options.camera;
  near.zoom = 8;
  studio.picture(near);
  CHECK(studio.range().high - studio.range().low < 0.5 * (range.high - range.low));
  // A given range reproduces the picture, and it is kept.
  options.range = range;
  CHECK(render(device, map, options).pixels == whole.pixels);
  studio.set_range(range);
  studio.picture(near);
  CHECK(studio.range() == range);
  options.range = MaterialRange{range.high, range.high + 1};
  CHECK(render(device, map, options).pixels != whole.pixels);
  // The range is spread over both pictures.
  const std::array cameras{options.camera, near};
  const std::vector<float> shown = studio.shown(cameras);
  CHECK(shown.size() > 500);
  const MaterialRange of_film = range_over(shown, options.material);
  CHECK(of_film.low >= range.low - 0.1);
  CHECK(of_film.high <= range.high + 0.1);
}

TEST_CASE("specks that hang on nothing do not move the camera") {
  const Device device = test::shared_device();
  // A body, and beside it a ball with 0.4 % of its volume.
  Map two;
  two.dynamics.factors = {{{}, 3}, {{2, 0, 0, 0}, 1}};
  two.frame.box = Box{{-1, -1, -1}, {2.2, 1, 1}};
  PictureOptions options = test::picture_of(80, 60);
  options.iterations = 1;
  options.keep_loose = true;
  Studio studio(device, two, options);
  const std::vector<Vector3d> outline = studio.outline();
  CHECK(outline.size() > 50);
  for (const Vector3d& point : outline) CHECK(point.x() < 1.3);
  const Camera camera = studio.aimed(std::span(&options.camera, 1)).front();
  CHECK(std::abs(camera.look_at->x()) < 0.2);
  // A camera with a given point and distance draws the same picture.
  CHECK(studio.picture(camera).pixels == studio.picture(options.camera).pixels);
  // A requested part is framed, and cuts do not move the rest.
  options.box = Box{{-1, -1, -1}, {0, 1, 1}};
  Studio part(device, two, options);
  for (const Vector3d& point : part.outline()) CHECK(point.x() < 1e-6);
  options.box.reset();
  options.cuts = {{'x', 0, false}};
  CHECK(Studio(device, two, options).aimed(std::span(&options.camera, 1)).front().look_at ==
        camera.look_at);
}

TEST_CASE("a cut face shows rings in the colours of the material, or of clay") {
  const Device device = test::shared_device();
  PictureOptions options = test::picture_of(96, 72);
  options.samples = 1;
  options.camera.azimuth = options.camera.elevation = 0;
  options.cuts = {{'z', 0, false}};
  for (const Material material : {Material::clay, Material::groove, Material::iterations}) {
    CAPTURE(to_string(material));
    options.material = material;
    options.palette.stops = {Rgb(0.9, 0.02, 0.02), Rgb(0.02, 0.02, 0.9)};
    const auto [image, layers] = layered_render(device, check::unit_ball(), options);
    std::vector<int> red;
    std::size_t coloured = 0;
    for (std::size_t i = 0; i < layers.depth.size(); ++i) {
      const float* x = &layers.position[3 * i];
      // Pixels of the ball's inner half, which is one face.
      if (!std::isfinite(layers.depth[i]) || std::hypot(x[0], x[1]) > 0.9F) continue;
      const std::uint8_t* rgb = &image.pixels[3 * i];
      CHECK(rgb[0] + rgb[1] + rgb[2] > 40);  // nowhere black
      red.push_back(rgb[0]);
      if (std::abs(rgb[0] - rgb[2]) > 50) ++coloured;
    }
    REQUIRE(red.size() > 500);
    const auto [least, most] = std::ranges::minmax(red);
    CHECK(most - least > 15);
    if (material != Material::clay) CHECK(coloured > red.size() / 3);
  }
}

TEST_CASE("a palette colours clay and materials") {
  const Device device = test::shared_device();
  PictureOptions options = test::picture_of(48, 36);
  options.palette.clay = Rgb(0, 0.8, 0);
  const auto middle = [&] {
    const Image image = render(device, check::unit_ball(), options);
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
  const Device device = test::shared_device();
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  Map standing = map;
  standing.frame.up = UpAxis::minus_x;
  PictureOptions options = test::picture_of(32, 24);
  const Image by_map = render(device, standing, options);
  CHECK(by_map.covered > 50);
  CHECK(by_map.pixels != render(device, map, options).pixels);
  options.camera.up = UpAxis::minus_x;
  CHECK(by_map.pixels == render(device, map, options).pixels);
}

TEST_CASE("a picture counts the pixels that show the set") {
  const Device device = test::shared_device();
  PictureOptions options = test::picture_of(40, 30);
  options.samples = 1;
  const auto [image, layers] = layered_render(device, check::unit_ball(), options);
  const auto seen = std::ranges::count_if(layers.depth, [](float d) { return std::isfinite(d); });
  CHECK(image.covered == static_cast<std::size_t>(seen));
  CHECK(image.covered > 100);
  options.samples = 3;
  CHECK(render(device, check::unit_ball(), options).covered > image.covered);
  Map map = check::unit_ball();
  map.dynamics.slice = 50;
  CHECK(render(device, map, options).covered == 0);
  options.box = Box{{3, 3, 3}, {4, 4, 4}};
  CHECK(render(device, check::unit_ball(), options).covered == 0);
  const TriangleMesh sphere = shapes::sphere(3);
  CHECK(render_mesh(device, sphere, sphere.box(), options).covered > 100);
}

TEST_CASE("a stopped rendering gives no picture") {
  std::stop_source stop;
  stop.request_stop();
  ProgressMonitor monitor;
  monitor.stop = stop.get_token();
  CHECK_THROWS_AS(
      render(test::shared_device(), check::unit_ball(), test::picture_of(8, 8), monitor),
      Interrupted);
}

// What of pictures needs no device: options, views, rasterised meshes, files.

#include <png.h>

#include <Eigen/Geometry>
#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <memory>
#include <numbers>
#include <span>
#include <stop_token>

#include "batch/batch.hpp"
#include "picture/depth_grid.hpp"
#include "picture/depth_source.hpp"
#include "picture/framing.hpp"
#include "picture/material_traits.hpp"
#include "png_file.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Eigen::Vector3d;

namespace {

Image pattern(int width, int height, int seed) {
  Image image{width, height, {}};
  for (int i = 0; i < 3 * width * height; ++i) {
    image.pixels.push_back(static_cast<std::uint8_t>((i * i + seed * 77 + i) % 256));
  }
  return image;
}

/// The text chunks that libpng finds in a file it reads to the end.
PictureText text_of(const std::filesystem::path& path) {
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, file.get());
  png_read_png(png, info, PNG_TRANSFORM_IDENTITY, nullptr);
  png_textp chunks = nullptr;
  int count = 0;
  png_get_text(png, info, &chunks, &count);
  PictureText text;
  for (int i = 0; i < count; ++i) text[chunks[i].key] = chunks[i].text;
  png_destroy_read_struct(&png, &info, nullptr);
  return text;
}

}  // namespace

TEST_CASE("a PNG holds the picture's bytes") {
  const test::TemporaryFolder folder;
  for (const auto& [width, height] : {std::pair{1, 1}, {7, 3}, {64, 48}}) {
    const Image image = pattern(width, height, width);
    const auto path = folder.path() / "picture.png";
    write_png(image, path);
    const Image read = test::read_png(path);
    CHECK(read.width == width);
    CHECK(read.height == height);
    CHECK(read.pixels == image.pixels);
  }
}

TEST_CASE("a PNG says what it is told to") {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "picture.png";
  const PictureText text{{"Software", "qjulia"}, {"qjulia", std::string(5000, 'x')}};
  write_png(pattern(5, 4, 7), path, text);
  CHECK(text_of(path) == text);
  write_png(pattern(5, 4, 7), path);
  CHECK(text_of(path).empty());
}

TEST_CASE("a picture that cannot be written leaves nothing behind") {
  const test::TemporaryFolder folder;
  CHECK_THROWS_AS(write_png(pattern(2, 2, 0), folder.path() / "none" / "a.png"), OutputError);
  CHECK_THROWS_AS(write_png(Image{}, folder.path() / "a.png"), InputError);
  CHECK_THROWS_AS(write_png(Image{2, 2, {1, 2, 3}}, folder.path() / "a.png"), InputError);
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("a contact sheet holds each image in its cell") {
  const std::vector<Image> images = {pattern(3, 2, 1), pattern(3, 2, 2), pattern(2, 1, 3)};
  const Image sheet = contact_sheet(images, 2, 1);
  REQUIRE(sheet.width == 7);
  REQUIRE(sheet.height == 5);
  const auto at = [](const Image& image, int x, int y) {
    return image.pixels[static_cast<std::size_t>(3 * (y * image.width + x))];
  };
  CHECK(at(sheet, 2, 1) == at(images[0], 2, 1));
  CHECK(at(sheet, 4, 1) == at(images[1], 0, 1));
  CHECK(at(sheet, 1, 3) == at(images[2], 1, 0));
  CHECK(at(sheet, 3, 0) == 255);
  CHECK(at(sheet, 6, 4) == 255);
  CHECK_THROWS_AS(contact_sheet({}, 2), InputError);
}

TEST_CASE("a contact sheet leaves out pictures larger than any that is written") {
  const test::TemporaryFolder folder;
  batch::EntryStatus status;
  status.name = "a";
  status.state = batch::EntryState::done;
  status.files = {"a.png"};
  for (const int width : {16385, 16384}) {
    const Image image{width, 1, std::vector<std::uint8_t>(3 * static_cast<std::size_t>(width))};
    write_png(image, folder / "a.png");
    batch::write_summary(folder.path(), {status});
    CHECK(std::filesystem::exists(folder / "contact_sheet.png") == (width == 16384));
  }
}

TEST_CASE("a reduced picture has the means of its pixels") {
  Image image{5, 2, {}};
  for (int i = 0; i < 10; ++i) image.pixels.insert(image.pixels.end(), 3, std::uint8_t(10 * i));
  const Image half = reduced(image, 2);
  REQUIRE(half.width == 2);
  REQUIRE(half.height == 1);
  CHECK(half.pixels == std::vector<std::uint8_t>{30, 30, 30, 50, 50, 50});
  CHECK(reduced(image, 1).pixels == image.pixels);
  CHECK(reduced(image, 9).pixels.size() == 3);
  CHECK_THROWS_AS(reduced(image, 0), InputError);
}

TEST_CASE("options that make no picture are refused by name") {
  const auto refused = [](auto change, const std::string& name) {
    PictureOptions options;
    change(options);
    CHECK_THROWS_WITH(options.validate(), Catch::Matchers::ContainsSubstring(name));
    CHECK_THROWS_AS(options.validate(), InputError);
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused([](auto& o) { o.width = 0; }, "size");
  refused([](auto& o) { o.height = 100000; }, "size");
  refused([](auto& o) { o.iterations = 17; }, "iterations");
  refused([](auto& o) { o.samples = 0; }, "samples");
  refused([&](auto& o) { o.camera.azimuth = nan; }, "azimuth");
  refused([&](auto& o) { o.camera.elevation = nan; }, "elevation");
  refused([](auto& o) { o.camera.zoom = -1; }, "zoom");
  refused([](auto& o) { o.camera.field_of_view = 180; }, "field_of_view");
  refused([](auto& o) { o.background.color = {0, 2, 0}; }, "background");
  refused([](auto& o) { o.palette.stops.resize(1); }, "palette");
  refused([](auto& o) { o.palette.stops.resize(9, Rgb::Zero()); }, "palette");
  refused([](auto& o) { o.palette.clay = {0, 0, -1}; }, "palette");
  refused([](auto& o) { o.range = {1, 1}; }, "range");
  refused([&](auto& o) { o.range = {nan, 1}; }, "range");
  refused([](auto& o) { o.range = {0, 1, {0.5, 0.4}}; }, "range");
  refused([](auto& o) { o.camera.distance = 0; }, "distance");
  refused([](auto& o) { o.cuts = {{'w', 0, false}}; }, "cut: ");
  CHECK_NOTHROW(PictureOptions().validate());
}

TEST_CASE("colours have names and numbers, and palettes are known by name") {
  for (const char* text : {"#ff8000", "ff8000", "FF8000", "f80"}) {
    CAPTURE(text);
    REQUIRE(color_named(text));
    CHECK(color_name(*color_named(text)) == (std::string(text) == "f80" ? "#ff8800" : "#ff8000"));
  }
  CHECK(color_named("white") == Rgb(1, 1, 1));
  CHECK(color_named("black") == Rgb(0, 0, 0));
  // 188 of 255 is half of the light.
  CHECK(color_named("bcbcbc")->x() == Catch::Approx(0.5).margin(0.005));
  for (const char* text : {"", "#", "ff80", "ff80000", "gggggg", "-12345", "red", "##ff8000"}) {
    CHECK(!color_named(text));
  }
  CHECK(palette_names().front() == "earth");
  for (const std::string& name : palette_names()) {
    PictureOptions options;
    options.palette = palette_named(name).value();
    CHECK_NOTHROW(options.validate());
  }
  CHECK(!palette_named("mud"));
}

namespace {

/// Perceived lightness, 0 … 1: OKLab's, of linear light.
double lightness(const Rgb& c) {
  return 0.2104542553 *
             std::cbrt(0.4122214708 * c.x() + 0.5363325363 * c.y() + 0.0514459929 * c.z()) +
         0.7936177850 *
             std::cbrt(0.2119034982 * c.x() + 0.6806995451 * c.y() + 0.1073969566 * c.z()) -
         0.0040720468 *
             std::cbrt(0.0883024619 * c.x() + 0.2817188376 * c.y() + 0.6299787005 * c.z());
}

/// A palette's colour after this share of the way, as pictures go: in linear light.
Rgb color_after(const Palette& palette, double share) {
  const double way = share * static_cast<double>(palette.stops.size() - 1);
  const auto stop = std::min(static_cast<std::size_t>(way), palette.stops.size() - 2);
  const double rest = way - static_cast<double>(stop);
  return (1 - rest) * palette.stops[stop] + rest * palette.stops[stop + 1];
}

}  // namespace

TEST_CASE("even palettes rise evenly in lightness, and the wheel closes") {
  constexpr int kSteps = 56;
  for (const char* name : {"fern", "slate", "dusk"}) {
    CAPTURE(name);
    const Palette palette = palette_named(name).value();
    const double first = lightness(palette.stops.front()), last = lightness(palette.stops.back());
    CHECK(last - first > 0.6);
    double before = first;
    for (int i = 1; i <= kSteps; ++i) {
      const double share = double(i) / kSteps;
      const double now = lightness(color_after(palette, share));
      CHECK(now > before + 0.5 * (last - first) / kSteps);
      CHECK(std::abs(now - std::lerp(first, last, share)) < 0.02);
      before = now;
    }
  }
  const Palette wheel = palette_named("wheel").value();
  CHECK((wheel.stops.front() - wheel.stops.back()).norm() < 1e-12);
  for (int i = 0; i <= kSteps / 2; ++i) {
    const double share = double(i) / kSteps;
    const double there = lightness(color_after(wheel, share));
    CHECK(std::abs(there - lightness(color_after(wheel, 1 - share))) < 0.01);
    CHECK(std::abs(there - (0.4 + 0.84 * share)) < (i < 24 ? 0.02 : 0.07));  // its top is cut off
  }
}

TEST_CASE("a picture's alpha goes into its file, and sheets are white behind") {
  const test::TemporaryFolder folder;
  Image image{2, 1, {10, 20, 30, 40, 50, 60}, {255, 0}};
  write_png(image, folder.path() / "clear.png");
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_file(&png, (folder.path() / "clear.png").c_str()) != 0);
  CHECK((png.format & PNG_FORMAT_FLAG_ALPHA) != 0);
  png.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> bytes(PNG_IMAGE_SIZE(png));
  REQUIRE(png_image_finish_read(&png, nullptr, bytes.data(), 0, nullptr) != 0);
  CHECK(bytes == std::vector<std::uint8_t>{10, 20, 30, 255, 40, 50, 60, 0});
  const Image sheet = contact_sheet(std::vector<Image>{image}, 1);
  CHECK(sheet.pixels == std::vector<std::uint8_t>{10, 20, 30, 255, 255, 255});
  CHECK(sheet.alpha.empty());
  image.alpha.pop_back();
  CHECK_THROWS_AS(png_bytes(image), InputError);
}

TEST_CASE("images that follow one another are one file") {
  const Image first{2, 1, {10, 20, 30, 40, 50, 60}}, second{2, 1, {1, 2, 3, 4, 5, 6}};
  const std::string bytes = animated_png_bytes(std::vector<Image>{first, second, first}, 0.25);
  // Who knows no animations sees the first.
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  REQUIRE(png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) != 0);
  std::vector<std::uint8_t> read(PNG_IMAGE_SIZE(png));
  REQUIRE(png_image_finish_read(&png, nullptr, read.data(), 0, nullptr) != 0);
  CHECK(read == first.pixels);
  // acTL: three frames, for ever; fcTL: numbered along with the data, 250 / 1000 s.
  const auto at = [&](std::size_t place) { return bytes.substr(place, 8); };
  const std::size_t control = bytes.find("acTL");
  CHECK(at(control + 4) == std::string("\0\0\0\3\0\0\0\0", 8));
  std::size_t frames = 0, sequence = 0;
  for (std::size_t i = bytes.find("fcTL"); i != std::string::npos; i = bytes.find("fcTL", i + 1)) {
    CHECK(static_cast<std::size_t>(bytes[i + 7]) == sequence);
    CHECK(bytes.substr(i + 24, 4) == std::string("\0\xfa\x03\xe8", 4));
    sequence += frames++ == 0 ? 1 : 2;
  }
  CHECK(frames == 3);
  CHECK_THROWS_AS(animated_png_bytes({}, 0.1), InputError);
  CHECK_THROWS_AS(animated_png_bytes(std::vector<Image>{first, {1, 1, {1, 2, 3}}}, 0.1),
                  InputError);
}

TEST_CASE("cameras look where they say") {
  Camera camera;
  camera.azimuth = camera.elevation = 0;
  const picture::CameraAxes axes = picture::camera_axes(camera);
  CHECK((axes.back - Vector3d::UnitZ()).norm() < 1e-12);
  CHECK((axes.up - Vector3d::UnitY()).norm() < 1e-12);
  CHECK((axes.right - Vector3d::UnitX()).norm() < 1e-12);
  for (const UpAxis up :
       {UpAxis::x, UpAxis::y, UpAxis::z, UpAxis::minus_x, UpAxis::minus_y, UpAxis::minus_z}) {
    camera.up = up;
    camera.azimuth = 70;
    camera.elevation = 20;
    const picture::CameraAxes turned = picture::camera_axes(camera);
    CHECK((turned.right.cross(turned.up) - turned.back).norm() < 1e-12);
    CHECK(turned.right.dot(direction(up)) == Catch::Approx(0).margin(1e-12));
    CHECK(turned.back.dot(direction(up)) == Catch::Approx(std::sin(20 * M_PI / 180)));
  }
}

TEST_CASE("a framed box's upright cylinder stays in the picture, with a margin") {
  const Box box{{-1, -2, 0}, {3, 1, 1}};
  double widest = 0;
  for (const double azimuth : {0.0, 37.0, 200.0}) {
    Camera camera;
    camera.azimuth = azimuth;
    const picture::View view = picture::camera_view(camera, box, 320, 200, 1);
    Eigen::Matrix3d columns;
    columns << view.dir, view.dir_dx, view.dir_dy;
    for (int i = 0; i < 500; ++i) {
      // up is y.
      const Vector3d unit(std::sin(i), i % 2 == 0 ? -1 : 1, std::cos(i));
      const Vector3d p = box.center() + 0.5 * box.size().cwiseProduct(unit);
      const Vector3d seen = columns.inverse() * (p - view.eye);
      CHECK(seen[0] > 0);
      widest = std::max({widest, std::abs(seen[1] / seen[0] - 160) / 160,
                         std::abs(seen[2] / seen[0] - 100) / 100});
    }
  }
  CHECK(widest < 0.97);
  CHECK(widest > 0.7);
}

TEST_CASE("a camera looks at the point and the frame that it is given") {
  const Box box{{-1, -2, 0}, {3, 1, 1}};
  Camera camera;
  camera.azimuth = 37;
  const double far = (picture::camera_view(camera, box, 320, 200, 1).eye - box.center()).norm();
  // Where a point is seen, 0 at the middle, 1 at the edges.
  const auto seen = [&](const Vector3d& p) -> Eigen::Vector2d {
    const picture::View view = picture::camera_view(camera, box, 320, 200, 1);
    Eigen::Matrix3d columns;
    columns << view.dir, view.dir_dx, view.dir_dy;
    const Vector3d at = columns.inverse() * (p - view.eye);
    REQUIRE(at[0] > 0);
    return {at[1] / at[0] / 160 - 1, at[2] / at[0] / 100 - 1};
  };
  camera.look_at = Vector3d(2, 0.5, 0.3);
  CHECK(seen(*camera.look_at).norm() < 1e-9);
  CHECK(seen(box.center()).norm() > 0.1);
  camera.look_at.reset();
  camera.frame = Box{{2, 0, 0.2}, {2.4, 0.3, 0.5}};
  CHECK(seen(camera.frame->center()).norm() < 1e-9);
  double widest = 0;
  for (int i = 0; i < 500; ++i) {
    const Vector3d unit(std::sin(i), i % 2 == 0 ? -1 : 1, std::cos(i));
    const Vector3d p = camera.frame->center() + 0.5 * camera.frame->size().cwiseProduct(unit);
    widest = std::max(widest, seen(p).cwiseAbs().maxCoeff());
  }
  CHECK(widest < 0.97);
  CHECK(widest > 0.7);
  const picture::View view = picture::camera_view(camera, box, 320, 200, 1);
  CHECK((view.eye - camera.frame->center()).norm() == Catch::Approx(far));
  camera.look_at = Vector3d(2, 0, 0.2);  // a corner of the frame
  CHECK(seen(*camera.look_at).norm() < 1e-9);
}

namespace {

/// Where points are seen in a picture: from 0 at its left and upper edges to 1 at the others.
struct Extent {
  Eigen::Vector2d low{1e9, 1e9}, high{-1e9, -1e9};

  double tighter_share() const { return (high - low).maxCoeff(); }
  /// The distance between the middle of what is seen and the picture's middle.
  double off_middle() const { return (0.5 * (low + high).array() - 0.5).abs().maxCoeff(); }
};

Extent extent_of(const Camera& camera, const std::vector<Vector3d>& points, int width, int height) {
  const picture::View view = picture::camera_view(camera, {}, width, height, 1);
  Eigen::Matrix3d columns;
  const bool is_parallel = picture::is_parallel(camera);
  columns << view.dir, is_parallel ? view.eye_dx : view.dir_dx,
      is_parallel ? view.eye_dy : view.dir_dy;
  Extent extent;
  for (const Vector3d& point : points) {
    const Vector3d seen = columns.inverse() * (point - view.eye);
    REQUIRE(seen[0] > 0);
    const double nearer = is_parallel ? 1 : seen[0];
    const Eigen::Vector2d at(seen[1] / nearer / width, seen[2] / nearer / height);
    extent.low = extent.low.cwiseMin(at);
    extent.high = extent.high.cwiseMax(at);
  }
  return extent;
}

/// A body with a horn at a corner of its box, and other shapes that are not ellipsoids.
std::vector<std::vector<Vector3d>> framed_shapes() {
  std::vector<Vector3d> horned = shapes::sphere(3).vertices, needle, slab, corners, ring, dumbbell,
                        spiral, far_away;
  for (int i = 0; i <= 20; ++i)
    horned.emplace_back(Vector3d(0.5, 0.8, 0.5) + 0.07 * i * Vector3d(1, 1, 0.4));
  for (const Vector3d& p : shapes::sphere(3).vertices) {
    needle.emplace_back(0.1 * p.x(), 5 * p.y() + 3, 0.1 * p.z());
    slab.emplace_back(30 * p.x() - 100, p.y(), 20 * p.z());
    corners.push_back(p.cwiseSign());
    ring.emplace_back(Vector3d(p.x(), 0, p.z()).stableNormalized() + 0.2 * p);
    dumbbell.emplace_back(0.4 * p + Vector3d(p.x() > 0 ? 2 : -1, p.x() > 0 ? 1 : 0, 0));
    far_away.emplace_back(1e-3 * p + Vector3d(7, -5, 3));
  }
  for (int i = 0; i <= 200; ++i) {
    const double turn = 0.1 * i;
    spiral.emplace_back(turn * std::cos(turn), 0.5 * turn, turn * std::sin(turn));
  }
  return {horned, needle, slab, corners, ring, dumbbell, spiral, far_away};
}

Camera standing_camera(double azimuth, double elevation) {
  Camera camera;
  camera.azimuth = azimuth;
  camera.elevation = elevation;
  camera.up = UpAxis::y;
  return camera;
}

}  // namespace

TEST_CASE("what is framed fills the tighter side and stands in the middle at every aspect") {
  for (const auto& points : framed_shapes()) {
    const std::vector<Vector3d> outline = picture::extremes(points);
    CHECK(outline.size() <= 256);
    for (const auto& [width, height] :
         {std::pair{390, 844}, {640, 480}, {1920, 820}, {100, 100}, {480, 640}}) {
      for (const double elevation : {-30.0, 15.0, 80.0}) {
        for (const auto& [azimuth, field_of_view] :
             {std::pair{30.0, 30.0}, {205.0, 30.0}, {60.0, 0.0}}) {
          CAPTURE(points.size(), width, height, azimuth, elevation, field_of_view);
          Camera camera = standing_camera(azimuth, elevation);
          camera.field_of_view = field_of_view;
          const Camera aimed =
              picture::aimed(std::span(&camera, 1), outline, static_cast<double>(width) / height)
                  .front();
          const Extent extent = extent_of(aimed, points, width, height);
          // The needle stands upright: seen from above it points at the eye, which stays clear.
          if (elevation < 60) CHECK(extent.tighter_share() > 0.75);
          CHECK(extent.tighter_share() < 0.92);
          CHECK(extent.off_middle() < 0.01);
        }
      }
    }
  }
}

TEST_CASE("the cameras of a film have one place to look at and one distance, and see all") {
  std::vector<Camera> turntable, films;
  for (int i = 0; i < 24; ++i) turntable.push_back(standing_camera(15.0 * i, 20));
  for (int i = 0; i < 9; ++i) films.push_back(standing_camera(40, 10.0 * i));
  for (const auto& points : framed_shapes()) {
    for (const auto& cameras : {turntable, films}) {
      const std::vector<Camera> aimed = picture::aimed(cameras, picture::extremes(points), 4.0 / 3);
      double fullest = 0;
      for (const Camera& camera : aimed) {
        CHECK(*camera.look_at == *aimed.front().look_at);
        CHECK(*camera.distance == *aimed.front().distance);
        const Extent extent = extent_of(camera, points, 640, 480);
        CHECK(extent.low.minCoeff() > 0.03);
        CHECK(extent.high.maxCoeff() < 0.97);
        fullest = std::max(fullest, extent.tighter_share());
      }
      CHECK(fullest > 0.7);
    }
  }
  // What a camera has of its own stays, and a narrower view stands farther away.
  Camera placed = standing_camera(10, 20), wide = placed;
  placed.look_at = Vector3d(1, 2, 3);
  wide.field_of_view = 60;
  const auto aimed = picture::aimed(std::vector<Camera>{placed, wide}, framed_shapes().front(), 1);
  CHECK(*aimed[0].look_at == Vector3d(1, 2, 3));
  CHECK(*aimed[0].distance > 1.5 * *aimed[1].distance);
}

TEST_CASE("each part of a palette is seen about as much, whatever values are seen") {
  // Most values lie at the two ends, as those of traps do; few lie in between.
  std::vector<float> values;
  for (int i = 0; i < 4000; ++i) {
    const double u = (i + 0.5) / 4000;
    values.push_back(static_cast<float>(0.5 - 0.5 * std::cos(std::numbers::pi * std::pow(u, 0.7))));
  }
  values.push_back(std::numeric_limits<float>::quiet_NaN());
  const MaterialRange range = range_over(values, Material::trap);
  range.validate();
  std::array<int, 5> seen{};
  for (int i = 0; i < 4000; ++i) {
    const double share = picture::share_of(range, double{values[static_cast<std::size_t>(i)]});
    ++seen.at(static_cast<std::size_t>(std::min(4.0, 5 * share)));
  }
  for (const int count : seen) {
    CHECK(count > 4000 / 5 * 0.7);
    CHECK(count < 4000 / 5 * 1.4);
  }
  // A value that most points share lies in the middle of the parts that it takes.
  std::vector<float> alike(1000, 0.3F);
  for (std::size_t i = 0; i < 250; ++i) alike[i] = 0.3F + 0.002F * static_cast<float>(i);
  CHECK(picture::share_of(range_over(alike, Material::groove), double{0.3F}) ==
        Catch::Approx(0.375).margin(0.08));
  // Lengths and names stay in proportion.
  CHECK(range_over(values, Material::height).between.empty());
  CHECK(range_over(values, Material::factor).between.empty());
  CHECK(range_over({}, Material::trap) == MaterialRange{});
  const MaterialRange even = range_over({0.25F, 0.25F}, Material::groove);
  CHECK(even.low < 0.25);
  CHECK(even.high > 0.25);
  // Between given values the way through the palette is linear.
  const MaterialRange bent{0, 1, {0.1, 0.2, 0.6}};
  CHECK(picture::share_of(bent, 0.05) == Catch::Approx(0.125));
  CHECK(picture::share_of(bent, 0.2) == Catch::Approx(0.5));
  CHECK(picture::share_of(bent, 0.8) == Catch::Approx(0.875));
  CHECK(picture::share_of(bent, -1) == 0);
  CHECK(picture::share_of(bent, 2) == 1);
}

TEST_CASE("a rasterised triangle has the depths of its plane, in both kinds of view") {
  TriangleMesh mesh;
  mesh.vertices = {{-1, -1, 0.2}, {1, -1, -0.3}, {0, 1, 0.4},
                   {-9, -9, -2},  {9, -9, -2},   {0, 9, -2}};
  mesh.triangles = {{3, 4, 5}, {0, 1, 2}};
  const Vector3d a = mesh.vertices[0];
  const Vector3d normal = (mesh.vertices[1] - a).cross(mesh.vertices[2] - a);
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  Camera front;
  front.azimuth = front.elevation = 0;
  for (const picture::View& view :
       {picture::camera_view(front, box, 40, 30, 1),
        picture::parallel_view(Vector3d(0.3, 0.1, 1).normalized(), box, 30)}) {
    const auto depths = picture::mesh_source(mesh)->depths(view, 10, 5);
    REQUIRE(depths.size() == static_cast<std::size_t>(5 * view.columns));
    const int column = view.columns / 2, row = 12;
    const double x = column + 0.5, y = row + 0.5;
    const Vector3d eye = view.eye + x * view.eye_dx + y * view.eye_dy;
    const Vector3d ray = (view.dir + x * view.dir_dx + y * view.dir_dy).normalized();
    const double expected = normal.dot(a - eye) / normal.dot(ray);
    CHECK(depths[static_cast<std::size_t>((row - 10) * view.columns + column)] ==
          Catch::Approx(expected).epsilon(1e-6));
  }
}

TEST_CASE("what of a mesh is framed reaches as far as the box where triangles go on beyond it") {
  TriangleMesh mesh;
  mesh.vertices = {{-9, -9, 0}, {9, -9, 0}, {9, 9, 0}, {-9, 9, 0}, {0.5, 0, 0}, {0.5, 0, 5}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {4, 2, 5}};
  const auto source = picture::mesh_source(mesh, {}, Box{{-1, -2, -1}, {1, 2, 3}});
  Eigen::AlignedBox3d around;
  for (const Vector3d& point : source->outline()) around.extend(point);
  CHECK((around.min() - Vector3d(-1, -2, 0)).norm() < 1e-4);
  CHECK((around.max() - Vector3d(1, 2, 3)).norm() < 1e-4);
}

TEST_CASE("strata of points that lie infinitely deep are those of the core") {
  const double core = picture::stratum_at(std::numeric_limits<double>::infinity());
  CHECK(core >= 0);
  CHECK(core < 0.4);
}

TEST_CASE("depth grids tell smooth pixels from edges") {
  picture::DepthGrid grid{5, 5, {}};
  for (int j = 0; j < 5; ++j) {
    for (int i = 0; i < 5; ++i) grid.depths.push_back(static_cast<float>(3 + i - 0.5 * j));
  }
  CHECK(grid.kind(2, 2, 0.1) == picture::PixelKind::smooth);
  CHECK(grid.kind(0, 2, 0.1) == picture::PixelKind::rough);
  CHECK(grid.interpolated(1.25, 2.5) == Catch::Approx(3 + 1.25 - 1.25));
  CHECK(grid.nearest(1.25, 2.5) == Catch::Approx(3 + 1 - 1.5));
  grid.depths[picture::index(3, 2, 5)] += 0.2F;
  CHECK(grid.kind(2, 2, 0.1) == picture::PixelKind::rough);
  // Where one of the four pixels about a place is empty, those farther off are asked as well.
  grid.depths[picture::index(1, 3, 5)] = -1;
  CHECK(grid.nearest(1.25, 2.5) == Catch::Approx(3 + 0 - 2));
  grid.depths.assign(25, -1.0F);
  CHECK(grid.kind(2, 2, 0.1) == picture::PixelKind::empty);
}

TEST_CASE("a stop request ends the drawing of a mesh") {
  const auto source = picture::mesh_source(shapes::sphere(2));
  std::stop_source stopped;
  source->stop_with(stopped.get_token());
  const picture::View view =
      picture::parallel_view(Vector3d(0, 0, 1), Box{{-1, -1, -1}, {1, 1, 1}}, 10);
  CHECK_NOTHROW(source->depths(view, 0, view.rows));
  stopped.request_stop();
  CHECK_THROWS_AS(source->depths(view, 0, view.rows), Interrupted);
}

// Cameras, lights, colours and images that nobody should give.

#include <filesystem>

#include "hostile.hpp"
#include "qjulia/picture/scene_pose.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using namespace qjulia::test;

namespace {

const Device& picture_device() { return test::shared_device(); }

std::vector<Image> broken_images() {
  return {{},
          {.width = -1, .height = 1, .pixels = {}},
          {.width = 2, .height = 2, .pixels = {1, 2, 3}},
          {.width = 1 << 30, .height = 1 << 30, .pixels = {1, 2, 3}},
          {.width = 1, .height = 1, .pixels = {1, 2, 3}, .alpha = {1, 2}}};
}

const Image kPixel{.width = 1, .height = 1, .pixels = {1, 2, 3}};

}  // namespace

TEST_CASE("hostile numbers of pictures are refused by name") {
  const Map map = good_map();
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Eigen::Vector3d v(x, 0, 0);
    const Box box{{x, x, x}, {1, 1, 1}};
    const auto option = [&](bool is_valid, const char* named, const auto& change) {
      const PictureOptions options = changed(small_picture(), change);
      takes(is_valid, "Studio::of_drafts", named, [&] {
        Studio studio = Studio::of_drafts(picture_device(), map, options);
        check_picture(studio.layered_picture(options.camera).image, options);
      });
    };
    const bool is_unit = is_within(x, 0, 1);
    option(is_near(x) && x < 1, "box", [&](auto& o) { o.box = box; });
    option(is_near(x) && x < 1, "frame", [&](auto& o) { o.camera.frame = box; });
    option(std::isfinite(x), "azimuth", [&](auto& o) { o.camera.azimuth = x; });
    option(is_within(x, -90, 90), "elevation", [&](auto& o) { o.camera.elevation = x; });
    option(is_within(x, 0.01, 1000), "zoom", [&](auto& o) { o.camera.zoom = x; });
    option(x == 0 || is_within(x, 1, 120), "field_of_view",
           [&](auto& o) { o.camera.field_of_view = x; });
    option(is_unit, "aperture", [&](auto& o) { o.camera.aperture = x; });
    option(is_within(x, -90, 90), "lamp", [&](auto& o) { o.light.lamps = {{.elevation = x}}; });
    option(std::isfinite(x), "lamp", [&](auto& o) { o.light.lamps = {{.azimuth = x}}; });
    option(is_within(x, 0, 100), "lamp", [&](auto& o) { o.light.lamps = {{.strength = x}}; });
    option(is_within(x, 0, 90), "lamp", [&](auto& o) { o.light.lamps = {{.size = x}}; });
    option(is_within(x, 0, 10), "fill", [&](auto& o) { o.light.fill = x; });
    option(is_within(x, -20, 20), "exposure", [&](auto& o) { o.exposure = x; });
    option(is_unit, "background", [&](auto& o) { o.background.color = Rgb::Constant(x); });
    option(is_unit, "palette", [&](auto& o) { o.palette.clay = Rgb::Constant(x); });
    option(is_unit, "roughness", [&](auto& o) { o.matter.roughness = x; });
    option(std::isfinite(x) && x > -kHuge, "cut", [&](auto& o) { o.cuts = {{'z', x, false}}; });
    option(std::isfinite(x) && x > -kHuge, "cut", [&](auto& o) { o.cuts = {{'z', x, true}}; });
    option(false, "cut", [&](auto& o) { o.cuts = {{'?', x, true}}; });
    option(std::isfinite(x) && x < 1, "range", [&](auto& o) {
      o.material = Material::trap;
      o.range = MaterialRange{x, 1};
    });
    option(x > 0 && x < 1, "range", [&](auto& o) {
      o.material = Material::trap;
      o.range = MaterialRange{0, 1, {x}};
    });
    // So far away the set is less than a pixel, or the eye's distance overflows.
    const auto draws = [&](bool is_valid, const char* named, const auto& change) {
      if (is_near(x) || !std::isfinite(x)) return option(is_valid, named, change);
      survives(named, "a set too small to draw is an error, but of no option",
               [&] { render(picture_device(), map, changed(small_picture(), change)); });
    };
    draws(is_near(x), "look_at", [&](auto& o) { o.camera.look_at = v; });
    draws(is_near(x), "focus", [&](auto& o) { o.camera.focus = v; });
    draws(is_positive(x), "distance", [&](auto& o) { o.camera.distance = x; });
  }
}

TEST_CASE("a studio refuses hostile cameras, ranges, exposures and sizes by name, and goes on") {
  const Map map = good_map();
  const PictureOptions options =
      changed(small_picture(), [](auto& o) { o.material = Material::trap; });
  Studio studio(picture_device(), map, options);
  CHECK(to_text(studio.lookups()) == to_text(LookupReport{}));  // as small pictures have none
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Camera turned = changed(Camera{}, [&](auto& c) { c.azimuth = x; });
    const Camera zoomed = changed(Camera{}, [&](auto& c) { c.zoom = x; });
    takes(std::isfinite(x), "aimed", "azimuth",
          [&] { return studio.aimed(std::span(&turned, 1)).size() == 1; });
    takes(is_within(x, 0.01, 1000), "aimed", "zoom", [&] { studio.aimed(std::span(&zoomed, 1)); });
    const Camera placed = changed(turned, [](auto& c) {
      c.look_at = Eigen::Vector3d::Zero();
      c.distance = 6;
    });
    takes(std::isfinite(x), "pose_of", "azimuth",
          [&] { return pose_of(placed, 8, 8).axes.allFinite(); });
    takes(std::isfinite(x), "lamp_poses", "lamp_turn",
          [&] { return lamp_poses({.lamp_turn = x}, placed).front().towards.allFinite(); });
    takes(std::isfinite(x), "picture", "azimuth",
          [&] { check_picture(studio.picture({}, std::span(&placed, 1)), options); });
    takes(std::isfinite(x), "shown", "azimuth", [&] {
      for (const float value : studio.shown(std::span(&turned, 1))) CHECK(is_within(value, 0, 1));
    });
    takes(std::isfinite(x) && x < 1, "set_range", "range", [&] {
      studio.set_range(MaterialRange{x, 1});
    });
    takes(is_within(x, -20, 20), "set_exposure", "exposure", [&] { studio.set_exposure(x); });
    takes(is_within(x, -1e9, 1e9), "set_ground", "ground", [&] { studio.set_ground(x); });
    takes(std::isfinite(x), "set_light", "lamp_turn",
          [&] { studio.set_light(changed(options, [&](auto& o) { o.light.lamp_turn = x; })); });
    accepts("range_over", [&] {
      range_over({static_cast<float>(x), 0.5F}, Material::trap).validate();
    });
    takes(is_within(x, 1700, 25'000), "LightColor", "sun", [&] {
      const LightColor color{.kelvin = x};
      color.validate("sun");
    });
    takes(is_within(x, 0, 1), "LightColor", "sun", [&] {
      const LightColor color{.kelvin = std::nullopt, .rgb = Rgb::Constant(x)};
      color.validate("sun");
    });
    accepts("tone_mapped", [&] {
      for (const auto tone : {ToneCurve::neutral, ToneCurve::agx, ToneCurve::aces}) {
        CHECK_FALSE(tone_mapped(tone, Rgb(x, 1, -x)).maxCoeff() > 1);
      }
    });
    accepts("color_name", [&] { return !color_name(Rgb::Constant(x)).empty(); });
    const std::vector<Image> frames{kPixel, kPixel};
    takes(is_within(x, 0.001, 65), "animated_png_bytes", "seconds",
          [&] { return !animated_png_bytes(frames, x).empty(); });
    takes(std::isfinite(x) && x < 1, "render_mesh", "the box to frame has no size", [&] {
      const Box box{{x, x, x}, {1, 1, 1}};
      check_picture(render_mesh(picture_device(), shapes::sphere(1), box, small_picture()),
                    small_picture());
    });
  }
  const Camera without_place;
  refuses("picture", "distance", [&] { studio.picture({}, std::span(&without_place, 1)); });
  for (const int n : kHostileCounts) {
    CAPTURE(n);
    const bool is_size = is_within(n, 1, 16'384);
    for (const auto& [width, height] : {std::pair(n, 8), std::pair(8, n)}) {
      if (is_size) continue;  // large pictures take time and nothing else
      refuses("resize", "size", [&] {
        studio.resize(width, height);
        studio.picture({});
      });
    }
    takes(is_size, "PictureOptions", "size",
          [&] { changed(PictureOptions{}, [&](auto& o) { o.width = n; }).validate(); });
    takes(is_size, "PictureOptions", "size",
          [&] { changed(PictureOptions{}, [&](auto& o) { o.height = n; }).validate(); });
    takes(is_within(n, 1, 8), "PictureOptions", "samples",
          [&] { changed(PictureOptions{}, [&](auto& o) { o.samples = n; }).validate(); });
    takes(n > 0, "contact_sheet", "a contact sheet needs", [&] {
      return contact_sheet({&kPixel, 1}, n).width == 1;
    });
    takes(n >= 0, "contact_sheet", "a contact sheet needs", [&] {
      return contact_sheet({&kPixel, 1}, 1, std::min(n, 99)).width == 1;
    });
    takes(n > 0, "reduced", "the reduction of a picture", [&] { reduced(kPixel, n).validate(); });
    const TemporaryFolder folder;
    refuses("write_layers", "the layers do not fit", [&] {
      write_layers({{1.0F}, {1.0F}, {}}, n, folder.path() / "layers");
    });
    refuses("exr_bytes", [&] { exr_bytes({.image = {n, n, {}}, .layers = {}}); });
    refuses("write_exr", [&] {
      write_exr({.image = {n, 1, {}}, .layers = {}}, folder.path() / "a.exr");
    });
    CHECK(folder.names().empty());
  }
  const std::vector<Eigen::Vector3d> nowhere{kNowhere};
  studio.resize(options.width, options.height);
  refuses("aimed", "point", [&] { studio.aimed({}, nowhere); });
  check_picture(studio.picture({}), options);
}

TEST_CASE("images whose parts do not belong together are refused") {
  const TemporaryFolder folder;
  for (const Image& image : broken_images()) {
    refuses("validate", [&] { image.validate(); });
    refuses("png_bytes", [&] { png_bytes(image); });
    refuses("animated_png_bytes", [&] { animated_png_bytes({&image, 1}, 1); });
    refuses("write_png", [&] { write_png(image, folder.path() / "picture.png"); });
    refuses("contact_sheet", [&] { contact_sheet({&image, 1}, 1); });
    refuses("reduced", [&] { reduced(image, 2); });
    refuses("captioned", [&] { captioned(image, "text"); });
  }
  refuses("contact_sheet", "a contact sheet needs", [&] { contact_sheet({}, 1); });
  refuses("animated_png_bytes", [&] { animated_png_bytes({}, 1); });
  refuses("write_layers", [&] { write_layers({}, 0, folder.path() / "layers"); });
  accepts("layer_files", [&] { return layer_files({}).size() == 5; });
  accepts("captioned", [&] { captioned(kPixel, std::string(10'000, 'x')).validate(); });
  survives("captioned", "cairo decides which bytes are text",
           [&] { captioned(kPixel, std::string(10'000, '\xff')); });
  accepts("png_bytes", [&] {
    return png_bytes(kPixel, {{"", std::string("\0\xff", 2)}, {std::string(99, 'k'), ""}}).size() >
           60;
  });
  CHECK(folder.names().empty());
}

TEST_CASE("a number that is no material is refused") {
  for (const MaterialFacts& facts : materials()) {
    accepts("facts_of", [&] { return &facts_of(facts.material) == &facts; });
    accepts("to_string", [&] { return std::string(to_string(facts.material)) == facts.word; });
  }
  for (const std::size_t number : {materials().size(), std::size_t{1000}}) {
    refuses("facts_of", "material", [&] { facts_of(static_cast<Material>(number)); });
    refuses("to_string", "material", [&] { to_string(static_cast<Material>(number)); });
  }
}

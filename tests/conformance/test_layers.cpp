// What an OpenEXR file holds of a picture.

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputFile.h>

#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <map>

#include "ball_view.hpp"
#include "base/srgb.hpp"
#include "png_file.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;

namespace {

/// Channels of a file by name, as OpenEXR reads them.
std::map<std::string, std::vector<float>> channels_of(const std::string& path) {
  Imf::InputFile file(path.c_str());
  const Imath::Box2i window = file.header().dataWindow();
  const auto wide = static_cast<std::size_t>(window.max.x + 1);
  std::map<std::string, std::vector<float>> channels;
  Imf::FrameBuffer frame;
  const Imf::ChannelList& list = file.header().channels();
  for (auto i = list.begin(); i != list.end(); ++i) {
    std::vector<float>& values = channels[i.name()];
    values.resize(wide * static_cast<std::size_t>(window.max.y + 1));
    frame.insert(i.name(), Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()),
                                      sizeof(float), sizeof(float) * wide));
  }
  file.setFrameBuffer(frame);
  file.readPixels(window.min.y, window.max.y);
  return channels;
}

/// With two lamps, a material that glows, a cut and an environment.
PictureOptions rich_options() {
  PictureOptions options = test::picture_of(60, 45);
  options.material = Material::height;
  options.palette =
      palette_from(std::vector<std::string>{"402010", "a0c0ff", "ffe0a0"}, options.material);
  options.matter = {.roughness = 0.4, .coat = 0.5, .glow = 1, .glow_from = 0.6};
  options.light.environment = "evening";
  options.light.lamps = {lamp_from("-50,40,1.5,4000K"), lamp_from("120,20,0.8")};
  options.light.bounce = 1;
  options.cuts = cuts_from("z=60%");
  options.exposure = 0.5;
  return options;
}

}  // namespace

TEST_CASE("layers of light add up to the picture, in memory and in a file") {
  PictureOptions options = rich_options();
  options.background = background_from(GENERATE("environment", "studio", "transparent", "406080"));
  options.matter.fog = 0.3;
  options.camera.aperture = GENERATE(0.0, 0.1);
  if (options.camera.aperture > 0) options.samples = 1;
  const LayeredImage picture = layered_render(test::shared_device(), check::unit_ball(), options);
  const PictureLayers& layers = picture.layers;
  REQUIRE(layers.light.size() == 7);  // the environment's sun is a lamp
  const std::size_t count = std::size_t{60} * 45;
  REQUIRE(layers.beauty.size() == 4 * count);
  const test::TemporaryFolder folder;
  const std::string path = folder / "a.exr";
  write_exr(picture, path, {{"qjulia", "{}"}});
  const auto channels = channels_of(path);
  const std::array<const char*, 3> names{"R", "G", "B"};
  constexpr float kHalf = 1.0F / 1024;  // each of eight is off by half a step at most
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      float sum = 0, sum_of_file = 0;
      for (const LightLayer& light : layers.light) {
        sum += light.color[3 * i + c];
        sum_of_file += channels.at(light.name + "." + names[c])[i];
      }
      const float beauty = layers.beauty[4 * i + c];
      REQUIRE(std::abs(sum - beauty) <= 1e-5F * (1 + beauty));
      REQUIRE(std::abs(sum_of_file - channels.at(names[c])[i]) <= kHalf * beauty + 1e-6F);
    }
    REQUIRE(channels.at("Z")[i] == layers.depth[i]);
    REQUIRE(std::abs(channels.at("N.Y")[i] - layers.normal[3 * i + 1]) < kHalf);
    REQUIRE(channels.at("value.Y")[i] == layers.value[i]);
  }
  // Every layer has something to say.
  for (const LightLayer& light : layers.light) {
    CAPTURE(light.name);
    const bool is_nothing =
        light.name == "background" && options.background.kind == Backdrop::transparent;
    CHECK((std::ranges::max(light.color) > 1e-4F) != is_nothing);
  }
}

TEST_CASE("the picture is its linear layer, developed") {
  PictureOptions options = rich_options();
  options.samples = 1;
  options.tone = GENERATE(ToneCurve::neutral, ToneCurve::agx);
  options.background = background_from(GENERATE("environment", "transparent"));
  const LayeredImage picture = layered_render(test::shared_device(), check::unit_ball(), options);
  const bool is_transparent = !picture.image.alpha.empty();
  for (std::size_t i = 0; i < picture.layers.depth.size(); ++i) {
    const float* const beauty = picture.layers.beauty.data() + 4 * i;
    if (is_transparent) {
      CHECK(std::abs(255 * beauty[3] - picture.image.alpha[i]) < 1.05F);
      if (beauty[3] < 1) continue;
    }
    const Rgb color = tone_mapped(options.tone, Rgb(beauty[0], beauty[1], beauty[2]));
    for (std::size_t c = 0; c < 3; ++c) {
      const double byte = 255 * base::srgb_encoded(color[static_cast<Eigen::Index>(c)]);
      CHECK(std::abs(picture.image.pixels[3 * i + c] - byte) < 1.1);
    }
  }
}

TEST_CASE("masks say what pixels show, and values what colours the set") {
  PictureOptions options = rich_options();
  const PictureLayers layers =
      layered_render(test::shared_device(), check::unit_ball(), options).layers;
  double set = 0, ground = 0, faces = 0;
  for (std::size_t i = 0; i < layers.depth.size(); ++i) {
    const float* const mask = layers.mask.data() + 3 * i;
    set += double{mask[0]};
    ground += double{mask[1]};
    faces += double{mask[2]};
    CHECK(mask[0] + mask[1] <= 1 + 1e-5F);
    CHECK(mask[2] <= mask[0]);
    const bool is_seen = std::isfinite(layers.depth[i]);
    if (is_seen) CHECK(mask[0] > 0);
    CHECK((layers.value[i] >= 0) == is_seen);
    // A value is a height, upward.
    if (is_seen && mask[2] == 0) CHECK(layers.value[i] <= 1);
  }
  CHECK(set > 300);
  CHECK(faces > 100);
  CHECK(ground > 300);
  options.cuts.clear();
  options.ground = false;
  options.material = Material::clay;
  options.palette.clay = {0.25, 0.5, 0.75};
  const PictureLayers plain =
      layered_render(test::shared_device(), check::unit_ball(), options).layers;
  CHECK(plain.value.empty());
  for (std::size_t i = 0; i < plain.depth.size(); ++i) {
    CHECK(plain.mask[3 * i + 1] == 0);
    CHECK(plain.mask[3 * i + 2] == 0);
    CHECK(std::abs(plain.albedo[3 * i + 2] - 0.75F * plain.mask[3 * i]) < 1e-5F);
  }
}

TEST_CASE("pictures of 16 bits are those of 8, and finer") {
  PictureOptions options = rich_options();
  options.background = background_from(GENERATE("studio", "transparent"));
  const Image bytes = render(test::shared_device(), check::unit_ball(), options);
  options.bits = 16;
  const Image deep = render(test::shared_device(), check::unit_ball(), options);
  REQUIRE(bytes.deep.empty());
  const std::size_t channels = deep.alpha.empty() ? 3 : 4;
  REQUIRE(deep.deep.size() == channels * std::size_t{60} * 45);
  std::size_t between = 0;
  for (std::size_t i = 0; i < deep.deep.size(); ++i) {
    const std::size_t pixel = i / channels, part = i % channels;
    const int byte = part == 3 ? bytes.alpha[pixel] : bytes.pixels[3 * pixel + part];
    REQUIRE(std::abs(deep.deep[i] / 257.0 - byte) < 1.01);  // rounding is dithered
    if (deep.deep[i] % 257 != 0) ++between;
  }
  CHECK(between > deep.deep.size() / 4);
  // IHDR: 16 bits, colour with or without alpha; and libpng reads it.
  const std::string png = png_bytes(deep, {{"Title", "deep"}});
  CHECK(png[24] == 16);
  CHECK(png[25] == (channels == 3 ? 2 : 6));
  const test::TemporaryFolder folder;
  write_png(deep, folder / "deep.png");
  if (channels == 3) CHECK(test::mean_difference(test::read_png(folder / "deep.png"), deep) < 1);
  options.bits = 12;
  CHECK_THROWS_WITH(render(test::shared_device(), check::unit_ball(), options),
                    Catch::Matchers::ContainsSubstring("bits: 12; give 8 or 16"));
}

TEST_CASE("pictures without layers are not written as OpenEXR") {
  CHECK_THROWS_WITH(exr_bytes({}), Catch::Matchers::ContainsSubstring("no pixels"));
  CHECK_THROWS_WITH(exr_bytes({.image = {2, 2, std::vector<std::uint8_t>(12)}, .layers = {}}),
                    Catch::Matchers::ContainsSubstring("the layer 'R' has 0 numbers for 4 pixels"));
}

// Every built-in look against its stored picture, in every layout of kernels.
//
// Where a change of a picture is meant, QJULIA_TEST_WRITE_PICTURES=1 stores the new ones.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "armed_ball.hpp"
#include "ball_view.hpp"
#include "png_file.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/picture/look.hpp"
#include "shapes.hpp"

using namespace qjulia;

namespace {

/// The share of pixels of which a channel differs by more than `step`.
double share_beyond(const Image& a, const Image& b, int step) {
  std::size_t beyond = 0;
  for (std::size_t i = 0; i < a.pixels.size(); i += 3) {
    bool is_off = false;
    for (std::size_t c = i; c < i + 3; ++c) {
      is_off = is_off || std::abs(a.pixels[c] - b.pixels[c]) > step;
    }
    if (is_off) ++beyond;
  }
  return 3 * static_cast<double>(beyond) / static_cast<double>(a.pixels.size());
}

}  // namespace

TEST_CASE("every look gives its stored picture") {
  const test::Variant variant = GENERATE(from_range(test::variants()));
  const Device device = variant.of(test::shared_device());
  const Map map = calibrated(device, steepened(test::armed_ball_map(60), 12));
  for (const std::string& look : look_names()) {
    PictureOptions options = test::picture_of(160, 120);
    apply_built_in_look(options, look);
    options.camera.azimuth = 20;
    const Image image = render(device, map, options);
    const auto path =
        std::filesystem::path(QJULIA_TEST_DATA) / "pictures" / ("look_" + look + ".png");
    if (std::getenv("QJULIA_TEST_WRITE_PICTURES") != nullptr) write_png(image, path);
    CAPTURE(variant, look);
    const Image stored = test::read_png(path);
    CHECK(test::mean_difference(image, stored) <= 0.5);
    CHECK(share_beyond(image, stored, 6) <= 0.01);
  }
}

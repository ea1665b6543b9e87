// Light on surfaces, and the pixels that become of it: kernels against physics and the host.

#include <array>
#include <catch2/catch_all.hpp>
#include <cmath>

#include "base/srgb.hpp"
#include "check/shading_probe.hpp"
#include "test_device.hpp"

using namespace qjulia;
using check::ShadingProbe;
using Eigen::Vector3d;

namespace {

/// From facing the viewer to nearly edge on.
std::vector<Vector3d> turning_normals() {
  std::vector<Vector3d> normals;
  for (const double cosine : {1.0, 0.9, 0.7, 0.5, 0.3, 0.15}) {
    normals.emplace_back(std::sqrt(1 - cosine * cosine), 0, cosine);
  }
  return normals;
}

ShadingProbe white(const Matter& matter) {
  ShadingProbe probe;
  probe.scene.options.palette.clay = Rgb::Ones();
  probe.scene.options.matter = matter;
  return probe;
}

}  // namespace

TEST_CASE("white in even light is white: matter neither loses light nor makes it") {
  const double roughness = GENERATE(0.0, 0.2, 0.5, 0.8, 1.0), metal = GENERATE(0.0, 0.5, 1.0);
  const double coat = GENERATE(0.0, 1.0);
  CAPTURE(roughness, metal, coat);
  ShadingProbe probe = white({.roughness = roughness, .metal = metal, .coat = coat});
  probe.even_light = 1;
  for (const Rgb& sent : probe.radiance(test::shared_device(), turning_normals())) {
    CHECK((sent - Rgb::Ones()).cwiseAbs().maxCoeff() < 0.02);
  }
}

TEST_CASE("white that lamps light from everywhere is white") {
  const double roughness = GENERATE(0.35, 0.6, 1.0), metal = GENERATE(0.0, 1.0);
  CAPTURE(roughness, metal);
  ShadingProbe probe = white({.roughness = roughness, .metal = metal});
  probe.lamps = check::even_lamps(20000);
  for (const Rgb& sent : probe.radiance(test::shared_device(), turning_normals())) {
    CHECK((sent - Rgb::Ones()).cwiseAbs().maxCoeff() < 0.04);
  }
}

TEST_CASE("a coloured metal reflects its colour, and grey clay under a coat keeps a white shine") {
  ShadingProbe probe = white({.roughness = 0.3, .metal = 1});
  probe.scene.options.palette.clay = {1, 0.5, 0.1};
  probe.even_light = 1;
  const std::vector<Vector3d> facing(1, Vector3d::UnitZ());
  const Rgb gold = probe.radiance(test::shared_device(), facing)[0];
  CHECK((gold - Rgb(1, 0.5, 0.1)).cwiseAbs().maxCoeff() < 0.03);
  ShadingProbe black = white({.roughness = 1, .coat = 1});
  black.scene.options.palette.clay = Rgb::Zero();
  black.even_light = 1;
  const double shine = black.radiance(test::shared_device(), facing)[0].maxCoeff();
  CHECK(shine > 0.045);  // 4 % of the coat, and a little of the rough surface under it
  CHECK(shine < 0.08);
}

TEST_CASE("a lamp's light is as strong as its colour, and falls with the cosine") {
  ShadingProbe probe = white({.roughness = 1});
  probe.lamps = check::even_lamps(1);
  probe.lamps[0].towards = Vector3d::UnitZ();
  probe.lamps[0].color = {0.5, 0.25, 0.125};
  const auto sent = probe.radiance(test::shared_device(), turning_normals());
  CHECK(sent[0].x() == Catch::Approx(0.5).epsilon(0.06));
  CHECK(sent[0].y() == Catch::Approx(0.5 * sent[0].x()).epsilon(1e-4));
  CHECK(sent[3].x() == Catch::Approx(0.5 * sent[0].x()).epsilon(0.1));
}

TEST_CASE("kernels develop radiance by the host's tone curves, to the nearest step of a byte") {
  const auto tone = GENERATE(ToneCurve::neutral, ToneCurve::agx, ToneCurve::aces, ToneCurve::none);
  CAPTURE(static_cast<int>(tone));
  std::vector<Rgb> radiances;
  for (int i = 0; i <= 60; ++i) {
    const double x = std::exp2(0.25 * (i - 40));
    radiances.emplace_back(x, x, x);
    radiances.emplace_back(x, 0.4 * x, 0.02 * x);
    radiances.emplace_back(0.1 * x, 0.3, x);
  }
  const auto bytes = check::developed(test::shared_device(), tone, radiances);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const Rgb color = tone_mapped(tone, radiances[i / 3]);
    const double right = 255 * base::srgb_encoded(color[static_cast<Eigen::Index>(i % 3)]);
    CAPTURE(radiances[i / 3].transpose(), i % 3);
    CHECK(std::abs(bytes[i] - right) < 1.05);  // rounding is dithered
  }
}

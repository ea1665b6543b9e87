// Environments: their files, and the lights that they are cut into.

#include <ImfRgbaFile.h>

#include <catch2/catch_all.hpp>
#include <cmath>
#include <fstream>
#include <numbers>

#include "environment_file.hpp"
#include "layout/picture_layout.h"
#include "picture/environment.hpp"
#include "picture/lights.hpp"
#include "qjulia/base/error.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;
using Eigen::Vector3d;

namespace {

picture::Environment of_function(int width, const std::function<double(const Vector3d&)>& light) {
  picture::Environment made{width, width / 2, {}};
  for (int row = 0; row < made.height; ++row) {
    for (int column = 0; column < made.width; ++column) {
      const auto value = static_cast<float>(light(made.towards(column, row)));
      made.radiance.emplace_back(value, 0.5F * value, 2 * value);
    }
  }
  return made;
}

/// The integral over all directions, by π.
Vector3d all_light(const picture::Environment& map) {
  Vector3d sum = Vector3d::Zero();
  for (int row = 0; row < map.height; ++row) {
    for (int column = 0; column < map.width; ++column) {
      sum += map.steradians(row) / std::numbers::pi * map.at(column, row).cast<double>();
    }
  }
  return sum;
}

/// The irradiance of a surface, by π.
Vector3d irradiance(const std::vector<picture::Cone>& cones, const Vector3d& normal) {
  Vector3d sum = Vector3d::Zero();
  for (const picture::Cone& cone : cones) {
    sum += std::max(0.0, cone.towards.dot(normal)) * cone.color;
  }
  return sum;
}

std::string with_size(const std::string& size) {
  return "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n" + size + "\n";
}

}  // namespace

TEST_CASE("the parts of an environment send all of its light") {
  const auto map =
      of_function(64, [](const Vector3d& d) { return 1 + 0.8 * d.x() + d.y() * d.y(); });
  for (const int count : {1, 16, 64}) {
    const auto cones = picture::cones_of(map, count);
    REQUIRE(cones.size() == static_cast<std::size_t>(count));
    Vector3d sum = Vector3d::Zero();
    double steradians = 0;
    for (const picture::Cone& cone : cones) {
      sum += cone.color;
      steradians += cone.steradians;
      CHECK(cone.towards.norm() == Catch::Approx(1));
    }
    CHECK(sum.isApprox(all_light(map), 1e-5));
    CHECK(steradians == Catch::Approx(4 * std::numbers::pi));
  }
  // Of 1 + a x the irradiance by π is 1 + 2/3 a x.
  const auto slanted = of_function(64, [](const Vector3d& d) { return 1 + 0.8 * d.x(); });
  const auto cones = picture::cones_of(slanted, 64);
  for (const Vector3d& n : {Vector3d(1, 0, 0), Vector3d(-1, 0, 0), Vector3d(0, 1, 0),
                            Vector3d(0.6, 0, 0.8), Vector3d(0, 0, -1)}) {
    CHECK(irradiance(cones, n).x() == Catch::Approx(1 + 0.8 * 2 / 3 * n.x()).epsilon(0.04));
  }
}

TEST_CASE("parts are smallest where an environment is brightest, and none lie where it is black") {
  const Vector3d bright = Vector3d(1, 2, 3).normalized();
  const auto map = of_function(128, [&](const Vector3d& d) {
    return d.dot(bright) > 0.8 ? 10 : d.y() < 0 ? 0.0 : 0.1;
  });
  int near = 0;
  for (const picture::Cone& cone : picture::cones_of(map, 64)) {
    CHECK(cone.towards.y() > -0.1);  // a part may reach beyond the edge
    if (cone.towards.dot(bright) > 0.8) ++near;
  }
  CHECK(near > 32);
  CHECK(near < 64);
}

TEST_CASE("a small bright spot becomes a sun, and the sky is whole without it") {
  const Vector3d place = Vector3d(-2, 1, 1).normalized();
  const auto light = picture::light_of(of_function(
      256, [&](const Vector3d& d) { return d.dot(place) > std::cos(0.03) ? 2000 : 0.5; }));
  REQUIRE(light.sun);
  CHECK(light.sun->towards.dot(place) > std::cos(0.01));
  CHECK(light.sun->steradians == Catch::Approx(std::numbers::pi * 0.03 * 0.03).epsilon(0.3));
  const auto greatest = std::ranges::max(light.sky.radiance, {}, [](auto& c) { return c.x(); });
  CHECK(greatest.x() == Catch::Approx(0.5));
  CHECK((all_light(light.sky) + light.sun->color).isApprox(all_light(light.whole), 1e-4));
  // A spot that sends little is none, and neither is a large one.
  CHECK_FALSE(picture::light_of(of_function(256, [&](const Vector3d& d) {
                return d.dot(place) > std::cos(0.03) ? 30 : 0.5;
              })).sun);
  CHECK_FALSE(picture::light_of(of_function(256, [&](const Vector3d& d) {
                return d.dot(place) > std::cos(0.3) ? 2000 : 0.5;
              })).sun);
  CHECK(picture::light_of(picture::read_environment("evening", {})).sun);
  CHECK_FALSE(picture::light_of(picture::read_environment("overcast", {})).sun);
}

TEST_CASE("maps for kernels are as even as an even environment, and brightest where it is") {
  const auto even = picture::light_of(of_function(32, [](const Vector3d&) { return 0.7; }));
  const picture::EnvironmentMaps maps = picture::environment_maps(even, Vector3d(1, 2, 1));
  CHECK(maps.width == 32);
  CHECK(maps.height == 16);
  const std::size_t blurred =
      (QJ_ENVIRONMENT_LEVELS + 1) *
      static_cast<std::size_t>(QJ_ENVIRONMENT_WIDTH * QJ_ENVIRONMENT_HEIGHT);
  REQUIRE(maps.texels.size() == 3 * (2 * 32 * 16 + blurred));
  for (std::size_t i = 0; i < maps.texels.size(); i += 3) {
    REQUIRE(maps.texels[i] == Catch::Approx(0.7).epsilon(1e-4));
    REQUIRE(maps.texels[i + 2] == Catch::Approx(1.4).epsilon(1e-4));
  }
  // Of 1 + a y the irradiance by π is 1 + 2/3 a y; narrow reflections stay nearer to 1 + a y.
  const auto slanted =
      picture::light_of(of_function(128, [](const Vector3d& d) { return 1 + 0.5 * d.y(); }));
  const auto texels = picture::environment_maps(slanted, Vector3d::Ones()).texels;
  const auto top = [&](int map) {  // at the middle of its first row
    const auto sharp = std::size_t{2} * 128 * 64;
    const auto first = static_cast<std::size_t>(map * QJ_ENVIRONMENT_WIDTH * QJ_ENVIRONMENT_HEIGHT);
    return double{texels[3 * (sharp + first)]};
  };
  CHECK(top(QJ_ENVIRONMENT_LEVELS) == Catch::Approx(1 + 0.5 * 2 / 3).epsilon(0.01));
  CHECK(top(0) == Catch::Approx(1.5).epsilon(0.01));
  for (int level = 1; level < QJ_ENVIRONMENT_LEVELS; ++level) CHECK(top(level) < top(level - 1));
  CHECK(top(QJ_ENVIRONMENT_LEVELS - 1) > 1.2);
}

TEST_CASE("an environment that is turned turns its lights and its sun") {
  const Box held{Vector3d::Constant(-1), Vector3d::Constant(1)};
  picture::Surrounded around{picture::light_of(picture::read_environment("evening", {})), 0};
  Rig rig;
  const auto lights = picture::sky_lights(rig, &around, UpAxis::z, held, 1, 64);
  const auto lamps = picture::lamp_lights(rig, &around, 0, UpAxis::z, held, 1);
  REQUIRE(lights.size() == 64);
  REQUIRE(lamps.size() == 1);
  around.turn = 90;
  const auto turned = picture::sky_lights(rig, &around, UpAxis::z, held, 1, 64);
  const auto turned_lamps = picture::lamp_lights(rig, &around, 0, UpAxis::z, held, 1);
  // As a camera's azimuth turns: what lay towards the eye of azimuth 0 lies towards that of 90.
  const picture::CameraAxes from =
      picture::camera_axes({.azimuth = 0, .elevation = 0, .up = UpAxis::z});
  const picture::CameraAxes to =
      picture::camera_axes({.azimuth = 90, .elevation = 0, .up = UpAxis::z});
  const auto expect_turned = [&](const picture::Light& light, const picture::Light& other) {
    const Vector3d v = light.towards;
    const Vector3d right =
        v.dot(from.right) * to.right + v.dot(from.up) * to.up + v.dot(from.back) * to.back;
    CHECK((other.towards - right).norm() < 1e-12);
    CHECK(other.color == light.color);
  };
  for (std::size_t i = 0; i < lights.size(); ++i) expect_turned(lights[i], turned[i]);
  expect_turned(lamps[0], turned_lamps[0]);
  // Lamps turn, the sun does not.
  rig = rig_named(RigName::studio);
  const auto with_lamps = picture::lamp_lights(rig, &around, 0, UpAxis::z, held, 1);
  const auto with_turned = picture::lamp_lights(rig, &around, 30, UpAxis::z, held, 1);
  REQUIRE(with_lamps.size() == rig.lamps.size() + 1);
  CHECK(with_turned.back().towards == turned_lamps[0].towards);  // it is weaker
  const Vector3d lamp = with_lamps[0].towards, moved = with_turned[0].towards;
  CHECK(moved.z() == Catch::Approx(lamp.z()));
  const double angle = std::atan2(lamp.cross(moved).z(), lamp.head(2).dot(moved.head(2)));
  CHECK(angle * 180 / std::numbers::pi == Catch::Approx(30));
}

TEST_CASE("Radiance files are read, packed or not") {
  const auto light = [](int column, int row) -> Vector3d {
    return Vector3d(1 + column, 0.25 * row, 100.0 * (column % 3));
  };
  const auto flat = picture::environment_from_hdr(test::hdr_bytes(16, light));
  REQUIRE(flat.width == 16);
  REQUIRE(flat.height == 8);
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 16; ++column) {
      const Vector3d right = light(column, row);
      CHECK((flat.at(column, row).cast<double>() - right).cwiseAbs().maxCoeff() <=
            right.maxCoeff() / 128);
    }
  }
  // Runs of the newer kind: 16 times one value, and literals; of the older: 1, 1, 1, n.
  std::string newer = with_size("-Y 8 +X 16"), older = newer;
  for (int row = 0; row < 8; ++row) {
    newer += std::string("\x02\x02\x00\x10", 4) + std::string("\x90\x80", 2) +
             std::string("\x90\x40", 2) + std::string("\x02\x10\x11\x8e\x12", 5) +
             std::string("\x90\x81", 2);
    older += std::string("\x80\x40\x10\x81", 4) + std::string("\x01\x01\x01\x0f", 4);
  }
  const auto packed = picture::environment_from_hdr(newer);
  const auto repeated = picture::environment_from_hdr(older);
  CHECK(packed.at(0, 0) == repeated.at(0, 7));
  CHECK(packed.at(5, 3).x() == Catch::Approx(1).epsilon(0.01));
  CHECK(packed.at(15, 7).z() == Catch::Approx(18.0 / 128).epsilon(0.05));
}

TEST_CASE("what is wrong with a Radiance file is said") {
  const auto refuses = [](const std::string& bytes, const char* message) {
    CAPTURE(message);
    CHECK_THROWS_WITH(picture::environment_from_hdr(bytes), ContainsSubstring(message));
  };
  const std::string good = test::even_hdr_bytes(1);
  refuses("", "no Radiance picture");
  refuses("\x89PNG", "no Radiance picture");
  refuses("#?RADIANCE\n\n-Y 8 +X 16\n", "not in the format");
  refuses("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n\n-Y 8 +X 16\n", "not in the format");
  refuses("#?RADIANCE\nFORMAT=32-bit_rle_rgbe", "ends in the middle");
  refuses(with_size("+Y 8 +X 16"), "rows do not go from the top");
  refuses(with_size("-Y 8"), "rows do not go from the top");
  refuses(with_size("-Y 8 +X 8"), "twice as wide as high");
  refuses(with_size("-Y 100000 +X 200000"), "twice as wide as high");
  refuses(with_size("-Y 8 +X 16"), "ends in the middle");
  refuses(good.substr(0, good.size() - 1), "ends in the middle");
  refuses(with_size("-Y 8 +X 16") + std::string("\x02\x02\x00\x10\xff\x01", 6),
          "longer than a row");
  refuses(with_size("-Y 8 +X 16") + std::string("\x02\x02\x00\x10\x00", 5), "longer than a row");
  refuses(with_size("-Y 8 +X 16") + std::string("\x01\x01\x01\x02", 4), "longer than a row");
  refuses(with_size("-Y 8 +X 16") + std::string("\x05\x05\x05\x80\x01\x01\x01\xff", 8),
          "longer than a row");
  refuses(with_size("-Y 8 +X 16") + std::string(std::size_t{8} * 16 * 4, '\0'),
          "all of it is black");
}

TEST_CASE("OpenEXR files are read wherever their window lies, and bad ones are named") {
  const test::TemporaryFolder folder;
  const auto write = [&](const char* name, const Imath::Box2i& window, float radiance) {
    const auto wide = static_cast<std::size_t>(window.max.x - window.min.x + 1);
    const auto high = static_cast<std::size_t>(window.max.y - window.min.y + 1);
    std::vector<Imf::Rgba> pixels(wide * high, Imf::Rgba(radiance, 2, 3));
    pixels[1] = Imf::Rgba(9, 9, 9);
    const std::string path = folder / name;
    Imf::RgbaOutputFile file(path.c_str(), window, window, Imf::WRITE_RGB);
    file.setFrameBuffer(pixels.data() - window.min.x - window.min.y * static_cast<int>(wide), 1,
                        wide);
    file.writePixels(static_cast<int>(high));
    return path;
  };
  const auto read = [](const std::string& path) { return picture::read_environment(path, {}); };
  const auto made = read(write("a.exr", {{3, -5}, {18, 2}}, 0.5F));
  CHECK(made.width == 16);
  CHECK(made.height == 8);
  CHECK(made.at(0, 0) == Eigen::Vector3f(0.5F, 2, 3));
  CHECK(made.at(1, 0) == Eigen::Vector3f(9, 9, 9));
  CHECK(made.at(15, 7) == Eigen::Vector3f(0.5F, 2, 3));
  CHECK_THROWS_WITH(read(write("b.exr", {{0, 0}, {15, 8}}, 1)),
                    ContainsSubstring("b.exr': it has 16 x 9 pixels; an environment is twice"));
  CHECK_THROWS_WITH(read(write("c.exr", {{0, 0}, {15, 7}}, std::numeric_limits<float>::infinity())),
                    ContainsSubstring("c.exr': a pixel of it is infinite"));
  CHECK_THROWS_WITH(read(folder.file("d.exr", std::string(1000, 'n')).string()),
                    ContainsSubstring("d.exr': OpenEXR cannot read it"));
  std::ifstream whole(folder / "a.exr", std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(whole), {});
  CHECK_THROWS_AS(read(folder.file("e.exr", bytes.substr(0, bytes.size() / 2)).string()),
                  InputError);
  CHECK_THROWS_WITH(read(folder / "absent.hdr"), ContainsSubstring("cannot read environment") &&
                                                     ContainsSubstring("absent.hdr"));
  CHECK_THROWS_WITH(read("dawn"),
                    ContainsSubstring("environment: 'dawn' is not known; give evening, "
                                      "overcast, studio, or a file"));
}

TEST_CASE("every built-in environment can be read, and lights about as much as the studio") {
  REQUIRE(environment_names() == std::vector<std::string>{"evening", "overcast", "studio"});
  for (const std::string& name : environment_names()) {
    CAPTURE(name);
    const auto light = picture::light_of(picture::read_environment(name, {}));
    auto cones = picture::cones_of(light.sky, 256);
    if (light.sun) cones.push_back(*light.sun);
    double most = 0;
    for (const picture::Cone& cone :
         picture::cones_of(of_function(64, [](auto&) { return 1; }), 64)) {
      most = std::max(most, irradiance(cones, cone.towards).y());
    }
    CHECK(most > 1);
    CHECK(most < 2.5);
  }
}

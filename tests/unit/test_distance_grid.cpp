// Grids of signed distance: their splines, and the map files that hold them.

#include <catch2/catch_all.hpp>
#include <nlohmann/json.hpp>
#include <random>

#include "base/base64.hpp"
#include "base/deflate.hpp"
#include "distance_map.hpp"
#include "map/reference_iteration.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using nlohmann::json;

namespace {

const DistanceModulus& modulus_of(const Map& map) {
  return std::get<DistanceModulus>(map.dynamics.modulus);
}

/// d by the reference, at W = 0.
double reference_distance(const Map& map, const Eigen::Vector3d& x) {
  const double f = reference::step(map, {x.x(), x.y(), x.z(), 0}).log_norm;
  return (f - map.dynamics.log_scale) * modulus_of(map).shell;
}

std::vector<Eigen::Vector3d> some_points(std::size_t count) {
  std::mt19937_64 bits(8);
  std::vector<Eigen::Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = test::uniform(bits, -1.4, 0.85);
    const double y = test::uniform(bits, -0.75, 0.8);
    points.emplace_back(x, y, test::uniform(bits, -0.75, 0.75));
  }
  return points;
}

/// The whole spline at a point, from the coefficients that devices get.
double expanded_distance(const DistanceModulus& modulus, const Eigen::Vector3d& x) {
  const auto [nx, ny, nz] = modulus.grid->data().cells;
  const Eigen::Vector3d u = (x - modulus.origin) / modulus.step;
  const auto weight = [](double a) {
    a = std::abs(a);
    return a < 0.5 ? 0.75 - a * a : a < 1.5 ? 0.5 * (1.5 - a) * (1.5 - a) : 0;
  };
  double sum = 0;
  std::size_t number = 0;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i, ++number) {
        const double w =
            weight(u.x() - i - 0.5) * weight(u.y() - j - 0.5) * weight(u.z() - k - 0.5);
        if (w > 0) sum += w * static_cast<double>(modulus.grid->coefficients()[number]);
      }
    }
  }
  return sum * modulus.step;
}

std::string refusal(const json& text) {
  try {
    map_from_json(text, "text");
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

}  // namespace

TEST_CASE("a grid gives back the distance it was sampled from, closest at the surface") {
  const Map map = test::distance_map();
  const double step = modulus_of(map).step;
  double worst_near = 0, worst = 0;
  for (const auto& x : some_points(3000)) {
    const double error = std::abs(reference_distance(map, x) - test::two_balls(x)) / step;
    worst = std::max(worst, error);
    // Away from the crease and from the balls' middles.
    const bool is_smooth =
        std::abs((x - Eigen::Vector3d(0.1, 0, 0)).norm() - 0.7 -
                 ((x - Eigen::Vector3d(-0.9, 0.3, 0.1)).norm() - 0.45)) > 5 * step;
    if (is_smooth && std::abs(test::two_balls(x)) < step) worst_near = std::max(worst_near, error);
  }
  CHECK(worst_near < 0.03);  // cells
  CHECK(worst < 1.5);
}

TEST_CASE("a coarse grid, whose ends are near the surface, is right up to them") {
  const DistanceModulus placed = test::two_balls_grid(32);
  Map map = test::distance_map();
  DistanceModulus& modulus = std::get<DistanceModulus>(map.dynamics.modulus);
  modulus.grid = placed.grid;
  modulus.origin = placed.origin;
  modulus.step = placed.step;
  const auto& cells = placed.grid->data().cells;
  double worst = 0;
  // Where points that lie beyond the domain are seen from.
  for (int axis = 0; axis < 3; ++axis) {
    for (const Eigen::Vector3d& x : some_points(400)) {
      Eigen::Vector3d at = x;
      const bool is_low = x[axis] < 0;
      const int cell = is_low ? 4 : cells[static_cast<std::size_t>(axis)] - 4;
      at[axis] = placed.origin[axis] + placed.step * cell;
      worst = std::max(worst, std::abs(reference_distance(map, at) - test::two_balls(at)));
    }
  }
  CHECK(worst < 0.6 * placed.step);
}

TEST_CASE("coefficients of all cells are both splines together") {
  const Map map = test::distance_map();
  for (const auto& x : some_points(60)) {
    CHECK(expanded_distance(modulus_of(map), x) ==
          Catch::Approx(reference_distance(map, x)).margin(1e-5));
  }
}

TEST_CASE("the slope of a grid is a bound, and not far above 1") {
  const Map map = test::distance_map();
  const auto points = some_points(4000);
  double steepest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d y = points[i] + 1e-3 * (points[(i + 1) % points.size()] - points[i]);
    const double change = reference_distance(map, y) - reference_distance(map, points[i]);
    steepest = std::max(steepest, std::abs(change) / (y - points[i]).norm());
  }
  CHECK(steepest > 0.95);
  CHECK(steepest <= modulus_of(map).grid->slope());
  CHECK(modulus_of(map).grid->slope() < 1.8);
}

TEST_CASE("the inside is within the radius that is told") {
  const Map map = test::distance_map();
  const DistanceModulus& modulus = modulus_of(map);
  const Eigen::Vector3d center = -modulus.origin / modulus.step;
  const double radius =
      modulus.step * modulus.grid->farthest_inside({center.x(), center.y(), center.z()});
  const double exact = Eigen::Vector3d(-0.9, 0.3, 0.1).norm() + 0.45;
  CHECK(radius >= exact);
  CHECK(radius < exact + 4 * modulus.step);
}

TEST_CASE("beyond its outer radius every orbit of a map with a grid grows, however low its scale") {
  Map map = test::distance_map(0.05);
  for (const double log_scale : {0.0, -3.0, -1e3, -1e15}) {
    map.dynamics.log_scale = log_scale;
    const double radius = modulus_of(map).outer_bound(map.dynamics).radius;
    const double far = std::abs(log_scale) * modulus_of(map).shell;
    CHECK(radius > 0.99 * far);
    CHECK(radius < far + 20);
  }
}

TEST_CASE("a map with a grid makes the way to a file of version 2 and back, bit for bit") {
  const test::TemporaryFolder folder;
  Map map = test::distance_map();
  if (GENERATE(false, true)) {
    std::get<DistanceModulus>(map.dynamics.modulus).fourth = FourthCoordinate::ignored;
  }
  write_map(map, folder / "a.json");
  const Map back = read_map(folder / "a.json");
  CHECK(back.dynamics.modulus == map.dynamics.modulus);
  CHECK(back.dynamics.kind() == "distance/factors");
  CHECK(to_json(back) == to_json(map));
  CHECK(to_json(map)["version"] == 2);
  // What version 1 can hold is written as version 1.
  CHECK(to_json(test::random_map(3, 0.1, 0.5, 1))["version"] == 1);
}

TEST_CASE("grids that are wrong are refused by name") {
  struct Wrong {
    const char* key;
    json value;
    const char* named;
  };
  const auto wrong = GENERATE(values<Wrong>({
      {"cells", json::array({48, 32}), "cells"},
      {"cells", json::array({48, 32, 31.5}), "cells"},
      {"cells", json::array({48, 32, 1000000}), "cells"},
      {"cells", json::array({48, 32, -32}), "cells"},
      {"cells", json::array({512, 512, 512}), "zlib"},
      {"origin", json::array({0, 0}), "origin"},
      {"origin", json::array({0, 0, 1e12}), "origin"},
      {"step", 0, "step"},
      {"step", nullptr, "step"},
      {"shell", -1, "shell"},
      {"shell", "NaN", "shell"},
      {"inradius", 0, "inradius"},
      {"fourth", "flat", "fourth"},
      {"blocks", -1, "blocks"},
      {"blocks", 2, "zlib"},
      {"blocks", 1.5, "blocks"},
      {"data", "!", "base64"},
      {"data", "AAAA", "zlib"},
      {"data", 3, "data"},
      {"grid", 0, "grid"},
  }));
  json text = to_json(test::distance_map());
  text["distance"][wrong.key] = wrong.value;
  CAPTURE(wrong.key, wrong.value);
  CHECK_THAT(refusal(text), Catch::Matchers::ContainsSubstring(wrong.named) &&
                                Catch::Matchers::ContainsSubstring("distance"));
  text = to_json(test::distance_map());
  text["distance"].erase("step");
  CHECK_THAT(refusal(text), Catch::Matchers::ContainsSubstring("distance.step"));
  text = to_json(test::distance_map());
  text["version"] = 1;
  CHECK_THAT(refusal(text), Catch::Matchers::ContainsSubstring("version 2"));
  text["version"] = 3;
  CHECK_THAT(refusal(text), Catch::Matchers::ContainsSubstring("version"));
}

TEST_CASE("data that is longer or shorter than its cells need is refused, and is not unpacked") {
  json text = to_json(test::distance_map());
  const auto bytes = base::from_base64(text["distance"]["data"].get<std::string>());
  REQUIRE(bytes);
  text["distance"]["data"] = base::base64(bytes->substr(0, bytes->size() / 2));
  CHECK_THAT(refusal(text), Catch::Matchers::ContainsSubstring("zlib"));
  text["distance"]["data"] = base::base64(*bytes + "more");
  CHECK_THAT(refusal(text), Catch::Matchers::ContainsSubstring("zlib"));
  // 256 MiB of zeros in 256 KiB.
  text["distance"]["data"] = base::base64(base::deflated(std::string(std::size_t{1} << 28U, '\0')));
  CHECK_THAT(refusal(text), Catch::Matchers::ContainsSubstring("zlib"));
}

TEST_CASE("a grid's parts must fit together, with the inside clear of its ends") {
  const DistanceGridData good = modulus_of(test::distance_map()).grid->data();
  CHECK_NOTHROW(DistanceGrid(good));
  const auto refused = [&](const auto& change, const char* named) {
    DistanceGridData data = good;
    change(data);
    CHECK_THROWS_WITH(DistanceGrid(data), Catch::Matchers::ContainsSubstring(named));
  };
  refused([](DistanceGridData& d) { d.cells[1] += 2; }, "cells");
  refused([](DistanceGridData& d) { d.coarse.pop_back(); }, "coarse");
  refused([](DistanceGridData& d) { d.corrections.pop_back(); }, "corrections");
  refused([](DistanceGridData& d) { std::swap(d.blocks[0], d.blocks[1]); }, "blocks");
  refused([](DistanceGridData& d) { d.blocks.back() = 1U << 30U; }, "blocks");
  refused([](DistanceGridData& d) { d.blocks.front() = 0; }, "outermost");
  refused([](DistanceGridData& d) { d.coarse.front() = -1; }, "inside");
}

TEST_CASE("base64 is that of RFC 4648, both ways") {
  for (const auto& [bytes, text] : {std::pair{"", ""},
                                    {"f", "Zg=="},
                                    {"fo", "Zm8="},
                                    {"foo", "Zm9v"},
                                    {"foobar", "Zm9vYmFy"},
                                    {"\xff\xfe\xfd", "//79"}}) {
    CHECK(base::base64(bytes) == text);
    CHECK(base::from_base64(text) == std::string(bytes));
  }
  for (const char* text :
       {"Z", "Zg", "Zg=", "Zh==", "Zm9=", "Zm9v====", "Zg==Zg==", "Zm-v", "Z\ng="}) {
    CHECK_FALSE(base::from_base64(text));
  }
}

TEST_CASE("what is deflated comes back, of its own size alone") {
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{1} << 17U}) {
    std::string bytes(size, '\0');
    for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * i >> 3U);
    const std::string small = base::deflated(bytes);
    CHECK(base::inflated(small, size) == bytes);
    CHECK_FALSE(base::inflated(small, size + 1));
    if (size > 0) CHECK_FALSE(base::inflated(small, size - 1));
    CHECK_FALSE(base::inflated(small + "x", size));
    CHECK_FALSE(base::inflated(small.substr(0, small.size() - 1), size));
  }
}

// The field on a grid: against the original program's figures, and the files it is written to.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "base/larger_error.hpp"
#include "map/reference_iteration.hpp"
#include "original.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/sample.hpp"
#include "random_maps.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

const Device& sampling_device() { return test::shared_device(); }

std::vector<double> sampled(const Map& map, const SampleOptions& options, CellOrder order) {
  std::vector<double> values;
  sample_field(sampling_device(), map, options, sample_grid(sampling_device(), map, options), order,
               [&](std::span<const double> piece) {
                 values.insert(values.end(), piece.begin(), piece.end());
               });
  return values;
}

/// Not symmetric in any way, and with a window of its own.
Map sampled_map() {
  Map map = test::random_map(9, 0.2, 0.9, 8);
  map.dynamics.slice = 0.05;
  map.frame.shape_to_map = {1.5, {0.2, -0.1, 0.3}};
  map.frame.box = Box{{-1, -0.8, -0.6}, {1, 0.7, 0.4}};
  return map;
}

SampleOptions small_options(Precision precision) {
  SampleOptions options;
  options.resolution = 10;
  options.iterations = 2;
  options.escape = 7;
  options.box = Box{{-0.5, -1, 0}, {0.5, 1, 0.6}};  // 5 × 10 × 3 cells
  options.precision = precision;
  return options;
}

/// F_2 at the cell with these numbers, by the reference.
double expected_at(const Map& map, int x, int y, int z) {
  const Eigen::Vector3d cell(-0.5 + 0.2 * (x + 0.5), -1 + 0.2 * (y + 0.5), 0.2 * (z + 0.5));
  const Eigen::Vector3d p = map.frame.shape_to_map.to_map(cell);
  return reference::field(map, std::vector<Quaternion>{{p.x(), p.y(), p.z(), map.dynamics.slice}},
                          2, 7)[0];
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

template <class Real>
std::vector<double> reals_at(const std::string& bytes, std::size_t from, std::size_t count) {
  REQUIRE(bytes.size() >= from + count * sizeof(Real));
  std::vector<Real> reals(count);
  std::memcpy(reals.data(), bytes.data() + from, count * sizeof(Real));
  return {reals.begin(), reals.end()};
}

}  // namespace

TEST_CASE("the field is the original program's") {
  const test::OriginalFigures original;
  const auto center = original.numbers("center");
  const auto lengths = original.numbers("lengths");
  const Eigen::Vector3d middle(center.data());
  const Eigen::Vector3d half = 0.5 * Eigen::Vector3d(lengths.data());
  SampleOptions options;
  options.resolution = static_cast<int>(original.number("res"));
  options.escape = original.number("escape");
  options.box = Box{middle - half, middle + half};
  for (const Precision precision : {Precision::single, Precision::dbl}) {
    if (!test::can_check(sampling_device(), precision)) continue;
    options.precision = precision;
    for (int n = 1; n <= 3; ++n) {
      options.iterations = n;
      CAPTURE(n, precision == Precision::dbl);
      const auto expected = original.numbers("logField_n" + std::to_string(n));
      const auto values = sampled(original.map(), options, CellOrder::x_fastest);
      REQUIRE(values.size() == expected.size());
      // Each iterate stretches rounding by the map's slope.
      const double rounding = precision == Precision::dbl ? 1e-13 : 1e-6;
      const double tolerance = rounding * std::pow(10, n);
      double worst = 0;
      for (std::size_t i = 0; i < values.size(); ++i) {
        worst = base::larger_error(worst, std::abs(values[i] - expected[i]));
      }
      CHECK(worst < tolerance);
    }
  }
}

TEST_CASE("cells are nearly cubes that fill the box") {
  SampleOptions options = small_options(Precision::single);
  const CellGrid grid = sample_grid(sampling_device(), sampled_map(), options);
  CHECK(grid.cells == std::array{5, 10, 3});
  CHECK((grid.center(0, 0, 0) - Eigen::Vector3d(-0.4, -0.9, 0.1)).norm() < 1e-12);
  CHECK((grid.center(4, 9, 2) - Eigen::Vector3d(0.4, 0.9, 0.5)).norm() < 1e-12);
  options.box.reset();
  CHECK((sample_grid(sampling_device(), sampled_map(), options).box.low -
         Eigen::Vector3d(-1.1, -0.9, -0.7))
            .norm() < 1e-12);
  // Without a box in the map, all of the set.
  Map bare;
  bare.dynamics.factors = {{{}, 2}};
  bare.frame.shape_to_map = {2, {1, 0, 0}};
  const Box whole = sample_grid(sampling_device(), bare, options).box;
  CHECK(whole.low.x() < -1);
  CHECK(whole.high.x() > 0);
}

TEST_CASE("an .npy file holds [x][y][z]") {
  const Map map = sampled_map();
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "field.npy";
  for (const Precision precision : {Precision::single, Precision::dbl}) {
    if (!test::can_check(sampling_device(), precision)) continue;
    const bool twice = precision == Precision::dbl;
    write_field(sampling_device(), map, small_options(precision), path);
    const std::string bytes = bytes_of(path);
    REQUIRE(bytes.substr(0, 8) == std::string("\x93NUMPY\x01\x00", 8));
    const std::size_t header = 10 + static_cast<unsigned char>(bytes[8]) +
                               256 * static_cast<std::size_t>(static_cast<unsigned char>(bytes[9]));
    CHECK(header % 64 == 0);
    CHECK(bytes.substr(10, header - 10).find("(5, 10, 3)") != std::string::npos);
    CHECK(bytes.substr(10, header - 10).find(twice ? "'<f8'" : "'<f4'") != std::string::npos);
    CHECK(bytes.size() == header + 150 * (twice ? sizeof(double) : sizeof(float)));
    const auto values =
        twice ? reals_at<double>(bytes, header, 150) : reals_at<float>(bytes, header, 150);
    for (int x = 0; x < 5; ++x) {
      for (int y = 0; y < 10; ++y) {
        for (int z = 0; z < 3; ++z) {
          const auto index = static_cast<std::size_t>((x * 10 + y) * 3 + z);
          CHECK(values[index] ==
                Catch::Approx(expected_at(map, x, y, z)).margin(twice ? 1e-10 : 1e-4));
        }
      }
    }
  }
}

TEST_CASE("a .vti file holds x fastest, at the cells' centres") {
  const Map map = sampled_map();
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "field.vti";
  write_field(sampling_device(), map, small_options(Precision::single), path, "a --comment-x");
  const std::string bytes = bytes_of(path);
  const std::string head = bytes.substr(0, bytes.find("\n_"));
  for (const char* part : {"<!-- a - -comment-x -->", "WholeExtent=\"0 4 0 9 0 2\"", "Float32",
                           "Origin=\"-0.4 -0.9 0.0999", "header_type=\"UInt64\""}) {
    CAPTURE(head, part);
    CHECK(head.find(part) != std::string::npos);
  }
  const std::size_t data = head.size() + 2 + sizeof(std::uint64_t);
  const auto values = reals_at<float>(bytes, data, 150);
  for (int z = 0; z < 3; ++z) {
    for (int y = 0; y < 10; ++y) {
      for (int x = 0; x < 5; ++x) {
        const auto index = static_cast<std::size_t>((z * 10 + y) * 5 + x);
        CHECK(values[index] == Catch::Approx(expected_at(map, x, y, z)).margin(1e-4));
      }
    }
  }
  CHECK(bytes.ends_with("</AppendedData>\n</VTKFile>\n"));
}

TEST_CASE("what cannot be sampled is refused, and a stop leaves no file") {
  const test::TemporaryFolder folder;
  const auto refused = [&](auto change, const char* word) {
    SampleOptions options;
    change(options);
    CHECK_THROWS_WITH(
        write_field(sampling_device(), sampled_map(), options, folder.path() / "a.npy"),
        Catch::Matchers::ContainsSubstring(word));
  };
  refused([](SampleOptions& o) { o.resolution = 0; }, "resolution");
  refused([](SampleOptions& o) { o.iterations = 17; }, "iterations");
  refused([](SampleOptions& o) { o.escape = std::nan(""); }, "escape");
  refused([](SampleOptions& o) { o.box = Box{{0, 0, 0}, {1, 0, 1}}; }, "box");
  CHECK_THROWS_AS(write_field(sampling_device(), sampled_map(), {}, folder.path() / "a.txt"),
                  InputError);
  std::stop_source stop;
  stop.request_stop();
  CHECK_THROWS_AS(write_field(sampling_device(), sampled_map(), {}, folder.path() / "a.npy", {},
                              {{}, stop.get_token()}),
                  Interrupted);
  CHECK(folder.names().empty());
}

// The original program's .o3d files.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "original/original_file.hpp"
#include "original_bytes.hpp"
#include "qjulia/base/error.hpp"

using namespace qjulia;
using test::small_original;

namespace {

Map read(const std::string& bytes) { return original::original_from_bytes(bytes, "some.o3d"); }

void check_refused(const std::string& bytes, const std::string& word) {
  CAPTURE(bytes.size(), word);
  CHECK_THROWS_WITH(read(bytes), Catch::Matchers::ContainsSubstring("some.o3d") &&
                                     Catch::Matchers::ContainsSubstring(word));
}

/// The file with an int32 at `offset` replaced.
std::string with_integer(std::string bytes, std::size_t offset, std::int32_t value) {
  return bytes.replace(offset, 4, test::Bytes().integer(value).text());
}

// Where counts stand: after resolution, centre and lengths; then, with three roots, 4 + 3 + 2
// quaternions with a count each.
constexpr std::size_t kTotalRoots = 12 + 48;
constexpr std::size_t kCoefficients = kTotalRoots + 4;
constexpr std::size_t kRoots = kCoefficients + 3 * 4 + 9 * 32;
constexpr std::size_t kPowers = kRoots + 4 + 3 * 32;

}  // namespace

TEST_CASE("an .o3d file is read back exactly") {
  const auto original = small_original();
  const Map map = read(original_bytes(original));
  REQUIRE(map.dynamics.factors.size() == 5);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(map.dynamics.factors[k].center == original.top.roots[k]);
    CHECK(map.dynamics.factors[k].exponent == 1.25 * original.top.powers[k]);
  }
  // (f₁ f₂)⁻¹ = f₂⁻¹ f₁⁻¹.
  CHECK(map.dynamics.factors[3].center == original.bottom.roots[1]);
  CHECK(map.dynamics.factors[3].exponent == -0.5 * 0.6);
  CHECK(map.dynamics.factors[4].center == original.bottom.roots[0]);
  CHECK(map.dynamics.factors[4].exponent == -0.5 * 0.4);
  CHECK(map.dynamics.log_scale == std::log(1.7));
  CHECK(map.dynamics.surface_level == 0);
  CHECK(map.provenance.json()["original"]["resolution"] == nlohmann::json({2, 3, 4}));
}

TEST_CASE("every truncation and every tail is refused") {
  const std::string whole = original_bytes(small_original());
  for (std::size_t size = 0; size < whole.size(); ++size) {
    CHECK_THROWS_AS(read(whole.substr(0, size)), InputError);
  }
  check_refused(whole + "x", "after its end");
  check_refused(std::string(100, '\0'), "not complete");
  check_refused(std::string(10000, '\0'), "scaling");
}

TEST_CASE("hostile counts are refused before anything is allocated") {
  const std::string whole = original_bytes(small_original());
  for (const std::int32_t count : {-1, 1 << 20, std::numeric_limits<std::int32_t>::max(),
                                   std::numeric_limits<std::int32_t>::min()}) {
    check_refused(with_integer(whole, kTotalRoots, count), "roots");
    check_refused(with_integer(whole, kCoefficients, count), "coefficients");
    check_refused(with_integer(whole, kRoots, count), "roots");
    check_refused(with_integer(whole, kPowers, count), "powers");
  }
  check_refused(with_integer(whole, kPowers, 2), "powers");
  check_refused(with_integer(whole, kTotalRoots, 4), "roots");
  // The first field's sides; their product overflows 64 bits.
  const std::size_t field = whole.size() - 3 * (12 + 48 + 24 * 8);
  std::string huge = whole;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    huge = with_integer(huge, field + 4 * axis, std::numeric_limits<std::int32_t>::max());
  }
  check_refused(huge, "field");
  check_refused(with_integer(whole, field, -2), "field");
}

TEST_CASE("numbers that make no map are refused") {
  auto file = small_original();
  file.scaling = 0;
  check_refused(original_bytes(file), "scaling");
  file.scaling = std::numeric_limits<double>::infinity();
  check_refused(original_bytes(file), "log_scale");
  file = small_original();
  file.top.powers[1] = std::nan("");
  check_refused(original_bytes(file), "exponent");
}

TEST_CASE("numbers of the header must be finite, and the message names them") {
  const std::string whole = original_bytes(small_original());
  const auto with_number = [&](std::size_t offset, double value) {
    return std::string(whole).replace(offset, 8, test::Bytes().number(value).text());
  };
  const std::size_t field = whole.size() - 3 * (12 + 48 + 24 * 8);
  for (const double wrong : {std::nan(""), -std::numeric_limits<double>::infinity()}) {
    for (const std::size_t axis : {0U, 1U, 2U}) {
      check_refused(with_number(12 + 8 * axis, wrong), "its centre (");
      check_refused(with_number(36 + 8 * axis, wrong), "its lengths (");
      check_refused(with_number(field + 12 + 8 * axis, wrong), "its fractal field's centre (");
      check_refused(with_number(field + 36 + 8 * axis, wrong), "its fractal field's lengths (");
    }
  }
  check_refused(with_integer(whole, 4, -3), "resolution of -3");
}

TEST_CASE("a .poly4d file is one polynomial") {
  const auto original = small_original();
  test::Bytes bytes;
  put(bytes, original.top);
  const auto polynomial = [](const std::string& text) {
    return original::polynomial_from_bytes(text, "some.poly4d");
  };
  const Map map = polynomial(bytes.text());
  REQUIRE(map.dynamics.factors.size() == 3);
  CHECK(map.dynamics.factors[1].center == original.top.roots[1]);
  CHECK(map.dynamics.factors[1].exponent == 1.25 * original.top.powers[1]);
  CHECK(map.dynamics.log_scale == 0);
  for (std::size_t size = 0; size < bytes.text().size(); ++size) {
    CHECK_THROWS_AS(polynomial(bytes.text().substr(0, size)), InputError);
  }
  CHECK_THROWS_WITH(polynomial(bytes.text() + "x"),
                    Catch::Matchers::ContainsSubstring("after its end"));
}

TEST_CASE("an .f3d file is a field, and a mesh of it lies where the field says") {
  // A ball of radius 0.8 about (0.3, 0, 0), in a box whose cells are not cubes.
  const std::array<int, 3> samples{24, 20, 28};
  const Eigen::Vector3d center(0.2, 0.1, -0.1), lengths(2.4, 2.2, 2.5);
  test::Bytes bytes;
  for (const int n : samples) bytes.integer(n);
  bytes.numbers({center.x(), center.y(), center.z(), lengths.x(), lengths.y(), lengths.z()});
  for (int k = 0; k < samples[2]; ++k) {
    for (int j = 0; j < samples[1]; ++j) {
      for (int i = 0; i < samples[0]; ++i) {
        const Eigen::Vector3d share((i + 0.5) / samples[0], (j + 0.5) / samples[1],
                                    (k + 0.5) / samples[2]);
        const Eigen::Vector3d x =
            center + lengths.cwiseProduct(share - Eigen::Vector3d(0.5, 0.5, 0.5));
        bytes.number((x - Eigen::Vector3d(0.3, 0, 0)).norm() - 0.8);
      }
    }
  }
  const auto field = [](const std::string& text) {
    return original::sampled_distance_from_bytes(text, "some.f3d");
  };
  const original::SampledDistance distance = field(bytes.text());
  CHECK(distance.samples == samples);
  CHECK(distance.center == center);
  const TriangleMesh mesh = original::mesh_of(distance);
  CHECK(inspect(mesh).closed());
  CHECK(signed_volume(mesh) == Catch::Approx(4.0 / 3 * 3.14159265 * 0.512).epsilon(0.01));
  double worst = 0;
  for (const Eigen::Vector3d& x : mesh.vertices) {
    worst = std::max(worst, std::abs((x - Eigen::Vector3d(0.3, 0, 0)).norm() - 0.8));
  }
  CHECK(worst < 0.004);

  const std::string whole = bytes.text();
  for (const std::size_t size :
       {std::size_t{0}, std::size_t{11}, std::size_t{59}, whole.size() - 1}) {
    CHECK_THROWS_AS(field(whole.substr(0, size)), InputError);
  }
  CHECK_THROWS_WITH(field(whole + "x"), Catch::Matchers::ContainsSubstring("after its end"));
  for (const std::int32_t wrong : {-1, 0, 1, 1 << 30, std::numeric_limits<std::int32_t>::max()}) {
    CHECK_THROWS_AS(field(with_integer(whole, 0, wrong)), InputError);
  }
  for (const std::size_t offset : {12U, 20U, 28U, 36U, 44U, 52U}) {
    const std::string nan = test::Bytes().number(std::nan("")).text();
    CHECK_THROWS_WITH(
        field(std::string(whole).replace(offset, 8, nan)),
        Catch::Matchers::ContainsSubstring(offset < 36 ? "its centre" : "its lengths"));
  }
  original::SampledDistance filled = distance;
  for (double& d : filled.values) d = -1;
  CHECK_THROWS_WITH(original::mesh_of(filled), Catch::Matchers::ContainsSubstring("faces") ||
                                                   Catch::Matchers::ContainsSubstring("inside"));
  for (double& d : filled.values) d = 1;
  CHECK_THROWS_WITH(original::mesh_of(filled), Catch::Matchers::ContainsSubstring("inside"));
  original::SampledDistance cut = distance;
  for (std::size_t i = 0; i < 24 * 20 * 8; ++i) cut.values[24 * 20 * 10 - 1 - i] = -1;
  cut.values[0] = -1;
  CHECK_THROWS_WITH(original::mesh_of(cut), Catch::Matchers::ContainsSubstring("faces"));
}

TEST_CASE("portals of a text file are in the map's coordinates") {
  const ShapeToMap to_map{3, {0.1, 0.2, 0.3}};
  const auto portals = [&](const std::string& text) {
    return original::portals_from_text(text, "some.txt", to_map);
  };
  const std::string head = "Portals radius: 0.2\r\nPortals scale: 4\n\n";
  const auto found = portals(head +
                             "Portal location: 0.1 0.3 -0.2\nPortal rotation: 1.5 0 2 0\n"
                             "Portal location: -0.4 0 0\n");
  REQUIRE(found.size() == 2);
  CHECK(found[0].center.isApprox(Eigen::Vector3d(0.4, 1.1, -0.3)));
  CHECK(found[0].radius == Catch::Approx(0.6));
  CHECK(found[0].scale == 4);
  CHECK(found[0].rotation.degrees == Catch::Approx(85.943669));
  CHECK(found[0].rotation.axis == Eigen::Vector3d(0, 2, 0));
  CHECK(found[0].destination == Eigen::Vector3d::Zero());
  CHECK(found[0].mask == PortalMask::outside);
  CHECK(found[1].rotation == Rotation{});
  const auto refused = [&](const std::string& text, const char* part) {
    CHECK_THROWS_WITH(portals(text), Catch::Matchers::ContainsSubstring("some.txt") &&
                                         Catch::Matchers::ContainsSubstring(part));
  };
  refused("", "Portals radius");
  refused(head, "Portal location");
  refused("Portals radius: 1\nPortal location: 0 0 0\n", "Portals scale");
  refused(head + "Portal location: 0 0\n", "line 4 has 2 numbers where 3");
  refused(head + "Portal location: 0 0 0 0\n", "line 4");
  refused(head + "Portal location: 0 0 x\n", "no number");
  refused(head + "Portal location: 0 0 nan\n", "no number");
  refused(head + "Portal rotation: 1 0 1 0\n", "before the first location");
  refused(head + "Portal location: 0 0 0\nPortal rotation: 1 0 0 0\n", "length 0");
  refused(head + "Portal colour: 1\n", "is none of");
  refused(head + "hello\n", "no name and colon");
  std::string many = head;
  for (int i = 0; i < 65; ++i) many += "Portal location: 0 0 0\n";
  refused(many, "64");
}

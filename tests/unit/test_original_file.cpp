// The original program's .o3d files.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "original_bytes.hpp"
#include "qjulia/error.hpp"
#include "qjulia/original_file.hpp"

using namespace qjulia;
using test::small_original;

namespace {

RationalMap read(const std::string& bytes) {
  std::istringstream stream(bytes);
  return original_from_stream(stream, "some.o3d");
}

void check_refused(const std::string& bytes, const std::string& word) {
  CAPTURE(bytes.size(), word);
  CHECK_THROWS_WITH(read(bytes), Catch::Contains("some.o3d") && Catch::Contains(word));
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
  const RationalMap map = read(original_bytes(original));
  REQUIRE(map.factors.size() == 5);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(map.factors[k].center == original.top.roots[k]);
    CHECK(map.factors[k].exponent == 1.25 * original.top.powers[k]);
  }
  // (f₁ f₂)⁻¹ = f₂⁻¹ f₁⁻¹.
  CHECK(map.factors[3].center == original.bottom.roots[1]);
  CHECK(map.factors[3].exponent == -0.5 * 0.6);
  CHECK(map.factors[4].center == original.bottom.roots[0]);
  CHECK(map.factors[4].exponent == -0.5 * 0.4);
  CHECK(map.log_scale == std::log(1.7));
  CHECK(map.surface_level == 0);
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

#include "original/original_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "base/input_file.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::original {
namespace {

static_assert(std::endian::native == std::endian::little, "as in the files");

/// The bytes of a file, taken off its front.
class Reader {
 public:
  Reader(std::string_view bytes, const std::string& source) : rest_(bytes), source_(source) {}

  [[noreturn]] void fail(const std::string& what) const {
    throw InputError(fmt::format("original map '{}': {}", source_, what));
  }
  [[noreturn]] void truncated(const char* what) const {
    fail(fmt::format("ends within its {}: it is not complete", what));
  }

  std::int32_t integer(const char* what) { return value<std::int32_t>(what); }
  double number(const char* what) { return value<double>(what); }

  /// Three finite numbers.
  std::array<double, 3> vector(const char* what) {
    const std::array<double, 3> v{number(what), number(what), number(what)};
    if (!std::ranges::all_of(v, [](double c) { return std::isfinite(c); })) {
      fail(fmt::format("its {} ({}, {}, {}) must be finite numbers; it is damaged", what, v[0],
                       v[1], v[2]));
    }
    return v;
  }

  /// A count of elements of `bytes` each, all of which the file still holds.
  std::uint64_t count(const char* what, std::uint64_t bytes) {
    const std::int32_t read = integer(what);
    if (read < 0 || static_cast<std::uint64_t>(read) > left() / bytes) {
      fail(fmt::format("says there are {} {}, and {} bytes are left; it is damaged", read, what,
                       left()));
    }
    return static_cast<std::uint64_t>(read);
  }

  std::vector<double> numbers(const char* what, std::uint64_t count) {
    std::vector<double> values(static_cast<std::size_t>(count));
    for (double& v : values) v = number(what);
    return values;
  }

  void skip(std::uint64_t bytes, const char* what) {
    if (bytes > left()) truncated(what);
    rest_.remove_prefix(static_cast<std::size_t>(bytes));
  }

  std::uint64_t left() const { return rest_.size(); }
  void expect_end() const {
    if (left() > 0) fail(fmt::format("has {} bytes after its end", left()));
  }

 private:
  template <class T>
  T value(const char* what) {
    if (left() < sizeof(T)) truncated(what);
    T result;
    std::memcpy(&result, rest_.data(), sizeof result);
    rest_.remove_prefix(sizeof result);
    return result;
  }

  std::string_view rest_;
  const std::string& source_;
};

constexpr std::uint64_t kQuaternionBytes = 4 * sizeof(double);

/// Π (q − root)^(scalar · power).
std::vector<Factor> read_polynomial(Reader& file) {
  const std::int32_t total = file.integer("number of roots");
  for (const char* what : {"coefficients", "derivatives", "second derivatives"}) {
    file.skip(file.count(what, kQuaternionBytes) * kQuaternionBytes, what);
  }
  const std::uint64_t roots = file.count("roots", kQuaternionBytes);
  if (total < 0 || roots != static_cast<std::uint64_t>(total)) {
    file.fail(fmt::format("has {} roots where it says {}; it is damaged", roots, total));
  }
  const std::vector<double> centers = file.numbers("roots", 4 * roots);
  const std::uint64_t powers = file.count("powers", sizeof(double));
  if (powers != roots) {
    file.fail(fmt::format("has {} roots and {} powers; it is damaged", roots, powers));
  }
  std::vector<Factor> factors(static_cast<std::size_t>(roots));
  const std::vector<double> exponents = file.numbers("powers", powers);
  const double scalar = file.number("power scalar");
  for (std::size_t k = 0; k < factors.size(); ++k) {
    const double* c = centers.data() + 4 * k;
    factors[k] = {{c[0], c[1], c[2], c[3]}, scalar * exponents[k]};
  }
  return factors;
}

/// Fields are of no use here, but a file that breaks off in one is not complete.
void skip_field(Reader& file, const char* name) {
  std::uint64_t cells = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const std::int32_t n = file.integer(name);
    if (n < 0) file.fail(fmt::format("has a {} with {} cells along a side", name, n));
    cells *= static_cast<std::uint64_t>(n);
    // No more than the file holds, so that the next product does not overflow either.
    if (cells > file.left() / sizeof(double)) file.truncated(name);
  }
  file.vector(fmt::format("{}'s centre", name).c_str());
  file.vector(fmt::format("{}'s lengths", name).c_str());
  file.skip(cells * sizeof(double), name);
}

Map checked(Map map, const Reader& file) {
  try {
    map.validate();
  } catch (const InputError& error) {
    file.fail(error.what());
  }
  return map;
}

std::string bytes_of(const std::filesystem::path& path, const char* what) {
  constexpr std::uint64_t kLargestOriginalFile = std::uint64_t{1} << 30;
  std::string bytes;
  base::InputFile(path, what, kLargestOriginalFile).read_all(bytes);
  return bytes;
}

}  // namespace

Map original_from_bytes(std::string_view bytes, const std::string& source) {
  Reader file(bytes, source);
  std::array<std::int32_t, 3> resolution{};
  for (std::int32_t& n : resolution) {
    n = file.integer("resolution");
    if (n < 0) file.fail(fmt::format("has a resolution of {}; it is damaged", n));
  }
  const auto center = file.vector("centre");
  const auto lengths = file.vector("lengths");

  Map map;
  map.dynamics.factors = read_polynomial(file);
  std::vector<Factor> bottom = read_polynomial(file);
  std::ranges::reverse(bottom);
  for (Factor& factor : bottom) factor.exponent = -factor.exponent;
  map.dynamics.factors.insert(map.dynamics.factors.end(), bottom.begin(), bottom.end());

  const double scaling = file.number("scaling");
  if (!(scaling > 0)) file.fail(fmt::format("has the scaling {}: it must be positive", scaling));
  map.dynamics.log_scale = std::log(scaling);
  const std::int32_t history = file.integer("history");
  if (history < 0) file.fail(fmt::format("has a history of {} entries", history));
  // How entries of a history lie is not known; all that makes the map has been read.
  if (history == 0) {
    for (const char* name : {"fractal field", "distance field", "curvature field"}) {
      skip_field(file, name);
    }
    file.expect_end();
  }
  map.provenance.set("original",
                     {{"resolution", resolution}, {"center", center}, {"lengths", lengths}});
  return checked(std::move(map), file);
}

Map polynomial_from_bytes(std::string_view bytes, const std::string& source) {
  Reader file(bytes, source);
  Map map;
  map.dynamics.factors = read_polynomial(file);
  file.expect_end();
  return checked(std::move(map), file);
}

SampledDistance sampled_distance_from_bytes(std::string_view bytes, const std::string& source) {
  Reader file(bytes, source);
  SampledDistance field;
  std::uint64_t samples = 1;
  for (int& n : field.samples) {
    n = file.integer("number of samples");
    if (n < 2) file.fail(fmt::format("has {} samples along a side: it needs 2", n));
    samples *= static_cast<std::uint64_t>(n);
    if (samples > file.left() / sizeof(double)) {
      file.fail(
          fmt::format("promises more samples than its {} bytes hold; it is damaged", file.left()));
    }
  }
  field.center = Eigen::Vector3d(file.vector("centre").data());
  field.lengths = Eigen::Vector3d(file.vector("lengths").data());
  constexpr double kLargestOfBox = 1e12;
  if (!(field.center.cwiseAbs().maxCoeff() <= kLargestOfBox) ||
      !(field.lengths.minCoeff() > 0 && field.lengths.maxCoeff() <= kLargestOfBox)) {
    file.fail("has a centre or lengths that are no box's");
  }
  field.values = file.numbers("samples", samples);
  file.expect_end();
  if (!std::ranges::all_of(field.values, [](double value) { return std::isfinite(value); })) {
    file.fail("has a distance that is not a finite number");
  }
  return field;
}

Map read_original(const std::filesystem::path& path) {
  const std::string bytes = bytes_of(path, "original map");
  return base::extension_of(path) == ".poly4d" ? polynomial_from_bytes(bytes, path.string())
                                               : original_from_bytes(bytes, path.string());
}

SampledDistance read_sampled_distance(const std::filesystem::path& path) {
  return sampled_distance_from_bytes(bytes_of(path, "distance field"), path.string());
}

}  // namespace qjulia::original

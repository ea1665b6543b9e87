#pragma once
/// What tests of hostile values say of a call, and the values. tests/lint/hostile.py checks that
/// test_hostile_*.cpp call every public function.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "qjulia/qjulia.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

namespace qjulia::test {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHuge = 1e300;
inline const std::vector<double> kHostileNumbers{kNan,   kInfinity, -kInfinity, kHuge,
                                                 -kHuge, -1,        0,          1e-300};
inline const std::vector<int> kHostileCounts{std::numeric_limits<int>::min(), -1, 0, 17, 1000,
                                             std::numeric_limits<int>::max()};
inline const Eigen::Vector3d kNowhere(0, kNan, 0);

/// A few texts that name nothing: empty, with zeros, and not UTF-8.
inline const std::vector<std::string> kHostileTexts{std::string(), std::string(1, '\0'),
                                                    std::string(1000, '\xff'), "{}", "nan"};

inline bool is_positive(double x) { return x > 0 && std::isfinite(x); }
inline bool is_within(double x, double least, double most) { return x >= least && x <= most; }
/// Whether kernels take coordinates of this size.
inline bool is_near(double x) { return std::abs(x) <= 1e15; }

/// Runs `call`, which says whether its result is right, or checks it itself. Within CHECK(…) no
/// call of the library may stand: an exception from there would not reach what expects it.
template <class Call>
void run(const Call& call) {
  if constexpr (std::is_void_v<decltype(call())>) {
    call();
    SUCCEED();
  } else {
    const bool is_right = call();
    CHECK(is_right);
  }
}

/// Checks that `call` returns, and that its result is right.
template <class Call>
void accepts(const std::string& what, const Call& call) {
  INFO(what);
  try {
    run(call);
  } catch (const std::exception& error) {
    FAIL_CHECK("throws " << error.what());
  }
}

/// Checks that `call` throws an InputError about `named`: the field of an OptionError, or words of
/// another message. With an empty name any message will do.
template <class Call>
void refuses(const std::string& what, const std::string& named, const Call& call) {
  INFO(what << " is expected to refuse '" << named << "'");
  try {
    call();
    FAIL_CHECK("accepts it");
  } catch (const OptionError& error) {
    CHECK((named.empty() || error.field() == named));
    CHECK_FALSE(error.problem().empty());
  } catch (const InputError& error) {
    CHECK_FALSE(std::string(error.what()).empty());
    CHECK_THAT(error.what(), Catch::Matchers::ContainsSubstring(named));
  } catch (const std::exception& error) {
    FAIL_CHECK("throws " << error.what());
  }
}
template <class Call>
void refuses(const std::string& what, const Call& call) {
  refuses(what, "", call);
}

/// `accepts` or `refuses`, by whether the value is valid.
template <class Call>
void takes(bool is_valid, const std::string& what, const std::string& named, const Call& call) {
  is_valid ? accepts(what, call) : refuses(what, named, call);
}

/// Checks that `call` returns or throws an exception of the library. @param why both are right
template <class Call>
void survives(const std::string& what, const std::string& why, const Call& call) {
  INFO(what << ", where " << why);
  try {
    run(call);
  } catch (const Error& error) {
    CHECK_FALSE(std::string(error.what()).empty());
  } catch (const std::exception& error) {
    FAIL_CHECK("throws " << error.what());
  }
}

template <class Value, class Change>
Value changed(Value value, const Change& change) {
  change(value);
  return value;
}

/// A small map, whose set has points, for what is about other values than the map's.
inline Map good_map() {
  Map map = random_map(8, 0.5, 1.5, 3);
  for (Factor& factor : map.dynamics.factors) factor.exponent = std::abs(factor.exponent);
  map.dynamics.log_scale = -2;
  map.frame.box = Box{{-1, -1, -1}, {1, 1, 1}};
  map.frame.detail = 0.02;
  map.frame.inradius = 0.3;
  return map;
}

inline PictureOptions small_picture() {
  PictureOptions options;
  options.width = options.height = 8;
  options.iterations = 2;
  options.samples = 1;
  return options;
}

inline SurfaceOptions small_surface() { return {.resolution = 8, .iterations = 2}; }

inline SampleOptions small_sample() {
  SampleOptions options;
  options.resolution = 4;
  options.iterations = 2;
  return options;
}

inline CompareOptions small_compare() { return {.resolution = 8, .iterations = 1}; }

inline ExactMapOptions small_exact() {
  ExactMapOptions options;
  options.resolution = 32;
  return options;
}

inline FitOptions small_fit() {
  FitOptions options;
  options.factors = 8;
  options.max_evaluations = 2;
  return options;
}

/// Checks a picture's size, and that its parts belong together.
inline void check_picture(const Image& image, const PictureOptions& options) {
  image.validate();
  CHECK(image.width == options.width);
  CHECK(image.height == options.height);
}

}  // namespace qjulia::test

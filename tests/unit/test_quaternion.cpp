// Quaternion algebra: the laws that log, exp and powers keep.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "qjulia/base/quaternion.hpp"
#include "random_maps.hpp"

using namespace qjulia;

namespace {

Quaternion random_quaternion(std::mt19937_64& bits, double reach) {
  const double x = test::uniform(bits, -reach, reach);
  const double y = test::uniform(bits, -reach, reach);
  const double z = test::uniform(bits, -reach, reach);
  return {x, y, z, test::uniform(bits, -reach, reach)};
}

double distance(const Quaternion& p, const Quaternion& q) { return norm(p - q); }

Quaternion conjugate(const Quaternion& q) { return {q.x, -q.y, -q.z, -q.w}; }

}  // namespace

TEST_CASE("products multiply norms and follow Hamilton's table") {
  const Quaternion i{0, 1, 0, 0};
  const Quaternion j{0, 0, 1, 0};
  const Quaternion k{0, 0, 0, 1};
  CHECK(i * j == k);
  CHECK(j * k == i);
  CHECK(k * i == j);
  CHECK(j * i == Quaternion{0, 0, 0, -1});
  CHECK(i * i == Quaternion{-1, 0, 0, 0});
  std::mt19937_64 bits(1);
  for (int n = 0; n < 200; ++n) {
    const Quaternion p = random_quaternion(bits, 3);
    const Quaternion q = random_quaternion(bits, 3);
    CHECK(norm(p * q) == Catch::Approx(norm(p) * norm(q)).epsilon(1e-14));
    CHECK(distance(conjugate(p * q), conjugate(q) * conjugate(p)) < 1e-13);
  }
}

TEST_CASE("exp undoes log on the principal branch, and log undoes exp within pi") {
  std::mt19937_64 bits(2);
  for (int n = 0; n < 200; ++n) {
    const Quaternion q = random_quaternion(bits, 3);
    CHECK(distance(exp(log(q)), q) < 1e-13);
    const Quaternion small = random_quaternion(bits, 1.8);  // vector part below pi
    CHECK(distance(log(exp(small)), small) < 1e-12);
  }
}

TEST_CASE("log has the angle of the plane through the real axis") {
  const Quaternion one = log({0, 0, 2, 0});
  CHECK(one.x == Catch::Approx(std::log(2.0)));
  CHECK(one.z == Catch::Approx(std::numbers::pi / 2));
  CHECK(log({3, 0, 0, 0}) == Quaternion{std::log(3.0), 0, 0, 0});
}

TEST_CASE("the branch cut is the negative real axis") {
  const Quaternion on = log({-2, 0, 0, 0});
  CHECK(on.y == Catch::Approx(std::numbers::pi));
  CHECK(on.z == 0);
  // The direction depends on the side one comes from; the angle does not.
  const Quaternion above = log({-2, 0, 1e-12, 0});
  const Quaternion below = log({-2, 0, -1e-12, 0});
  CHECK(above.z == Catch::Approx(std::numbers::pi));
  CHECK(below.z == Catch::Approx(-std::numbers::pi));
  CHECK(distance(pow({-2, 0, 0, 0}, 2), {4, 0, 0, 0}) < 1e-14);
  CHECK(distance(pow({-1, 0, 0, 0}, 0.5), {0, 1, 0, 0}) < 1e-15);
}

TEST_CASE("powers are repeated products, and add and invert") {
  std::mt19937_64 bits(3);
  for (int n = 0; n < 200; ++n) {
    const Quaternion q = random_quaternion(bits, 1.5);
    CHECK(distance(pow(q, 3), q * q * q) < 1e-12);
    CHECK(distance(pow(q, 0.4) * pow(q, 0.6), q) < 1e-13);
    CHECK(distance(pow(q, -1) * q, {1, 0, 0, 0}) < 1e-13);
    CHECK(norm(pow(q, -0.7)) == Catch::Approx(std::pow(norm(q), -0.7)).epsilon(1e-13));
  }
}

TEST_CASE("powers of zero") {
  CHECK(pow({0, 0, 0, 0}, 0.3) == Quaternion{});
  CHECK(pow({0, 0, 0, 0}, 0) == Quaternion{1, 0, 0, 0});
  CHECK(std::isinf(pow({0, 0, 0, 0}, -0.3).x));
  CHECK(log({0, 0, 0, 0}).x == -std::numeric_limits<double>::infinity());
}

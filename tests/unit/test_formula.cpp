// Formulas for other programs: what they cannot hold is refused in words that help, and names and
// numbers of all kinds make valid text. What they compute: tests/explore/formula.py.

#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>

#include "formula/formula.hpp"
#include "qjulia/base/error.hpp"
#include "random_maps.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;
using formula::Program;

namespace {

constexpr auto kPrograms = {Program::fragmentarium, Program::shadertoy};

formula::Reach usual_reach() { return {{0.5, 2, 2.5}, 12}; }

std::string text_of(const Map& map, Program program, const std::string& name = "ball.qjulia.json") {
  return formula_text(map, usual_reach(), program, name);
}

/// How often a text stands in another.
int count_of(const std::string& what, const std::string& text) {
  int count = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("a formula has every factor, and fills up its last group") {
  const Map map = test::random_map(30, 0.001, 0.6, 5);
  for (const Program program : kPrograms) {
    const std::string text = text_of(map, program);
    CHECK_THAT(text, ContainsSubstring("const vec4 exponents[8] = vec4[8]("));
    CHECK_THAT(text, ContainsSubstring("const vec4 centers[32] = vec4[32]("));
    CHECK(count_of("vec4(0.0, 0.0, 0.0, 0.0)", text) == 2);
    CHECK(count_of("float map_iterate(", text) == 1);
    CHECK(count_of("uniform vec4 map_phase", text) == 0);
  }
}

TEST_CASE("a formula provides what its program asks for") {
  const Map map = test::random_map(8, 0.001, 0.6, 5);
  const std::string frag = text_of(map, Program::fragmentarium);
  CHECK(frag.starts_with("#version 130\n"));
  CHECK_THAT(frag,
             ContainsSubstring("#include \"MathUtils.frag\"\n#include \"DE-Raytracer.frag\"\n") &&
                 ContainsSubstring("float DE(vec3 pos)") &&
                 ContainsSubstring("uniform int Iterations; slider[1,6,16]\n") &&
                 ContainsSubstring("#preset Default\n"));
  CHECK(frag.find("iFrame") == std::string::npos);
  const std::string toy = text_of(map, Program::shadertoy);
  CHECK_THAT(toy, ContainsSubstring("void mainImage(out vec4 fragColor, in vec2 fragCoord)"));
  CHECK(toy.find("slider") == std::string::npos);
  std::istringstream lines(toy);
  for (std::string line; std::getline(lines, line);) CHECK_FALSE(line.starts_with("#include"));
}

TEST_CASE("numbers of a formula are finite literals of type float") {
  Map map = test::random_map(4, 0.001, 0.6, 5);
  map.dynamics.factors[0] = {{1, -2, 3e-12, 1e9}, 2};
  formula::Reach reach = usual_reach();
  reach.stops.inner = 0;
  const std::string text = formula_text(map, reach, Program::shadertoy, "m");
  CHECK_THAT(text, ContainsSubstring("vec4(1.0, -2.0, 3e-12, 1000000000.0)"));
  CHECK_THAT(text, ContainsSubstring("const float map_log_inner = -1e+30;\n"));
}

TEST_CASE("a formula stands upright and is centred") {
  Map map = test::random_map(4, 0.001, 0.6, 5);
  map.frame.shape_to_map = {0.5, {1, 2, 3}};
  map.frame.box = Box{{0, 0, 0}, {8, 4, 2}};
  map.frame.up = UpAxis::z;
  const std::string text = text_of(map, Program::shadertoy);
  CHECK_THAT(text, ContainsSubstring("const float frame_scale = 2.0;\n"));
  CHECK_THAT(text, ContainsSubstring("const vec3 frame_center = vec3(3.0, 3.0, 3.5);\n"));
  // To the right y, up z, to the front x.
  CHECK_THAT(text, ContainsSubstring("const mat3 frame_turn = mat3(vec3(0.0, 1.0, 0.0), "
                                     "vec3(0.0, 0.0, 1.0), vec3(1.0, 0.0, 0.0));\n"));
}

TEST_CASE("a formula's phase is given by angles") {
  Map map = test::random_map(4, 0.001, 0.6, 5);
  map.dynamics.phase = {0, 0, 0, -1};
  CHECK_THAT(text_of(map, Program::shadertoy),
             ContainsSubstring("const vec3 Phase = vec3(90.0, 90.0, -90.0);"));
}

TEST_CASE("a map's name stays in its comment") {
  const std::string text =
      text_of(test::random_map(4, 0.001, 0.6, 5), Program::shadertoy, "a\\\n#error\r.json\\");
  CHECK_THAT(text, ContainsSubstring("// A quaternion Julia set: a??#error?.json?, 4 factors."));
}

TEST_CASE("what a formula cannot hold is refused") {
  const Map map = test::random_map(4, 0.001, 0.6, 5);
  Map with_portal = map;
  with_portal.layers.portals.emplace_back();
  Map with_paint = map;
  with_paint.layers.paint.emplace();
  for (const Program program : kPrograms) {
    CHECK_THROWS_WITH(expect_formula(quadratic_map({0, 0, 0, 0}), program),
                      ContainsSubstring("this is a quadratic map"));
    CHECK_THROWS_WITH(expect_formula(with_portal, program), ContainsSubstring("without portals"));
    CHECK_THROWS_WITH(expect_formula(with_paint, program), ContainsSubstring("without paint"));
    CHECK_NOTHROW(expect_formula(map, program));
  }
}

TEST_CASE("Shadertoy takes fewer factors than Fragmentarium") {
  const auto of = [](std::size_t count) { return test::random_map(count, 0.001, 0.6, 5); };
  CHECK_NOTHROW(expect_formula(of(formula::kMostFactorsOfShadertoy), Program::shadertoy));
  CHECK_NOTHROW(expect_formula(of(2000), Program::fragmentarium));
  CHECK_THROWS_WITH(expect_formula(of(401), Program::shadertoy),
                    ContainsSubstring("401 factors") &&
                        ContainsSubstring("--factors-at-most 400") && ContainsSubstring(".frag"));
}

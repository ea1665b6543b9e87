// Meshes, maps and targets of roughness that nobody should give.

#include "hostile.hpp"
#include "qjulia/surface/cell_mesh.hpp"
#include "qjulia/surface/roughness.hpp"
#include "qjulia/surface/roughness_target.hpp"
#include "shapes.hpp"

using namespace qjulia;
using namespace qjulia::test;

namespace {

const Device& rough_device() { return test::shared_device(); }

}  // namespace

TEST_CASE("hostile meshes and cells of roughness are refused") {
  TriangleMesh broken = shapes::sphere(1);
  broken.vertices[3].x() = kNan;
  CHECK_THROWS_AS(porosity(rough_device(), broken), InputError);
  CHECK_THROWS_AS(cell_mesh(rough_device(), broken, 32), InputError);
  CHECK_THROWS_AS(cell_mesh(rough_device(), TriangleMesh(), 32), InputError);
  CHECK_THROWS_AS(mesh_scales(rough_device(), broken), InputError);
  for (const int cells : {-1, 15, 1025}) {
    CHECK_THROWS_AS(cell_mesh(rough_device(), shapes::sphere(1), cells), OptionError);
    CHECK_THROWS_AS(mesh_scales(rough_device(), shapes::sphere(1), cells), OptionError);
  }
  CHECK_THROWS_AS(reference_of(rough_device(), broken), InputError);
  CHECK_THROWS_AS(porosity(rough_device(), TriangleMesh()), InputError);
  for (const int cells : {-1, 0, 15, 513, 1 << 30}) {
    CAPTURE(cells);
    CHECK_THROWS_AS(porosity(rough_device(), shapes::sphere(1), cells), OptionError);
  }
  for (const int cells : {-1, 0, 31, 1 << 30}) {
    CAPTURE(cells);
    const RoughnessOptions options{.resolution = cells};
    CHECK_THROWS_AS(roughness(rough_device(), good_map(), options), OptionError);
    CHECK_THROWS_AS(figures_of_set(rough_device(), good_map(), options), OptionError);
    CHECK_THROWS_AS(with_roughness(rough_device(), good_map(), {.area = 1.5, .resolution = cells}),
                    OptionError);
  }
  CHECK_THROWS_AS(roughness(rough_device(), Map(), {}), InputError);
  CHECK_THROWS_AS(figures_of_set(rough_device(), Map(), {}), InputError);
}

TEST_CASE("hostile targets of roughness are refused by name") {
  const auto refuses = [](const RoughnessTarget& target,
                          const std::optional<RoughnessReference>& reference = {}) {
    CHECK_THROWS_AS(with_roughness(rough_device(), good_map(), target, reference), InputError);
  };
  for (const double x : {kNan, kInfinity, -1.0, 0.0, 1e9}) {
    CAPTURE(x);
    refuses({.area = x});
    refuses({.dimension = x});
    refuses({.area = 1.5, .volume = x});
    if (x != 1e9) refuses({.area = 1.5, .resolution = 64}, RoughnessReference{x, 1});
  }
  refuses({});
  refuses({.volume = 1});
  refuses({.area = 1.5, .dimension = 2.2});
  CHECK(target_settings().size() == 4);
}

// Coarse meshes in place of large ones.

#include <catch2/catch_all.hpp>
#include <stop_token>

#include "mesh/coarse_mesh.hpp"
#include "qjulia/base/error.hpp"
#include "shapes.hpp"

using namespace qjulia;

TEST_CASE("a coarse mesh has the shape, and about as many triangles as it may") {
  for (const TriangleMesh& mesh :
       {shapes::sphere(6), shapes::moved(shapes::sphere(6), 1e-3, {5, 0, 0})}) {
    const auto [coarse, cell] = shape::coarse_mesh(mesh, 5000);
    CHECK(coarse.triangles.size() <= 5000);
    CHECK(coarse.triangles.size() >= 2000);
    CHECK(inspect(coarse).open_edges == 0);
    CHECK(signed_volume(coarse) == Catch::Approx(signed_volume(mesh)).epsilon(0.02));
    CHECK(cell < 0.05 * mesh.box().size().maxCoeff());
    CHECK_NOTHROW(coarse.validate());
  }
}

TEST_CASE("a sheet thinner than a cell leaves nothing open") {
  const TriangleMesh mesh =
      shapes::joined(shapes::sphere(6), shapes::inside_out(shapes::sphere(6, 0.999)));
  CHECK(inspect(shape::coarse_mesh(mesh, 1000).mesh).open_edges == 0);
}

TEST_CASE("a stop request ends the making of a coarse mesh") {
  std::stop_source stopped;
  stopped.request_stop();
  CHECK_THROWS_AS(shape::coarse_mesh(shapes::sphere(3), 100, stopped.get_token()), Interrupted);
  CHECK_THROWS_AS(shape::coarse_mesh({}, 100), InputError);
}

// What pages ask to have made.

#include <catch2/catch.hpp>

#include "explore/make_request.hpp"
#include "qjulia/error.hpp"

using namespace qjulia;
using explore::read_make;

TEST_CASE("what is to be made is read with the knobs") {
  const auto mesh = read_make({{"make", "stl"},
                               {"resolution", "96"},
                               {"millimetres", "80.5"},
                               {"detail", "0.03"},
                               {"iterations", "4"}});
  CHECK(mesh.extension == ".stl");
  CHECK(!mesh.is_turntable);
  CHECK(mesh.surface.resolution == 96);
  CHECK(mesh.surface.iterations == 4);
  CHECK(*mesh.millimetres == 80.5);
  CHECK(*mesh.view.knobs.detail == 0.03);
  const auto turntable =
      read_make({{"make", "turntable"}, {"frames", "12"}, {"size", "64x48"}, {"samples", "2"}});
  CHECK(turntable.is_turntable);
  CHECK(turntable.frames == 12);
  CHECK(turntable.view.picture.width == 64);
}

TEST_CASE("nothing else is made") {
  const explore::Query bad[] = {{},
                                {{"make", ""}},
                                {{"make", "png"}},
                                {{"make", "/../x.ply"}},
                                {{"make", "ply"}, {"make", "obj"}},
                                {{"make", "ply"}, {"resolution", "5000"}},
                                {{"make", "ply"}, {"resolution", "1e2"}},
                                {{"make", "ply"}, {"resolution", "64"}, {"resolution", "65"}},
                                {{"make", "stl"}, {"millimetres", "-1"}},
                                {{"make", "stl"}, {"millimetres", "nan"}},
                                {{"make", "turntable"}, {"frames", "1"}},
                                {{"make", "turntable"}, {"frames", "120"}, {"size", "4000x4000"}},
                                {{"make", "ply"}, {"file", "/etc/passwd"}}};
  for (const auto& query : bad) CHECK_THROWS_AS(read_make(query), InputError);
}

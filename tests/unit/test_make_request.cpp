// What pages ask to have made.

#include <Eigen/Geometry>
#include <catch2/catch_all.hpp>

#include "base/file_types.hpp"
#include "explore/request.hpp"
#include "qjulia/base/error.hpp"

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
  CHECK(mesh.resolution == 96);
  CHECK(mesh.view.picture.iterations == 4);
  CHECK(*mesh.millimetres == 80.5);
  CHECK(*mesh.view.knobs.detail == 0.03);
  const auto turntable =
      read_make({{"make", "turntable"}, {"frames", "12"}, {"size", "64x48"}, {"samples", "2"}});
  CHECK(turntable.is_turntable);
  CHECK(turntable.frames == 12);
  CHECK(turntable.view.picture.width == 64);
}

TEST_CASE("places in a picture are shares of its sides") {
  const auto at = [](const std::string& text) { return explore::read_view({{"at", text}}).at; };
  CHECK(at("0.25,1") == Eigen::Vector2d(0.25, 1));
  for (const char* text : {"1.1,0", "0,-0.1", "0.5", "0.5,0.5,0.5", "nan,0", "x"}) {
    CAPTURE(text);
    CHECK_THROWS_AS(at(text), InputError);
  }
  CHECK(explore::read_view({{"apart", "1"}}).is_apart);
  CHECK_THROWS_AS(explore::read_view({{"apart", "2"}}), InputError);
}

TEST_CASE("drafts of all sizes have one studio, whole pictures one a size") {
  const auto text = [](const std::string& size, const std::string& azimuth, bool is_draft) {
    explore::Query query{{"size", size}, {"azimuth", azimuth}, {"detail", "0.03"}};
    if (is_draft) query.insert({"draft", "1"});
    return explore::read_view(query).studio_text;
  };
  CHECK(text("160x120", "0", true) == text("400x300", "10", true));
  CHECK(text("160x120", "0", false) == text("160x120", "10", false));
  CHECK(text("160x120", "0", false) != text("400x300", "0", false));
  CHECK(text("160x120", "0", false) != text("160x120", "0", true));
}

TEST_CASE("other settings of a request override its look, which is no file") {
  const auto picture =
      explore::read_view({{"look", "jade"}, {"lamp", "10,20,1;5,6,7,3200K"}, {"coat", "0.25"}})
          .picture;
  CHECK(picture.look == "jade");
  CHECK(picture.matter.wax > 0.5);
  CHECK(picture.matter.coat == 0.25);
  CHECK(picture.light.lamps == std::vector{lamp_from("10,20,1"), lamp_from("5,6,7,3200K")});
  CHECK_FALSE(explore::read_view({{"exposure", "auto"}}).picture.exposure);
  CHECK(explore::read_view({{"exposure", "-1.5"}}).picture.exposure == -1.5);
  CHECK_THROWS_WITH(explore::read_view({{"look", "/tmp/a.toml"}}),
                    Catch::Matchers::ContainsSubstring("no look '/tmp/a.toml'"));
  CHECK(explore::read_view({{"environment", "evening"}, {"environment-turn", "40"}})
            .picture.light.environment == "evening");
  CHECK_THROWS_WITH(explore::read_view({{"environment", "/tmp/a.hdr"}}),
                    Catch::Matchers::ContainsSubstring("environment: give one of evening"));
  CHECK_THROWS_WITH(explore::read_view({{"lamp", "1,2"}}),
                    Catch::Matchers::ContainsSubstring("lamp: '1,2' is no lamp"));
}

TEST_CASE("what cannot be used is named, with what to give") {
  using Catch::Matchers::ContainsSubstring;
  using explore::read_view;
  for (const char* size : {"0x0", "-1x-1", "16x", "16"}) {
    CHECK_THROWS_WITH(read_view({{"size", size}}),
                      ContainsSubstring("is not WIDTHxHEIGHT in pixels"));
  }
  CHECK_THROWS_WITH(read_view({{"size", "16385x1"}}),
                    ContainsSubstring("size: give sides of 1 to 16384"));
  CHECK_THROWS_WITH(read_view({{"samples", "0"}}), "samples: give 1 to 4");
  for (const char* detail : {"1", "0.11", "0.00009", "0", "-1"}) {
    CHECK_THROWS_WITH(read_view({{"detail", detail}}),
                      ContainsSubstring("detail: ") && ContainsSubstring("give 0.0001 to 0.1"));
  }
  CHECK(*read_view({{"detail", "0.1"}}).knobs.detail == 0.1);
  CHECK(read_view({{"steady", "1"}}).is_steady);
  CHECK(*read_view({{"distance", "3.5"}}).picture.camera.distance == 3.5);
  CHECK_THROWS_WITH(read_view({{"draft", "7"}}), "draft: '7' cannot be used; give 0 or 1");
  CHECK_THROWS_WITH(read_view({{"zoom", "far"}}), "zoom: 'far' cannot be used; give a number");
  CHECK_THROWS_WITH(read_view({{"order-seed", "-1"}}),
                    ContainsSubstring("give a whole number that is not"));
  for (const std::string& type : base::extensions(base::FileContent::mesh, base::FileUse::write)) {
    CHECK(read_make({{"make", type.substr(1)}}).extension == type);
    CHECK_THROWS_WITH(read_make({{"make", "jpg"}}), ContainsSubstring("make: give one of") &&
                                                        ContainsSubstring(type.substr(1) + ","));
  }
  CHECK_THROWS_WITH(read_make({{"make", "ply"}, {"length", "1"}}),
                    ContainsSubstring("a request has an unknown name; it takes frames, make"));
  CHECK_THROWS_WITH(read_make({{"make", "ply"}, {"resolution", "x"}}),
                    "resolution: 'x' cannot be used; give a whole number");
}

TEST_CASE("nothing else is made") {
  const explore::Query bad[] = {{},
                                {{"make", ""}},
                                {{"make", "jpg"}},
                                {{"make", "/../x.ply"}},
                                {{"make", "ply"}, {"make", "obj"}},
                                {{"make", "ply"}, {"resolution", "5000"}},
                                {{"make", "ply"}, {"resolution", "1e2"}},
                                {{"make", "ply"}, {"resolution", "64"}, {"resolution", "65"}},
                                {{"make", "stl"}, {"millimetres", "-1"}},
                                {{"make", "stl"}, {"cut", "z=50%"}},
                                {{"make", "3mf"}, {"cut", "z=50%"}},
                                {{"make", "stl"}, {"millimetres", "nan"}},
                                {{"make", "turntable"}, {"frames", "1"}},
                                {{"make", "turntable"}, {"frames", "120"}, {"size", "4000x4000"}},
                                {{"make", "ply"}, {"file", "/etc/passwd"}}};
  for (const auto& query : bad) CHECK_THROWS_AS(read_make(query), InputError);
}

TEST_CASE("a brush has places, a width and a share, or plants one copy") {
  const auto stroke = explore::read_brush(
      {{"places", "0.25,1;0.5,0.5"}, {"radius", "0.2"}, {"share", "0.5"}, {"drift", "0.1"}});
  CHECK(stroke.places == std::vector<Eigen::Vector2d>{{0.25, 1}, {0.5, 0.5}});
  CHECK(stroke.radius == 0.2);
  CHECK(stroke.share == 0.5);
  CHECK(!stroke.copy);
  CHECK(stroke.view.knobs.drift == 0.1);
  CHECK(explore::read_brush({}).places.empty());
  CHECK(explore::read_brush({{"places", "0,0"}, {"copy", "0.2"}}).copy == 0.2);
  const auto refuses = [](const explore::Query& query, const char* named) {
    CAPTURE(named);
    CHECK_THROWS_WITH(explore::read_brush(query), Catch::Matchers::StartsWith(named));
  };
  refuses({{"places", "0.5"}}, "places: give 2 numbers");
  refuses({{"places", "0,0;"}}, "places");
  refuses({{"places", "2,0"}}, "places: give shares");
  std::string many = "0,0";
  for (std::size_t i = 0; i < explore::BrushRequest::kMostPlaces; ++i) many += ";0,0";
  refuses({{"places", many}}, "places: give at most 256");
  refuses({{"radius", "0"}}, "radius");
  refuses({{"share", "-0.1"}}, "share");
  refuses({{"copy", "x"}}, "copy");
  refuses({{"copy", "0.2"}}, "places: give exactly one place");
  refuses({{"copy", "0.2"}, {"places", "0,0;1,1"}}, "places: give exactly one place");
  refuses({{"zzz", "1"}}, "a request has an unknown name; it takes copy, places, radius, share");
}

// Lamps, their colours and rigs, tone curves, and looks: what of them needs no device.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "picture/lights.hpp"
#include "picture/reflectance.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/picture/look.hpp"
#include "qjulia/picture/picture_settings.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

TEST_CASE("colours of light are temperatures or colours, and their texts mean the same again") {
  CHECK(light_color_from("6500K").linear().isApprox(Rgb::Ones(), 1e-12));
  const Rgb candle = light_color_from("1900K").linear(), sky = light_color_from("12000K").linear();
  CHECK(candle.x() == 1);
  CHECK(candle.x() > 2 * candle.y());
  CHECK(candle.y() > 2 * candle.z());
  CHECK(sky.z() == 1);
  CHECK(sky.x() < sky.y());
  // Continuous where one cubic ends and the next begins.
  for (const double kelvin : {2222.0, 4000.0}) {
    const Rgb below = LightColor{kelvin - 0.5, {}}.linear(),
              above = LightColor{kelvin + 0.5, {}}.linear();
    CHECK((below - above).norm() < 2e-3);
  }
  CHECK(light_color_from("ff8000").linear() == color_named("ff8000").value());
  for (const char* text : {"3200K", "#ff8000"}) CHECK(to_string(light_color_from(text)) == text);
  CHECK_THROWS_WITH(light_color_from("900K"), ContainsSubstring("1700K to 25000K"));
  CHECK_THROWS_WITH(light_color_from("warm"), ContainsSubstring("'warm' is no colour of light"));
}

TEST_CASE("a lamp's text has three to five values") {
  const Lamp lamp = lamp_from("-60,40.5,1.2,3200K,5");
  CHECK(lamp == Lamp{-60, 40.5, 1.2, {3200, Rgb::Ones()}, 5});
  CHECK(lamp_from(to_string(lamp)) == lamp);
  CHECK(lamp_from("10,20,2") == Lamp{10, 20, 2});
  for (const char* text :
       {"", "1,2", "1,2,3,4", "1,2,3,3200K,4,5", "a,2,3", "1,2,inf", "1,2,3,3200K,x"}) {
    CAPTURE(text);
    CHECK_THROWS_AS(lamp_from(text), InputError);
  }
  Lighting light;
  light.lamps = {lamp_from("0,91,1")};
  CHECK_THROWS_WITH(light.validate(), ContainsSubstring("lamp: 91"));
  light.lamps.assign(9, Lamp{});
  CHECK_THROWS_WITH(light.validate(), ContainsSubstring("lamp: 9 are given; give 8 at most"));
}

TEST_CASE("lamps that are given stand in place of a rig's, one by one") {
  const Rig studio = rig_named(RigName::studio);
  Lighting light;
  CHECK(light.whole().lamps == studio.lamps);
  const Lamp given = lamp_from("5,6,7");
  light.lamps = {given};
  REQUIRE(light.whole().lamps.size() == studio.lamps.size());
  CHECK(light.whole().lamps[0] == given);
  CHECK(light.whole().lamps[1] == studio.lamps[1]);
  light.lamps = {given, lamp_from("0,0,0"), lamp_from("1,2,3")};
  CHECK(light.whole().lamps == std::vector<Lamp>{given, lamp_from("1,2,3")});
  light.fill = 0;
  CHECK(light.whole().fill == 0);
  for (const auto name : {RigName::studio, RigName::rim, RigName::low_key, RigName::noon,
                          RigName::dusk, RigName::museum}) {
    CHECK_NOTHROW(Lighting{.lamps = rig_named(name).lamps}.validate());
  }
  CHECK(picture::wall_light(studio).isApprox(Rgb::Ones(), 1e-12));
}

TEST_CASE("the neutral curve keeps colours up to its shoulder, and takes the brightest to white") {
  // Khronos PBR Neutral: less 4 %, which a surface reflects at normal incidence, nothing changes.
  const Rgb middle(0.5, 0.3, 0.1);
  CHECK((tone_mapped(ToneCurve::neutral, middle) - (middle.array() - 0.04).matrix()).norm() <
        1e-12);
  CHECK(tone_mapped(ToneCurve::neutral, Rgb::Constant(0.8)).isApprox(Rgb::Constant(0.76), 1e-12));
  // A single bright channel: p = 10 gives 1 − .24² / (9.96 + .24 − .76), less saturated.
  const Rgb red = tone_mapped(ToneCurve::neutral, Rgb(10, 0, 0));
  const double peak = 1 - 0.24 * 0.24 / (10 + 0.24 - 0.76);
  CHECK(red.x() == Catch::Approx(peak));
  CHECK(red.y() == Catch::Approx(peak * (1 - 1 / (0.15 * (10 - peak) + 1))));
  for (const auto curve : {ToneCurve::neutral, ToneCurve::agx, ToneCurve::aces, ToneCurve::none}) {
    double last = 0;
    for (double x = 0; x < 50; x = 1.1 * x + 0.01) {
      const Rgb grey = tone_mapped(curve, Rgb::Constant(x));
      CHECK(grey.maxCoeff() <= 1);
      CHECK(grey.minCoeff() >= last - 1e-9);
      CHECK(grey.maxCoeff() - grey.minCoeff() < 2e-3);
      last = grey.minCoeff();
    }
    CHECK(last > 0.95);
  }
  // AgX: middle grey, 18 %, stays near the middle of the screen's values.
  CHECK(std::pow(tone_mapped(ToneCurve::agx, Rgb::Constant(0.18)).x(), 1 / 2.2) ==
        Catch::Approx(0.5).margin(0.05));
}

TEST_CASE("rough surfaces reflect less at once, smooth ones all") {
  const auto& table = picture::reflectance_table();
  constexpr std::size_t kSide = 32;
  const auto sum = [&](std::size_t column, std::size_t row) {
    return table[2 * (row * kSide + column)] + table[2 * (row * kSide + column) + 1];
  };
  REQUIRE(table.size() == 2 * kSide * kSide);
  CHECK(sum(kSide - 1, 0) == Catch::Approx(1).margin(0.01));
  CHECK(sum(kSide / 2, 0) == Catch::Approx(1).margin(0.01));
  CHECK(sum(kSide - 1, kSide - 1) < 0.7);
  for (const float share : table) CHECK((share >= 0 && share <= 1.01F));
}

TEST_CASE("every built-in look says what it is, and can be drawn") {
  const auto names = look_names();
  CHECK(names.size() >= 16);
  for (const std::string& name : names) {
    CAPTURE(name);
    CHECK_FALSE(look_description(name).empty());
    PictureOptions options;
    CHECK_NOTHROW(apply_look(options, name));
    CHECK_NOTHROW(options.validate());
    CHECK(options.look == name);
  }
  PictureOptions options;
  CHECK_THROWS_WITH(apply_look(options, "golden"),
                    ContainsSubstring("no look 'golden'") && ContainsSubstring("gold"));
  CHECK_THROWS_AS(apply_built_in_look(options, "a.toml"), InputError);
}

TEST_CASE("a look sets what it says and leaves the rest") {
  const test::TemporaryFolder folder;
  PictureOptions options;
  options.exposure = 2;
  options.camera.zoom = 3;
  const auto file =
      folder.file("mine.toml",
                  "palette = [\"000000\", \"ffffff\"]\nmaterial = \"trap\"\n"
                  "metal = 0.5\nlight = \"dusk\"\nlamp = [\"1,2,3,4000K,5\", \"6,7,8\"]\n"
                  "fill = 0.25\nbackground = \"102030\"\nground = false\n"
                  "tone = \"agx\"\nfill_color = \"9000K\"\n");
  apply_look(options, file.string());
  CHECK(options.material == Material::trap);
  CHECK(options.palette.stops.size() == 2);
  CHECK(options.matter.metal == 0.5);
  CHECK(options.light.rig == RigName::dusk);
  CHECK(options.light.lamps == std::vector{lamp_from("1,2,3,4000K,5"), lamp_from("6,7,8")});
  CHECK(options.light.fill == 0.25);
  CHECK(options.light.fill_color == light_color_from("9000K"));
  CHECK(options.background == background_from("102030"));
  CHECK_FALSE(options.ground);
  CHECK(options.tone == ToneCurve::agx);
  CHECK(options.exposure == 2);
  CHECK(options.camera.zoom == 3);
  apply_look(options, folder.file("out.toml", "environment = \"sky.hdr\"").string());
  CHECK(options.light.environment == folder / "sky.hdr");
  apply_look(options, folder.file("in.toml", "environment = \"evening\"").string());
  CHECK(options.light.environment == "evening");
  apply_look(options, folder.file("auto.toml", "exposure = \"auto\"").string());
  CHECK_FALSE(options.exposure);
}

TEST_CASE("what is wrong in a look is named with its line, and nothing is set") {
  const test::TemporaryFolder folder;
  const auto refuses = [&](const char* text, const char* message) {
    CAPTURE(text);
    PictureOptions options;
    CHECK_THROWS_WITH(apply_look(options, folder.file("bad.toml", text).string()),
                      ContainsSubstring("bad.toml:") && ContainsSubstring(message));
    CHECK(options.matter.metal == 0);
    CHECK(options.look.empty());
  };
  refuses("metal = 1\nshine = 2", ":2: shine: it is not known here; a look has");
  refuses("metal = 1\nzoom = 2", ":2: zoom: it is not known here");
  refuses("metal = 2", ":1: metal: 2 is out of range; give 0 to 1");
  refuses("metal = \"much\"", ":1: metal: give a number");
  refuses("metal = 1\nlamp = [\"1,2\"]", ":2: lamp: '1,2' is no lamp");
  refuses("metal = 1\nlamp = [3]", ":2: lamp: '' is no lamp");
  refuses("metal = 1\npalette = [\"000000\"]\nmaterial = \"trap\"", ":2: palette: 1 given");
  refuses("metal = 1\nlight = \"sun\"", ":2: light: 'sun' is not known");
  refuses("metal = 1\nground = 3", ":2: ground: give true or false");
  refuses("metal = 1\nbackground = \"\"", ":2: background: '' is no background");
  refuses("metal = ", "not TOML");
  CHECK_THROWS_WITH(
      [&] {
        PictureOptions o;
        apply_look(o, folder / "absent.toml");
      }(),
      ContainsSubstring("absent.toml"));
}

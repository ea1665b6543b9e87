/// Tables of settings: what each says agrees with what its struct has, and every door reads and
/// shows the same values.

#include <catch2/catch_all.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "base/setting_json.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/edit/paint_settings.hpp"
#include "qjulia/edit/portal_settings.hpp"
#include "qjulia/exact/exact_settings.hpp"
#include "qjulia/fit/fit_settings.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/map/sample_settings.hpp"
#include "qjulia/picture/picture_settings.hpp"
#include "qjulia/surface/compare_settings.hpp"
#include "qjulia/surface/print_settings.hpp"
#include "qjulia/surface/selection.hpp"
#include "qjulia/surface/surface_settings.hpp"

using namespace qjulia;

namespace {

/// Checks the names and sentences of a table, and that its usual values are in their ranges.
template <class Table, class Options>
void check_table(const Table& table, Options usual) {
  std::set<std::string> names;
  for (const auto& setting : table) {
    CAPTURE(setting.name);
    CHECK(names.insert(setting.name).second);
    CHECK_FALSE(setting.help.empty());
    CHECK(setting.help.back() != '.');
    CHECK(setting.least < setting.most);
    const ValuePlace place = setting.place(usual);
    CHECK_NOTHROW(expect_in_range(setting, place));
    const bool is_flag = std::holds_alternative<bool*>(place);
    CHECK(setting.values_text().empty() == is_flag);
    CHECK(setting.example.words().empty() == is_flag);
    CHECK(std::holds_alternative<WordPlace>(place) == !setting.words.empty());
  }
}

}  // namespace

TEST_CASE("tables of settings describe what their structs have") {
  check_table(fit_settings(), FitOptions{});
  check_table(exact_settings(), ExactMapOptions{});
  check_table(knob_table(), MapKnobs{});
  check_table(picture_settings(), PictureOptions{});
  check_table(portal_settings(), PortalOptions{});
  check_table(print_settings(), PrintOptions{});
  check_table(surface_settings(), SurfaceOptions{});
  check_table(selection_settings(), Selection{});
  check_table(sample_settings(), SampleOptions{});
  check_table(compare_settings(), CompareOptions{});
  check_table(paint_settings(), PaintOptions{});
}

TEST_CASE("words stand for the values of enumerations") {
  FitOptions options;
  const auto is_word = [&](const char* name, const char* word, auto& value, auto meant) {
    CAPTURE(name, word);
    const FitSetting& setting = fit_setting_named(name);
    std::get<WordPlace>(setting.place(options)).set(setting.index_of(word));
    CHECK(value == meant);
    CHECK(base::value_json(setting, setting.place(options)) == word);
  };
  is_word("unknowns", "exponents", options.unknowns, Unknowns::exponents);
  is_word("unknowns", "all", options.unknowns, Unknowns::all);
  is_word("placement", "paper", options.placement, Placement::paper);
  is_word("placement", "depth", options.placement, Placement::depth);
  is_word("precision", "double", options.precision, Precision::dbl);
  is_word("precision", "single", options.precision, Precision::single);
  CHECK_THROWS_WITH(fit_setting_named("unknowns").index_of("some"),
                    "'some' is not known; give one of: exponents, all");
  // The words of a material and a mask are their own.
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(picture_setting_named("material").words.at(i) == to_string(static_cast<Material>(i)));
  }
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(setting_named(portal_settings(), "mask", "portals").words.at(i) ==
          word_of(static_cast<PortalMask>(i)));
  }
}

TEST_CASE("settings as JSON") {
  FitOptions options;
  nlohmann::json all;
  base::add_json(all, fit_settings(), options);
  CHECK(all.at("factors") == "auto");
  CHECK(all.at("up") == "auto");
  CHECK(all.at("detail") == "auto");
  CHECK(all.at("time_limit").is_null());
  CHECK(all.at("max_factors").is_null());
  CHECK(all.at("polish") == false);
  options.factors = 12;
  options.up = UpAxis::minus_z;
  options.detail = 0.25;
  options.time_limit = std::numeric_limits<double>::infinity();
  base::add_json(all, fit_settings(), options);
  CHECK(all.at("factors") == 12);
  CHECK(all.at("up") == "-z");
  CHECK(all.at("detail") == 0.25);
  CHECK(all.at("time_limit").is_null());

  MapKnobs knobs;
  knobs.phase = Quaternion{0.8, 0.6, 0, 0};
  knobs.rotate = Rotation{{0, 1, 0}, 90};
  knobs.translate = Eigen::Vector3d(1, 2, 3);
  base::add_json(all, knob_table(), knobs);
  CHECK(all.at("phase") == nlohmann::json({0.8, 0.6, 0.0, 0.0}));
  CHECK(all.at("rotate") == nlohmann::json({0.0, 1.0, 0.0, 90.0}));
  CHECK(all.at("translate") == nlohmann::json({1.0, 2.0, 3.0}));
  CHECK(all.at("order_seed").is_null());
}

TEST_CASE("ranges in words, and values out of them by name") {
  CHECK(fit_setting_named("factors").range_text() == "8 to 20000");
  CHECK(fit_setting_named("time_limit").range_text() == "more than 0");
  CHECK(fit_setting_named("target_iou").range_text() == "a number above 0, up to 1");
  CHECK(fit_setting_named("max_evaluations").range_text() == "1 or more");
  CHECK(picture_setting_named("azimuth").range_text() == "any finite number");
  FitOptions options;
  options.target_iou = 0;
  CHECK_THROWS_WITH(options.validate(),
                    "target_iou: 0 is out of range; give a number above 0, up to 1");
  options = {};
  options.factors = 100;
  options.max_factors = 200;
  CHECK_THROWS_WITH(options.validate(), Catch::Matchers::StartsWith("max_factors: it bounds"));
}

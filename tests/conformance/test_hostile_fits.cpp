// Numbers and counts that nobody should give to fits, exact maps, paint and portals.

#include "hostile.hpp"
#include "shapes.hpp"

using namespace qjulia;
using namespace qjulia::test;

namespace {

const Device& fit_device() { return test::shared_device(); }

Portal scaled_portal(double scale) {
  Portal portal;
  portal.scale = scale;
  return portal;
}

}  // namespace

TEST_CASE("hostile numbers of fits and exact maps are refused by name") {
  const TriangleMesh mesh = shapes::sphere(1);
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Eigen::Vector3d v(x, 0, 0);
    const auto option = [&](bool is_valid, const char* named, const auto& change) {
      takes(is_valid, "fit", named,
            [&] { fit(fit_device(), mesh, changed(small_fit(), change)).map.validate(); });
    };
    option(is_within(x, 1e-4, 0.1), "detail", [&](auto& o) { o.detail = x; });
    option(is_within(x, 1, 100), "steepness", [&](auto& o) { o.steepness = x; });
    option(x > 0, "time_limit", [&](auto& o) { o.time_limit = x; });
    option(x > 0 && x <= 1, "target_iou", [&](auto& o) { o.target_iou = x; });
    takes(x > 0, "expect_in_ranges", "time_limit", [&] {
      const FitOptions options = changed(FitOptions{}, [&](auto& o) { o.time_limit = x; });
      CHECK((options.most_seconds() == x || std::isnan(x)));
      expect_in_ranges(fit_settings(), options);
    });
    const auto exact = [&](bool is_valid, const char* named, const auto& change) {
      takes(is_valid, "exact_map", named,
            [&] { exact_map(fit_device(), mesh, changed(small_exact(), change)).validate(); });
    };
    exact(is_within(x, 1e-4, 0.1), "detail", [&](auto& o) { o.detail = x; });
    exact(is_within(x, 1, 100), "steepness", [&](auto& o) { o.steepness = x; });
    exact(x == -1, "phase", [&](auto& o) { o.phase = {x, 0, 0, 0}; });
    exact(is_near(x), "factors[0].exponent", [&](auto& o) {
      o.versor = FactorsOfMap{{{{0.5, 0, 0, 0}, x}}, {1, {0, 0, 0}}};
    });
    exact(is_near(x), "factors[0].center", [&](auto& o) {
      o.versor = FactorsOfMap{{{{x, 0, 0, 0}, 2}}, {1, {0, 0, 0}}};
    });
    exact(is_within(x, 1e-3, 1e4), "noise.scale", [&](auto& o) {
      NoiseVersor noise;
      noise.scale = x;
      o.versor = noise;
    });
    exact(is_near(x), "noise.origin", [&](auto& o) {
      NoiseVersor noise;
      noise.origin = v;
      o.versor = noise;
    });
    accepts("chosen_detail", [&] {
      const double chosen = chosen_detail(DetailWord::wild, {x, 0.7}, kFittedRule);
      return is_within(chosen, 0, 1) || !(x >= 0);  // no shape has a negative spread
    });
    accepts("to_string", [&] { return !to_string(DetailChoice(x)).empty(); });
  }
}

TEST_CASE("hostile counts of fits and exact maps are refused by name") {
  for (const int n : kHostileCounts) {
    CAPTURE(n);
    const auto option = [&](bool is_valid, const char* named, const auto& change) {
      takes(is_valid, "FitOptions", named, [&] { changed(FitOptions{}, change).validate(); });
    };
    option(is_within(n, 8, 20'000), "factors", [&](auto& o) { o.factors = n; });
    option(is_within(n, 8, 20'000), "max_factors", [&](auto& o) { o.max_factors = n; });
    option(n > 0, "max_evaluations", [&](auto& o) { o.max_evaluations = n; });
    option(is_within(n, 1, 1024), "sample_parts", [&](auto& o) { o.sample_parts = n; });
    const auto exact = [&](bool is_valid, const char* named, const auto& change) {
      takes(is_valid, "ExactMapOptions", named, [&] { changed(small_exact(), change).validate(); });
    };
    exact(is_within(n, 32, 384), "resolution", [&](auto& o) { o.resolution = n; });
    exact(is_within(n, 1, 1000), "roots", [&](auto& o) { o.versor = RandomRoots{.roots = n}; });
    takes(is_within(n, 1, 8), "NoiseVersor", "noise.octaves",
          [&] { NoiseVersor{.octaves = n}.validate(); });
    takes(is_within(n, 1, 16), "PortalOptions", "count",
          [&] { PortalOptions{.count = n}.validate(); });
    Material material = Material::clay;
    const WordPlace word(material);
    accepts("WordPlace", [&] {  // whoever sets a word has it from the table
      word.set(static_cast<std::size_t>(std::min(n, 1) + 1) % 2);
      return word.index() < 2;
    });
    refuses("DistanceGrid", "distance.cells", [&] {
      DistanceGrid({.cells = {n, n, n}, .coarse = {1}, .blocks = {7}, .corrections = {}});
    });
    takes(is_within(n, 0, 255), "Ranks", "where a byte was expected",
          [&] { Ranks::bytes_of({static_cast<double>(n)}); });
    accepts("numbers_of", [&] {
      const std::string bytes(3, static_cast<char>(n));
      return Ranks::bytes_of(Ranks::numbers_of(bytes)) == bytes;
    });
  }
  accepts("summaries", [] { return brief_summary({}).size() <= full_summary({}).size(); });
}

TEST_CASE("hostile numbers of paint and portals are refused by name") {
  const Map map = good_map();
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Eigen::Vector3d v(x, 0, 0);
    const bool is_share = is_within(x, 0, 1);
    const auto paints = [&](bool is_valid, const char* named, const auto& change) {
      takes(is_valid, "painted", named,
            [&] { painted(fit_device(), map, changed(PaintOptions{}, change)).validate(); });
    };
    paints(std::isfinite(x), "balls", [&](auto& o) { o.balls = {{v, 1, 0.5}}; });
    paints(is_positive(x), "balls", [&](auto& o) { o.balls = {{{0, 0, 0}, x, 0.5}}; });
    paints(is_share, "balls", [&](auto& o) { o.balls = {{{0, 0, 0}, 1, x}}; });
    takes(is_positive(x), "painted_over", "balls", [&] {
      painted_over(map, {{{0, 0, 0}, x, 0.5}}).validate();
    });
    paints(std::isfinite(x) && x < 1, "blocks", [&](auto& o) {
      o.blocks = {{Box{{x, x, x}, {1, 1, 1}}, 0.5}};
    });
    paints(is_share, "blocks", [&](auto& o) { o.blocks = {{Box{{0, 0, 0}, {1, 1, 1}}, x}}; });
    paints(is_within(x, 0.01, 2), "thickness", [&](auto& o) { o.thickness = x; });
    paints(is_share, "elsewhere", [&](auto& o) { o.elsewhere = x; });
    paints(is_share, "ramp", [&](auto& o) { o.ramp = PaintRamp{1, x, 1}; });
    paints(is_share, "ramp", [&](auto& o) { o.ramp = PaintRamp{1, 0, x}; });
    paints(false, std::isfinite(x) ? "triangles[0]" : "vertices[0]", [&](auto& o) {
      o.mesh = PaintedMesh{{v, v, v}, {{0, 1, 9}}, {0, 0, 0}};
    });
    paints(false, "ramp", [&](auto& o) { o.ramp = PaintRamp{7, 0, 1}; });
    takes(!std::isnan(x), "painted_share", "a share of the detail is not a number",
          [&] { painted_share(x); });
    const Paint paint{.cells = {4, 4, 4}, .step = 1, .shares = std::vector<std::uint8_t>(64)};
    takes(std::isfinite(x), "Paint", "a place that is not finite",
          [&] { return is_within(paint.at(v), 0, 1); });
    accepts("center", [&] { return paint.center(-1, 99, 0).allFinite(); });
    takes(is_within(x, 0.02, 0.6), "proposed_portals", "size", [&] {
      PortalOptions options;
      options.size = x;
      proposed_portals(fit_device(), map, options);
    });
    takes(is_within(x, 0.02, 0.6), "planted_portals", "size", [&] {
      planted_portals(fit_device(), map, {0, 0, 0}, x);
    });
    if (!std::isfinite(x)) {
      takes(false, "planted_portals", "place", [&] { planted_portals(fit_device(), map, v, 0.2); });
    }
    for (const double scale : {x, 1 + 1e-16 * x}) {
      accepts("visible_depth",
              [&] { return is_within(visible_depth({scaled_portal(scale)}), 0, 1000); });
    }
    for (const SettingOf<PortalOptions>& setting : portal_settings()) {
      PortalOptions options;
      options.size = x;
      const bool is_valid = setting.name != "size" || is_within(x, 0.02, 0.6);
      takes(is_valid, "expect_in_range", "size",
            [&] { expect_in_range(setting, setting.place(options)); });
      CHECK_FALSE(setting.values_text().empty());
    }
    takes(std::isfinite(x), "portals_from_text", "is not finite", [&] {
      const auto portals = original::portals_from_text(
          "Portals radius: 1\nPortals scale: 2\nPortal location: 1 2 3\n", "a text", {x, v});
      return portals.size() == 1;
    });
  }
}

// Maps that nobody should give, and numbers that no map or knob has.

#include <algorithm>
#include <filesystem>
#include <set>

#include "check/label_check.hpp"
#include "distance_map.hpp"
#include "hostile.hpp"
#include "qjulia/map/opencl.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using namespace qjulia::test;

namespace {

const Device& map_device() { return test::shared_device(); }

struct NamedMap {
  std::string name;
  Map map;
};

Portal portal_at(const Eigen::Vector3d& center, double radius) {
  Portal portal;
  portal.center = center;
  portal.radius = radius;
  return portal;
}

/// Maps that every function refuses.
std::vector<NamedMap> broken_maps() {
  const auto with = [](const auto& change) { return changed(good_map(), change); };
  std::vector<NamedMap> maps{
      {"no factors", {}},
      {"exponent", with([](auto& m) { m.dynamics.factors[1].exponent = kNan; })},
      {"center", with([](auto& m) { m.dynamics.factors[0].center.w = kInfinity; })},
      {"far center", with([](auto& m) { m.dynamics.factors[0].center.x = kHuge; })},
      {"log scale", with([](auto& m) { m.dynamics.log_scale = -kInfinity; })},
      {"level", with([](auto& m) { m.dynamics.surface_level = kNan; })},
      {"slice", with([](auto& m) { m.dynamics.slice = kHuge; })},
      {"steepness", with([](auto& m) { m.layers.steepness = 0; })},
      {"phase", with([](auto& m) { m.dynamics.phase = {}; })},
      {"scale", with([](auto& m) { m.frame.shape_to_map.scale = 0; })},
      {"translation", with([](auto& m) { m.frame.shape_to_map.translation = kNowhere; })},
      {"detail", with([](auto& m) { m.frame.detail = -1; })},
      {"diagonal", with([](auto& m) { m.frame.diagonal = 0; })},
      {"inradius", with([](auto& m) { m.frame.inradius = kNan; })},
      {"box", with([](auto& m) {
         m.frame.box = Box{{1, 1, 1}, {-1, -1, -1}};
       })},
      {"empty box", with([](auto& m) { m.frame.box = Box{}; })},
      {"no grid", with([](auto& m) { m.dynamics.modulus = DistanceModulus{}; })},
      {"noise", with([](auto& m) {
         m.dynamics.modulus = QuadraticModulus{};
         m.dynamics.versor = NoiseVersor{.octaves = -1};
         m.dynamics.factors.clear();
       })},
      {"paint", with([](auto& m) { m.layers.paint.emplace(); })},
      {"paint's cells", with([](auto& m) {
         m.layers.paint = Paint{.cells = {64, 64, 64}, .step = 1, .shares = {1}};
       })},
      {"portal", with([](auto& m) { m.layers.portals.emplace_back(); })},
      {"portals", with([](auto& m) {
         m.layers.portals.assign(100, portal_at({2, 0, 0}, 0.1));
       })},
      {"portal's axis", with([](auto& m) {
         m.layers.portals = {portal_at({2, 0, 0}, 0.1)};
         m.layers.portals[0].rotation.axis = kNowhere;
       })}};
  Map without_shell = test::distance_map();
  std::get<DistanceModulus>(without_shell.dynamics.modulus).shell = 0;
  maps.push_back({"no shell", without_shell});
  return maps;
}

/// What functions need of a map.
enum class Has {
  nothing,
  bounds,     ///< orbits far out escape: the level is no larger than doubles' exponents
  factors,    ///< unknowns that a fit may start from
  gradient,   ///< a field that changes about the origin, and coordinates that kernels take
  origin,     ///< the origin is inside the shape
  surface,    ///< the set has a surface in its box
  shape,      ///< the map holds its shape's box
  detail,     ///< positive exponents, with room for others
  own_shape,  ///< at n = 1 the set is not empty, and its detail is known
  room,       ///< a place for a copy beside the shape
  steeper,    ///< room for twice as large exponents, and their scale
  slope,      ///< a field that is not flat at the shape
  scale,      ///< room for another size of the shape
};

/// Whether single precision holds exponent times angle well enough for its sine.
bool is_factor_small(const Map& map) {
  return std::ranges::all_of(map.dynamics.factors,
                             [](const Factor& factor) { return std::abs(factor.exponent) < 1e3; });
}

struct OddMap : NamedMap {
  std::set<Has> lacks;
};

/// Maps that are valid but useless.
std::vector<OddMap> odd_maps() {
  using enum Has;
  const auto odd = [](const char* name, const auto& change, std::set<Has> lacks) {
    return OddMap{{name, changed(good_map(), change)}, std::move(lacks)};
  };
  const auto exponents = [](double each) {
    return [=](auto& m) {
      for (auto& factor : m.dynamics.factors) factor.exponent = each;
    };
  };
  return {
      odd("no exponents", exponents(0), {gradient, surface, detail, own_shape, slope}),
      odd("poles", exponents(-1), {detail, own_shape, room}),
      odd("centers at the origin",
          [](auto& m) {
            for (auto& factor : m.dynamics.factors) factor.center = {};
          },
          {}),
      odd("steep", [](auto& m) { m.dynamics.factors[0].exponent = 1e15; },
          {detail, steeper, own_shape}),
      odd("all inside", [](auto& m) { m.dynamics.surface_level = 1e15; },
          {bounds, gradient, surface, own_shape, room, steeper, origin, detail}),
      odd("all outside", [](auto& m) { m.dynamics.log_scale = 1e15; },
          {origin, own_shape, room, steeper, detail}),
      odd("flat box",
          [](auto& m) {
            m.frame.box = Box{{0, 0, 0}, {1, 0, 0}};
          },
          {}),
      odd("far slice", [](auto& m) { m.dynamics.slice = 1e9; },
          {gradient, surface, own_shape, room, slope}),
      odd("a large shape", [](auto& m) { m.frame.shape_to_map.scale = 1e-15; }, {gradient, scale}),
      odd("quadratic",
          [](auto& m) {
            m = quadratic_map({1e9, 0, 0, 0});
          },
          {factors, gradient, origin, surface, shape, detail, own_shape, room, slope, scale})};
}

/// Calls `use` with a name, what it needs and a call for each public function that takes a map.
template <class Use>
void for_map_functions(const Map& map, const std::filesystem::path& folder, const Use& use) {
  const std::vector<Eigen::Vector3d> surface{{0.5, 0, 0}};
  use("validate", Has::nothing, [&] { map.validate(); });
  use("map_buffer", Has::nothing, [&] { return map_buffer(map_device(), map).factors >= 0; });
  use("BufferField", Has::nothing, [&] {
    const BufferField field(map_device(), map);
    CHECK(field.stride(3) >= 3);
  });
  use("build_kernel", Has::nothing, [&] {
    const char* const source = "#include \"map.clh\"\nkernel void k(global real* x) { *x = 1; }";
    clReleaseKernel(build_kernel(map_device(), map, Precision::single, source, "k"));
  });
  use("Field", Has::nothing, [&] {
    const Field field(map_device(), map);
    const std::vector<Quaternion> points{{}, {1e9, 0, 0, 0}, {0, -1e15, 0, 1e15}};
    for (const double f : field.at(points, 2)) CHECK_FALSE(std::isnan(f));
    for (const double f : field.decided_at(points, 2)) CHECK_FALSE(std::isnan(f));
    CHECK(field.versors_at(points).size() == 3);
    CHECK(field.images_at(points).size() == 3);
    const auto orbits = field.orbits_at(points, 3);
    REQUIRE(orbits.size() == 12);
    CHECK(orbits[4] == points[1]);
    for (const int count : field.escape_counts_at(points, 3)) CHECK((count >= 0 && count <= 3));
    CHECK(field.gradient_at(points).size() == 3);
    CHECK(field.gradient_at(points, 3).size() == 3);
    CHECK_FALSE(shell_thickness(field, surface, 0) < 0);
    CHECK_FALSE(std::isnan(median_level(field, surface, 0)));
    CHECK(is_within(effective_radius(field, 0, 3), 0, 3));
  });
  use("versors_at", Has::nothing, [&] {
    const std::vector<Quaternion> points{{}, {0.3, -0.2, 0.1, 0}, {0, 1, 0, 0.1}};
    const bool is_held = is_factor_small(map);
    for (const Quaternion& u : Field(map_device(), map).versors_at(points)) {
      CHECK((norm(u) == Catch::Approx(1).margin(1e-4) || !is_held));
    }
  });
  use("Energy", Has::factors, [&] {
    EnergySamples samples;
    samples.points = {{}, {0.5, 0, 0, 0}, {3, 0, 0, 0}};
    const Energy energy(map_device(), map, samples);
    const auto x = energy.unknowns();
    CHECK(x.size() == energy.size());
    std::vector<double> gradient(energy.size());
    CHECK(energy.value(x) == Catch::Approx(energy.value_and_gradient(x, gradient)));
    for (const double g : gradient) CHECK(std::isfinite(g));
    CHECK(energy.field_at(x).size() == 3);
    CHECK(to_json(energy.map_at(x)) == to_json(map));
  });
  use("fit from it", Has::gradient, [&] {
    FitOptions options;
    options.initial = map;
    options.max_evaluations = 2;
    fit(map_device(), shapes::sphere(1), options).map.validate();
  });
  use("calibrated", Has::origin, [&] { calibrated(map_device(), map).validate(); });
  use("find_stop_radii", Has::bounds, [&] {
    const StopRadii stops = find_stop_radii(map_device(), map);
    CHECK(stops.inner >= 0);
    CHECK(stops.outer >= stops.inner);
    CHECK(stops.escape > 0);
  });
  use("steepened", Has::steeper, [&] { steepened(map, 2).validate(); });
  use("with_detail", Has::detail, [&] { return with_detail(map, 0.01).frame.detail == 0.01; });
  use("detail_for", Has::own_shape,
      [&] { return is_positive(detail_for(map_device(), map, DetailWord::clear)); });
  use("with_measured_detail", Has::slope,
      [&] { with_measured_detail(map_device(), map, surface).validate(); });
  use("with_knobs", Has::nothing, [&] {
    const MapKnobs knobs = changed(MapKnobs{}, [](auto& k) { k.steepness = 2; });
    return with_knobs(map_device(), map, knobs).layers.steepness == 2;
  });
  use("with_longest_side", Has::scale,
      [&] { return longest_side(with_longest_side(map, 10)) == Catch::Approx(10); });
  use("longest_side", Has::shape, [&] { return is_positive(longest_side(map)); });
  use("compare_precisions", Has::surface, [&] { check::compare_precisions(map_device(), map, 2); });
  use("to_json", Has::nothing,
      [&] { return to_json(map_from_json(to_json(map), "a map")) == to_json(map); });
  use("write_map", Has::nothing, [&] {
    const auto path = folder / "map.qjulia.json";
    write_map(map, path);
    CHECK(to_json(read_map(path)) == to_json(map));
    std::filesystem::remove(path);
  });
  use("sample_grid", Has::nothing,
      [&] { return sample_grid(map_device(), map, small_sample()).size() > 0; });
  use("sample_field", Has::bounds, [&] {
    const CellGrid grid{{{-1, -1, -1}, {1, 1, 1}}, {2, 2, 2}};
    std::size_t taken = 0;
    sample_field(map_device(), map, small_sample(), grid, CellOrder::x_fastest,
                 [&](std::span<const double> values) {
                   for (const double f : values) taken += std::isnan(f) ? 0 : 1;
                 });
    CHECK(taken == 8);
  });
  use("write_field", Has::bounds, [&] {
    const auto path = folder / "field.vti";
    write_field(map_device(), map, small_sample(), path, "a <\xff> comment");
    CHECK(std::filesystem::file_size(path) > 0);
    std::filesystem::remove(path);
  });
  use("extract_surface", Has::bounds,
      [&] { extract_surface(map_device(), map, small_surface()).validate(); });
  use("extract_surface to a sink", Has::bounds, [&] {
    MeshSink sink;
    const SurfaceReport report = extract_surface(map_device(), map, small_surface(), sink);
    CHECK(report.triangles == sink.mesh.triangles.size());
    CHECK(to_json(report).at("grid") == report.grid_points);
  });
  use("Studio", Has::bounds, [&] {
    Studio studio(map_device(), map, small_picture());
    check_picture(studio.picture({}), small_picture());
  });
  use("render", Has::bounds,
      [&] { check_picture(render(map_device(), map, small_picture()), small_picture()); });
  use("layered_render", Has::bounds, [&] {
    const LayeredImage made = layered_render(map_device(), map, small_picture());
    check_picture(made.image, small_picture());
    CHECK(made.layers.depth.size() == 64);
  });
  use("comparison", Has::bounds,
      [&] { comparison(map_device(), map, shapes::sphere(1), small_picture()).validate(); });
  use("has_points", Has::bounds, [&] {
    const bool has = has_points(map_device(), map, small_surface());
    CHECK((has || extract_surface(map_device(), map, small_surface()).triangles.empty()));
  });
  use("compare", Has::bounds, [&] {
    for (const FitMetrics& metrics :
         compare(map_device(), map, shapes::sphere(1), small_compare())) {
      CHECK(is_within(metrics.iou, 0, 1));
      CHECK((!why_undefined(metrics).empty() || std::isfinite(metrics.mean_distance)));
    }
  });
  use("proposed_portals", Has::room,
      [&] { return proposed_portals(map_device(), map, {.count = 1}).size() == 1; });
  use("painted", Has::scale, [&] {
    PaintOptions options;
    options.elsewhere = 0.5;
    const Paint paint = painted(map_device(), map, options);
    paint.validate();
    CHECK(paint.at(paint.center(2, 2, 2)) == Catch::Approx(0.5).margin(0.01));
  });
  use("painted_over", Has::scale, [&] {
    painted_over(map, {{Eigen::Vector3d::Zero(), 1, 0.5}}).validate();
  });
  use("planted_portals", Has::room, [&] {
    const Portal tip = proposed_portals(map_device(), map, {.count = 1, .size = 0.1}).at(0);
    const Eigen::Vector3d place = map.frame.shape_to_map.to_shape(tip.center);
    return planted_portals(map_device(), map, place, 0.1).size() == map.layers.portals.size() + 1;
  });
}

}  // namespace

TEST_CASE("maps that are broken are refused by all that take one") {
  const TemporaryFolder folder;
  for (const NamedMap& broken : broken_maps()) {
    CAPTURE(broken.name);
    for_map_functions(
        broken.map, folder.path(),
        [](const char* function, Has /*need*/, const auto& call) { refuses(function, call); });
    // What does not look at a map's values.
    const Dynamics& dynamics = broken.map.dynamics;
    accepts("degree", [&] {
      dynamics.degree();
      FactorsModulus::degree(dynamics);
      QuadraticModulus::degree(dynamics);
      DistanceModulus().degree(dynamics);
    });
    accepts("kind", [&] {
      CHECK_FALSE(broken.map.dynamics.kind().empty());
      CHECK(broken.map.dynamics.is_rational() == (broken.map.dynamics.kind() == "rational"));
    });
    accepts("without", [&] {
      const Map plain = without_paint(without_portals(broken.map));
      CHECK_FALSE(plain.layers.paint);
      CHECK(plain.layers.portals.empty());
    });
    const bool has_bound = broken.name != "no grid" && broken.name != "no shell";
    takes(has_bound, "outer_bound", "the map's distance", [&] {
      if (const auto* distance = std::get_if<DistanceModulus>(&dynamics.modulus)) {
        const DistanceModulus& modulus = *distance;
        modulus.outer_bound(dynamics);
      }
    });
    accepts("outer_bound", [&] {
      FactorsModulus::outer_bound(dynamics);
      QuadraticModulus{{kNan, 0, 0, 0}}.outer_bound(dynamics);
    });
    accepts("visible_depth", [&] { return visible_depth(broken.map.layers.portals) >= 0; });
    refuses("packed_map", [&] { packed_map(broken.map); });
  }
  CHECK(folder.names().empty());
}

TEST_CASE("maps that are valid but useless give what they have", "[slow]") {
  const TemporaryFolder folder;
  for (const OddMap& odd : odd_maps()) {
    CAPTURE(odd.name);
    for_map_functions(odd.map, folder.path(),
                      [&](const char* function, Has need, const auto& call) {
                        takes(!odd.lacks.contains(need), function, "", call);
                      });
  }
}

TEST_CASE("numbers of iterations out of range are refused by name") {
  const Map map = good_map();
  const Field field(map_device(), map);
  const std::vector<Quaternion> points{{}};
  const TriangleMesh mesh = shapes::sphere(1);
  EnergySamples samples;
  samples.points = {{}, {0.5, 0, 0, 0}};
  const auto with = [](auto options, int n) {
    options.iterations = n;
    return options;
  };
  for (const int n : kHostileCounts) {
    CAPTURE(n);
    const auto refused = [](const char* function, const auto& call) {
      refuses(function, "iterations", call);
    };
    refused("at", [&] { field.at(points, n); });
    refused("decided_at", [&] { field.decided_at(points, n); });
    refused("images_at", [&] { field.images_at(points, n); });
    refused("orbits_at", [&] { field.orbits_at(points, n); });
    refused("escape_counts_at", [&] { field.escape_counts_at(points, n); });
    refused("gradient_at", [&] { field.gradient_at(points, n); });
    refused("Energy", [&] { Energy(map_device(), map, samples, with(EnergyOptions{}, n)); });
    refused("compare_precisions", [&] { check::compare_precisions(map_device(), map, n); });
    refused("sample_grid", [&] { sample_grid(map_device(), map, with(small_sample(), n)); });
    refused("extract_surface", [&] { extract_surface(map_device(), map, {.iterations = n}); });
    refused("has_points", [&] { has_points(map_device(), map, {.iterations = n}); });
    refused("compare", [&] { compare(map_device(), map, mesh, {.iterations = n}); });
    refused("render", [&] { render(map_device(), map, with(small_picture(), n)); });
    refused("comparison", [&] { comparison(map_device(), map, mesh, with(small_picture(), n)); });
    refused("surface_colors", [&] { surface_colors(map_device(), map, mesh, {.iterations = n}); });
    refused("measure_scaling", [&] { measure_scaling(map_device(), {.iterations = {n}}); });
  }
}

TEST_CASE("hostile numbers for a field are refused by the point or the option") {
  const Map map = good_map();
  const Field field(map_device(), map);
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Eigen::Vector3d v(x, 0, 0);
    const std::vector<Quaternion> points{{}, {x, 0, 0, 0}, {0, 0, 0, x}};
    // The set's own radius is about 3.
    takes(is_within(x, 10, kLargestEscape), "find_stop_radii", "escape",
          [&] { find_stop_radii(map_device(), map, x); });
    takes(is_near(x), "versors_at", "point 1", [&] {
      for (const Quaternion& u : field.versors_at(points)) CHECK(norm(u) == Catch::Approx(1));
    });
    takes(is_near(x), "images_at", "point 1", [&] {
      for (const Quaternion& q : field.images_at(points, 2)) CHECK(std::isfinite(norm(q)));
    });
    takes(is_near(x), "gradient_at", "point 1", [&] {
      for (const Quaternion& g : field.gradient_at(points, 2)) CHECK(std::isfinite(norm(g)));
    });
    takes(is_near(x), "shell_thickness", "point 0", [&] {
      return shell_thickness(field, {&v, 1}, x) > 0;
    });
    takes(is_near(x), "median_level", "point 0", [&] {
      return std::isfinite(median_level(field, {&v, 1}, x));
    });
    accepts("on_slice", [&] {
      const auto placed = on_slice({&v, 1}, x);
      REQUIRE(placed.size() == 1);
      CHECK((placed[0].w == x || std::isnan(x)));
    });
    accepts("effective_radius", [&] { return is_within(effective_radius(field, x, 3), 0, 3); });
    takes(is_near(x), "effective_radius, limit", "point 0",
          [&] { return effective_radius(field, 0, x) <= std::abs(x); });
    for (const StopRadii& stops : {StopRadii{x, 2, 20}, {0, x, 20}, {0, 2, x}}) {
      accepts("Field", [&] {
        const std::vector<Quaternion> two{{}, {3, 0, 0, 0}};
        const Field stopped(map_device(), map, Precision::single, stops);
        CHECK(stopped.decided_at(two, 3).size() == 2);
      });
    }
    const Box box{{x, x, x}, {1, 1, 1}}, cube{{-1, -1, -1}, {1, 1, 1}};
    takes(is_near(x), "steepest_slope, slice", std::isfinite(x) ? "point 0" : "slice",
          [&] { return steepest_slope(field, x, 0, cube).value_or(1) > 0; });
    takes(std::isfinite(x), "steepest_slope, level", "level",
          [&] { return steepest_slope(field, 0, x, cube).value_or(1) > 0; });
    survives("steepest_slope, box", "a box that is not finite may have no points",
             [&] { return steepest_slope(field, 0, 0, box).value_or(1) > 0; });
  }
}

TEST_CASE("hostile samples, options and unknowns of an energy are refused by name") {
  const Map map = good_map();
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const auto with = [&](bool is_valid, const char* named, const auto& change) {
      takes(is_valid, "Energy", named, [&] {
        EnergySamples samples;
        samples.points = {{}, {0.5, 0, 0, 0}, {3, 0, 0, 0}};
        EnergyOptions options;
        change(samples, options);
        const Energy energy(map_device(), map, samples, options);
        std::vector<double> gradient(energy.size());
        const double value = energy.value_and_gradient(energy.unknowns(), gradient);
        CHECK((std::isfinite(value) || !is_near(x)));  // products of 1e300 overflow
      });
    };
    with(std::isfinite(x), "targets", [&](auto& s, auto&) { s.targets.assign(3, x); });
    with(x == -1 || x == 0 || x == 1, "sides", [&](auto& s, auto&) { s.sides.assign(3, x); });
    with(std::isfinite(x) && x >= 0, "weights", [&](auto& s, auto&) { s.weights.assign(3, x); });
    with(is_near(x), "point 1", [&](auto& s, auto&) { s.points[1].y = x; });
    with(is_positive(x), "alpha", [&](auto&, auto& o) { o.alpha = x; });
    with(is_positive(x) && x <= kLargestEscape, "escape", [&](auto&, auto& o) { o.escape = x; });
    for (const bool is_slice : {false, true}) {
      takes(std::isfinite(x), "unknowns", "x", [&] {
        EnergySamples samples;
        samples.points = {{}, {0.5, 0, 0, 0}};
        EnergyOptions options;
        options.slice = is_slice;
        const Energy energy(map_device(), map, samples, options);
        auto unknowns = energy.unknowns();
        unknowns.at(is_slice ? unknowns.size() - 1 : 2) = x;
        auto gradient = unknowns;
        energy.value_and_gradient(unknowns, gradient);
      });
    }
  }
}

TEST_CASE("hostile numbers for maps and knobs are refused by name") {
  const Map map = good_map();
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Eigen::Vector3d v(x, 0, 0);
    // As many times as steep, or a detail as small, and the map's other numbers are out of range.
    const std::string steep = is_positive(x) ? "the map's" : "times as steep";
    refuses("steepened", steep, [&] { steepened(map, x); });
    refuses("with_detail", x == 1e-300 ? "the map's log_scale" : "detail",
            [&] { with_detail(map, x); });
    refuses("with_longest_side", is_positive(x) ? "the map's" : "length",
            [&] { with_longest_side(map, x); });
    takes(is_near(x), "quadratic_map", "the map's c", [&] {
      quadratic_map({x, x, x, x}).validate();
    });
    const auto knob = [&](bool is_valid, const char* named, const auto& change) {
      takes(is_valid, "with_knobs", named,
            [&] { with_knobs(map_device(), map, changed(MapKnobs{}, change)).validate(); });
    };
    knob(false, "detail", [&](auto& k) { k.detail = x; });
    knob(x == -1, "phase", [&](auto& k) { k.phase = Quaternion{x, 0, 0, 0}; });
    knob(is_near(x), "slice", [&](auto& k) { k.slice = x; });
    knob(std::isfinite(x) && v.norm() > 1e-100, "rotate", [&](auto& k) {
      k.rotate = Rotation{v, 30};
    });
    knob(std::isfinite(x), "rotate", [&](auto& k) { k.rotate = Rotation{{0, 0, 1}, x}; });
    knob(is_near(x), "drift", [&](auto& k) { k.drift = x; });
    knob(is_near(x) && x != -1, "translate", [&](auto& k) { k.translate = v; });
    knob(is_positive(x), "scale", [&](auto& k) { k.scale = x; });
    knob(is_within(x, 1, 100), "steepness", [&](auto& k) { k.steepness = x; });
    for (const Knob& each : knob_table()) {
      CAPTURE(each.name);
      takes(std::isfinite(x) && x >= each.least && x <= each.most, "expect_in_range",
            "out of range", [&] { each.expect_in_range(x); });
      accepts("is_turned", [&] {
        Map odd = good_map();
        odd.frame.detail = odd.frame.inradius = odd.layers.steepness = x;
        CHECK_FALSE(each.is_turned(MapKnobs{}));
        each.is_turned(knobs_of(odd));
        each.why_not(odd);
        each.most_of(odd);
      });
    }
    accepts("rotation", [&] {
      const Rotation turned = Rotation::of(Rotation{v, x}.matrix());
      CHECK(is_within(turned.axis.norm(), 0.999, 1.001) == std::isfinite(turned.axis.norm()));
    });
    const DistanceModulus balls = test::two_balls_grid();
    const DistanceGrid& grid = *balls.grid;
    accepts("farthest_inside", [&] { return !(grid.farthest_inside({x, 0, 0}) < 0); });
    accepts("quaternions", [&] {
      CHECK(coordinates({x, 0, 0, x})[1] == 0);
      CHECK((dot({x, 0, 0, 0}, {x, 0, 0, 0}) >= 0 || std::isnan(x)));
      const double length = norm(exp(log(pow({x, 0, 0, x}, x))));
      CHECK(std::isfinite(length) >= is_within(x, -1, -1));
    });
  }
}

TEST_CASE("kinds cost something in every map, and have no word for what is no value") {
  const Dynamics empty;
  CHECK(FactorsModulus::cost(empty) > 0);
  CHECK(FactorsVersor::cost(empty) > 0);
  CHECK(QuadraticModulus::cost(empty) > 0);
  CHECK(QuadraticVersor::cost(empty) > 0);
  CHECK(DistanceModulus::cost(empty) > 0);
  NoiseVersor noise;
  noise.octaves = std::numeric_limits<int>::min();
  CHECK(std::isfinite(noise.cost(empty)));
  CHECK(word_of(static_cast<FourthCoordinate>(77)).empty());
  CHECK(word_of(static_cast<NoiseValues>(-1)).empty());
  CHECK(word_of(static_cast<PortalMask>(3)).empty());
  CHECK(words(PortalMask::none).size() == 3);
  CHECK(side_of(static_cast<PortalMask>(3)) == 0);
}

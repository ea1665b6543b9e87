// Calls every public function with values that nobody should give. The outcome must be a result or
// an exception of qjulia/error.hpp, and never a crash. tests/lint/hostile.py checks that no
// function is left out.

#include <Eigen/Geometry>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "distance_map.hpp"
#include "qjulia/opencl.hpp"
#include "qjulia/qjulia.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kHuge = 1e300;
const std::vector<double> kHostileNumbers{kNan,   kInfinity, -kInfinity, kHuge,
                                          -kHuge, -1,        0,          1e-300};
const std::vector<int> kHostileCounts{std::numeric_limits<int>::min(), -1, 0, 17, 1000,
                                      std::numeric_limits<int>::max()};
const Eigen::Vector3d kNowhere(0, kNan, 0);

const Device& on_device() { return test::shared_device(); }

template <class Value, class Change>
Value changed(Value value, const Change& change) {
  change(value);
  return value;
}

Portal portal_at(const Eigen::Vector3d& center, double radius) {
  Portal portal;
  portal.center = center;
  portal.radius = radius;
  return portal;
}

Portal scaled_portal(double scale) {
  Portal portal;
  portal.scale = scale;
  return portal;
}

/// Checks that `call` either returns or throws an exception of the library.
template <class Call>
void survives(const std::string& what, const Call& call) {
  INFO(what);
  try {
    call();
    SUCCEED();
  } catch (const Error& error) {
    CHECK_FALSE(std::string(error.what()).empty());
  } catch (const std::exception& error) {
    FAIL_CHECK("throws " << error.what());
  }
}

/// Checks that `call` throws an InputError with a message.
template <class Call>
void refuses(const std::string& what, const Call& call) {
  INFO(what);
  try {
    call();
    FAIL_CHECK("accepts it");
  } catch (const InputError& error) {
    CHECK_FALSE(std::string(error.what()).empty());
  } catch (const std::exception& error) {
    FAIL_CHECK("throws " << error.what());
  }
}

template <class Call>
void refuses_iterations(const Call& call) {
  for (const int n : kHostileCounts) {
    CAPTURE(n);
    try {
      call(n);
      FAIL_CHECK("accepts it");
    } catch (const OptionError& error) {
      CHECK(error.field() == "iterations");
    }
  }
}

struct NamedMesh {
  std::string name;
  TriangleMesh mesh;
};

/// Meshes that every function refuses.
std::vector<NamedMesh> broken_meshes() {
  const auto with = [](const auto& change) {
    TriangleMesh mesh = shapes::sphere(1);
    change(mesh);
    return mesh;
  };
  return {{"an index beyond", with([](auto& m) { m.triangles[3][1] = 42; })},
          {"the largest index", with([](auto& m) {
             m.triangles.back() = {0, 1, ~0U};
           })},
          {"no vertices", with([](auto& m) { m.vertices.clear(); })},
          {"not a number", with([](auto& m) { m.vertices[7].y() = kNan; })},
          {"infinite", with([](auto& m) { m.vertices[0].x() = -kInfinity; })},
          {"an unused vertex", with([](auto& m) { m.vertices.emplace_back(kNowhere); })},
          {"few normals", with([](auto& m) { m.normals.resize(1); })},
          {"many normals", with([](auto& m) { m.normals.assign(99, Eigen::Vector3f::UnitX()); })},
          {"few colours", with([](auto& m) { m.colors.resize(1); })},
          {"bad normals", with([](auto& m) {
             m.normals.assign(m.vertices.size(), Eigen::Vector3f::Constant(NAN));
           })}};
}

/// Meshes that hold nothing, or too much of it.
std::vector<NamedMesh> odd_meshes() {
  const auto scaled = [](double size) {
    return shapes::moved(shapes::sphere(1), size, Eigen::Vector3d::Zero());
  };
  return {{"empty", {}},
          {"no triangles", {shapes::sphere(1).vertices, {}}},
          {"a point", {{{1, 2, 3}}, {{0, 0, 0}}}},
          {"one triangle", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}}},
          {"a line", {{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}, {2, 1, 0}}}},
          {"the same corner", {shapes::sphere(1).vertices, {{5, 5, 5}, {5, 5, 6}}}},
          {"both windings", {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 2, 1}}}},
          {"huge", scaled(1e300)},
          {"tiny", scaled(1e-300)},
          {"far away", shapes::moved(shapes::sphere(1), 1, {1e300, 0, 0})},
          {"huge box", {{{-1.7e308, 0, 0}, {1.7e308, 0, 0}, {0, 1.7e308, 0}}, {{0, 1, 2}}}}};
}

struct NamedMap {
  std::string name;
  Map map;
};

Map good_map() {
  Map map = test::random_map(8, 0.5, 1.5, 3);
  for (Factor& factor : map.dynamics.factors) factor.exponent = std::abs(factor.exponent);
  map.dynamics.log_scale = -2;
  map.frame.box = Box{{-1, -1, -1}, {1, 1, 1}};
  map.frame.detail = 0.02;
  map.frame.inradius = 0.3;
  return map;
}

/// Maps that every function refuses.
std::vector<NamedMap> broken_maps() {
  const auto with = [](const auto& change) {
    Map map = good_map();
    change(map);
    return map;
  };
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

/// Maps that are valid but useless.
std::vector<NamedMap> odd_maps() {
  const auto with = [](const auto& change) {
    Map map = good_map();
    change(map);
    return map;
  };
  return {{"no exponents", with([](auto& m) {
             for (auto& factor : m.dynamics.factors) factor.exponent = 0;
           })},
          {"poles", with([](auto& m) {
             for (auto& factor : m.dynamics.factors) factor.exponent = -1;
           })},
          {"centers at the origin", with([](auto& m) {
             for (auto& factor : m.dynamics.factors) factor.center = {};
           })},
          {"steep", with([](auto& m) { m.dynamics.factors[0].exponent = 1e15; })},
          {"all inside", with([](auto& m) { m.dynamics.surface_level = 1e15; })},
          {"all outside", with([](auto& m) { m.dynamics.log_scale = 1e15; })},
          {"flat box", with([](auto& m) {
             m.frame.box = Box{{0, 0, 0}, {1, 0, 0}};
           })},
          {"far slice", with([](auto& m) { m.dynamics.slice = 1e9; })},
          {"a large shape", with([](auto& m) { m.frame.shape_to_map.scale = 1e-15; })},
          {"quadratic", quadratic_map({1e9, 0, 0, 0})}};
}

EnergySamples three_samples() {
  EnergySamples samples;
  samples.points = {{}, {0.5, 0, 0, 0}, {3, 0, 0, 0}};
  return samples;
}

PictureOptions small_picture() {
  PictureOptions options;
  options.width = options.height = 8;
  options.iterations = 2;
  options.samples = 1;
  return options;
}

SurfaceOptions small_surface() { return {.resolution = 8, .iterations = 2}; }
SampleOptions small_sample() {
  SampleOptions options;
  options.resolution = 4;
  options.iterations = 2;
  return options;
}

ExactMapOptions small_exact() {
  ExactMapOptions options;
  options.resolution = 32;
  return options;
}

template <class Options>
Options with_iterations(Options options, int n) {
  options.iterations = n;
  return options;
}
CompareOptions small_compare() { return {.resolution = 8, .iterations = 1}; }

void take_nothing(std::span<const double> /*values*/) {}

/// Calls `use` with a name and a call for each public function that takes a mesh.
template <class Use>
void for_mesh_functions(const TriangleMesh& mesh, const std::filesystem::path& folder,
                        const Use& use) {
  use("validate", [&] { mesh.validate(); });
  use("inspect", [&] { static_cast<void>(inspect(mesh).warnings()); });
  use("signed_volume", [&] { signed_volume(mesh); });
  use("oriented_outward", [&] { oriented_outward(mesh); });
  use("guess_up", [&] { guess_up(mesh); });
  use("as_if_read", [&] { as_if_read(mesh); });
  use("radial_spread", [&] { radial_spread(mesh, Eigen::Vector3d::Zero()); });
  for (const char* name : {"m.ply", "m.obj", "m.stl", "m.off", "m.glb", "m.3mf", "m.usda"}) {
    use("write_mesh", [&] { write_mesh(mesh, folder / name, "a\xff note", UpAxis::x); });
    use("MeshFileOptions", [&] {
      const MeshFileOptions options{
          .file_up = UpAxis::minus_x, .name = "a\n\xff", .metres_per_unit = 1e300};
      static_cast<void>(options.file_turn());
      write_mesh(mesh, folder / name, options);
    });
  }
  use("measure", [&] { static_cast<void>(to_json(measure(mesh))); });
  use("FigureSink", [&] {
    FigureSink sink(mesh);
    sink.drop_loose_pieces();
  });
  use("kept_of", [&] { FigureSink().kept_of(mesh); });
  use("large_components", [&] { large_components(mesh, 0.5); });
  use("select_parts", [&] {
    TriangleMesh copy = mesh;
    select_parts(copy, {.min_component = 0.5});
  });
  use("cut_open", [&] { cut_open(mesh, {.cuts = {{'x', 0.1}}}, std::nullopt); });
  use("decimated", [&] { decimated(mesh, 3); });
  use("cut_away", [&] {
    for (const double at : {0.0, 1e300, -1e300, std::nan("")})
      cut_away(mesh, {'y', at}, std::nullopt);
    cut_away(mesh, {'z', 50, true}, Box{{0, 0, -1e300}, {1, 1, 1e300}});
  });
  use("decimate", [&] { decimate(mesh, {std::nullopt, 0.1}); });
  use("made_printable", [&] {
    made_printable(mesh, {.height = 2, .min_wall = 1, .flat_foot = 0.1});
    made_printable(mesh, {.longest = 2, .shell = 0.5, .drain = 0.3});
  });
  use("drop_loose_pieces", [&] {
    TriangleMesh copy = mesh;
    drop_loose_pieces(copy);
  });
  use("sample_surface", [&] { sample_surface(mesh, 10, 1); });
  use("SignedDistance", [&] {
    const SignedDistance distance(on_device(), mesh);
    const std::vector<Eigen::Vector3d> points{{0, 0, 0}, kNowhere, {kHuge, 0, 0}};
    static_cast<void>(distance.at(points));
    static_cast<void>(distance.winding_numbers(points));
    deepest_interior_point(distance, mesh.box());
  });
  use("outer_surface", [&] { outer_surface(on_device(), mesh); });
  use("make_shape", [&] { make_shape(on_device(), mesh); });
  use("wall_thickness", [&] { wall_thickness(mesh); });
  const Map map = good_map();
  use("compare", [&] { compare(on_device(), map, mesh, small_compare()); });
  FitOptions fitted;
  fitted.factors = 8;
  fitted.max_evaluations = 2;
  use("fit", [&] { fit(on_device(), mesh, fitted); });
  use("Fit", [&] {
    FitOptions weighted = fitted;
    weighted.weights = [](auto points) { return std::vector<double>(points.size(), 1); };
    Fit stepped(on_device(), mesh, weighted);
    stepped.step();
    static_cast<void>(stepped.map());
    stepped.result();
  });
  use("fit from a map", [&] {
    FitOptions started = fitted;
    started.initial = good_map();
    started.schedule_text = schedule_text("fast");
    fit(on_device(), mesh, started);
  });
  use("exact_map", [&] { exact_map(on_device(), mesh, small_exact()); });
  const Box box{{-1, -1, -1}, {1, 1, 1}};
  use("Studio", [&] { Studio(on_device(), mesh, box, small_picture()); });
  use("render_mesh", [&] { render_mesh(on_device(), mesh, box, small_picture()); });
  use("comparison", [&] { comparison(on_device(), map, mesh, small_picture()); });
  use("surface_colors", [&] { surface_colors(on_device(), map, mesh, {.iterations = 2}); });
}

/// The same for those that take a map.
template <class Use>
void for_map_functions(const Map& map, const std::filesystem::path& folder, const Use& use) {
  const std::vector<Eigen::Vector3d> surface{{0.5, 0, 0}};
  use("validate", [&] { map.validate(); });
  use("map_buffer", [&] { map_buffer(on_device(), map); });
  use("BufferField", [&] {
    const BufferField field(on_device(), map);
    static_cast<void>(field.stride(3));
  });
  use("build_kernel", [&] {
    const char* const source = "#include \"map.clh\"\nkernel void k(global real* x) { *x = 1; }";
    clReleaseKernel(build_kernel(on_device(), map, Precision::single, source, "k"));
  });
  use("Field", [&] {
    const Field field(on_device(), map);
    const std::vector<Quaternion> points{{}, {1e9, 0, 0, 0}, {0, -1e15, 0, 1e15}};
    static_cast<void>(field.at(points, 2));
    static_cast<void>(field.decided_at(points, 2));
    static_cast<void>(field.versors_at(points));
    static_cast<void>(field.images_at(points));
    static_cast<void>(field.orbits_at(points, 3));
    static_cast<void>(field.escape_counts_at(points, 3));
    static_cast<void>(field.gradient_at(points));
    static_cast<void>(field.gradient_at(points, 3));
    shell_thickness(field, surface, 0);
    median_level(field, surface, 0);
    effective_radius(field, 0, 3);
  });
  use("Energy", [&] {
    const Energy energy(on_device(), map, three_samples());
    const auto x = energy.unknowns();
    std::vector<double> gradient(energy.size());
    energy.value(x);
    energy.value_and_gradient(x, gradient);
    static_cast<void>(energy.field_at(x));
    energy.map_at(x);
  });
  use("fit from it", [&] {
    FitOptions options;
    options.initial = map;
    options.max_evaluations = 2;
    fit(on_device(), shapes::sphere(1), options);
  });
  use("calibrated", [&] { calibrated(on_device(), map); });
  use("find_stop_radii", [&] { find_stop_radii(on_device(), map); });
  use("steepened", [&] { steepened(map, 2); });
  use("with_detail", [&] { with_detail(map, 0.01); });
  use("detail_for", [&] { detail_for(on_device(), map, DetailWord::clear); });
  use("with_measured_detail", [&] { with_measured_detail(on_device(), map, surface); });
  use("with_knobs",
      [&] { with_knobs(on_device(), map, changed(MapKnobs{}, [](auto& k) { k.steepness = 2; })); });
  use("with_longest_side", [&] { with_longest_side(map, 10); });
  use("longest_side", [&] { longest_side(map); });
  use("compare_precisions", [&] { compare_precisions(on_device(), map, 2); });
  use("to_json", [&] { map_from_json(to_json(map), "a map"); });
  use("write_map", [&] { write_map(map, folder / "map.qjulia.json"); });
  use("sample_grid", [&] { sample_grid(on_device(), map, small_sample()); });
  use("sample_field", [&] {
    const CellGrid grid{{{-1, -1, -1}, {1, 1, 1}}, {2, 2, 2}};
    sample_field(on_device(), map, small_sample(), grid, CellOrder::x_fastest, take_nothing);
  });
  use("write_field", [&] {
    write_field(on_device(), map, small_sample(), folder / "field.vti", "a <\xff> comment");
  });
  use("extract_surface", [&] { extract_surface(on_device(), map, small_surface()); });
  use("extract_surface to a sink", [&] {
    MeshSink sink;
    static_cast<void>(to_json(extract_surface(on_device(), map, small_surface(), sink)));
  });
  use("Studio", [&] { Studio(on_device(), map, small_picture()); });
  use("render", [&] { render(on_device(), map, small_picture()); });
  use("layered_render", [&] { layered_render(on_device(), map, small_picture()); });
  use("comparison", [&] { comparison(on_device(), map, shapes::sphere(1), small_picture()); });
  use("has_points", [&] { has_points(on_device(), map, small_surface()); });
  use("compare", [&] {
    for (const FitMetrics& metrics :
         compare(on_device(), map, shapes::sphere(1), small_compare())) {
      static_cast<void>(why_undefined(metrics));
    }
  });
  use("proposed_portals", [&] { proposed_portals(on_device(), map, {.count = 1}); });
  use("painted", [&] {
    painted(on_device(), map, changed(PaintOptions{}, [](auto& o) { o.elsewhere = 0.5; }));
  });
}

std::vector<Image> broken_images() {
  return {{},
          {.width = -1, .height = 1, .pixels = {}},
          {.width = 2, .height = 2, .pixels = {1, 2, 3}},
          {.width = 1 << 30, .height = 1 << 30, .pixels = {1, 2, 3}},
          {.width = 1, .height = 1, .pixels = {1, 2, 3}, .alpha = {1, 2}}};
}

}  // namespace

TEST_CASE("meshes that are broken are refused by all that take one") {
  const test::TemporaryFolder folder;
  for (const NamedMesh& broken : broken_meshes()) {
    CAPTURE(broken.name);
    for_mesh_functions(broken.mesh, folder.path(),
                       [](const char* function, const auto& call) { refuses(function, call); });
  }
  CHECK(folder.names().empty());
  TriangleMesh mesh = shapes::sphere(1);
  mesh.vertices[7].y() = kNan;
  CHECK_THROWS_WITH(mesh.validate(), Catch::Matchers::ContainsSubstring("vertices[7]"));
}

TEST_CASE("every function that takes a mesh names the triangle whose index is out of range") {
  const test::TemporaryFolder folder;
  TriangleMesh mesh = shapes::sphere(1);
  mesh.triangles[3][1] = 42;
  for_mesh_functions(mesh, folder.path(), [&](const char* function, const auto& call) {
    CAPTURE(function);
    CHECK_THROWS_AS(call(), InputError);
    CHECK_THROWS_WITH(call(), Catch::Matchers::ContainsSubstring("triangles[3]") &&
                                  Catch::Matchers::ContainsSubstring("42"));
  });
  PaintOptions painting;
  painting.mesh =
      PaintedMesh{mesh.vertices, mesh.triangles, std::vector<float>(mesh.vertices.size(), 0.5F)};
  CHECK_THROWS_WITH(painted(on_device(), good_map(), painting),
                    Catch::Matchers::ContainsSubstring("triangles[3]") &&
                        Catch::Matchers::ContainsSubstring("42"));
}

TEST_CASE("meshes that hold nothing or are beyond all measure do no harm", "[slow]") {
  const test::TemporaryFolder folder;
  for (const NamedMesh& odd : odd_meshes()) {
    CAPTURE(odd.name);
    for_mesh_functions(odd.mesh, folder.path(),
                       [](const char* function, const auto& call) { survives(function, call); });
  }
}

TEST_CASE("maps that are broken are refused by all that take one") {
  const test::TemporaryFolder folder;
  for (const NamedMap& broken : broken_maps()) {
    CAPTURE(broken.name);
    for_map_functions(broken.map, folder.path(),
                      [](const char* function, const auto& call) { refuses(function, call); });
    survives("degree", [&] { static_cast<void>(broken.map.dynamics.degree()); });
    survives("kind", [&] {
      static_cast<void>(broken.map.dynamics.kind() +
                        (broken.map.dynamics.is_rational() ? "" : "!"));
    });
    survives("without", [&] { without_paint(without_portals(broken.map)); });
    survives("outer_bound", [&] {
      std::visit(
          [&](const auto& modulus) { static_cast<void>(modulus.outer_bound(broken.map.dynamics)); },
          broken.map.dynamics.modulus);
    });
    survives("visible_depth", [&] { visible_depth(broken.map.layers.portals); });
  }
  CHECK(folder.names().empty());
}

TEST_CASE("maps that are valid but useless do no harm", "[slow]") {
  const test::TemporaryFolder folder;
  for (const NamedMap& odd : odd_maps()) {
    CAPTURE(odd.name);
    for_map_functions(odd.map, folder.path(),
                      [](const char* function, const auto& call) { survives(function, call); });
  }
}

TEST_CASE("numbers of iterations out of range are refused by name") {
  const Map map = good_map();
  const Field field(on_device(), map);
  const std::vector<Quaternion> points{{}};
  const TriangleMesh mesh = shapes::sphere(1);
  refuses_iterations([&](int n) { field.at(points, n); });
  refuses_iterations([&](int n) { field.decided_at(points, n); });
  refuses_iterations([&](int n) { field.images_at(points, n); });
  refuses_iterations([&](int n) { field.orbits_at(points, n); });
  refuses_iterations([&](int n) { field.escape_counts_at(points, n); });
  refuses_iterations([&](int n) { field.gradient_at(points, n); });
  refuses_iterations([&](int n) {
    Energy(on_device(), map, three_samples(),
           changed(EnergyOptions{}, [&](auto& o) { o.iterations = n; }));
  });
  refuses_iterations([&](int n) { compare_precisions(on_device(), map, n); });
  refuses_iterations(
      [&](int n) { sample_grid(on_device(), map, with_iterations(small_sample(), n)); });
  refuses_iterations([&](int n) { extract_surface(on_device(), map, {.iterations = n}); });
  refuses_iterations([&](int n) { has_points(on_device(), map, {.iterations = n}); });
  refuses_iterations([&](int n) { compare(on_device(), map, mesh, {.iterations = n}); });
  refuses_iterations([&](int n) {
    PictureOptions options = small_picture();
    options.iterations = n;
    render(on_device(), map, options);
  });
  refuses_iterations([&](int n) {
    PictureOptions options = small_picture();
    options.iterations = n;
    comparison(on_device(), map, mesh, options);
  });
  refuses_iterations([&](int n) { surface_colors(on_device(), map, mesh, {.iterations = n}); });
  refuses_iterations([&](int n) { measure_scaling(on_device(), {.iterations = {n}}); });
}

TEST_CASE("hostile numbers in options are refused or do no harm") {
  const Map map = good_map();
  const TriangleMesh mesh = shapes::sphere(1);
  const Field field(on_device(), map);
  const std::vector<Eigen::Vector3d> surface{{0.5, 0, 0}};
  const test::TemporaryFolder folder;
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Eigen::Vector3d v(x, 0, 0);
    survives("find_stop_radii", [&] { find_stop_radii(on_device(), map, x); });
    const std::vector<Quaternion> odd_points{{}, {x, 0, 0, 0}, {0, 0, 0, x}};
    survives("versors_at", [&] { field.versors_at(odd_points); });
    survives("images_at", [&] { field.images_at(odd_points, 2); });
    survives("gradient_at", [&] { field.gradient_at(odd_points, 2); });
    for (int which = 0; which < 7; ++which) {
      CAPTURE(which);
      survives("Energy", [&] {
        EnergySamples samples = three_samples();
        EnergyOptions options;
        std::vector<double>* const lists[]{&samples.targets, &samples.sides, &samples.weights};
        if (which < 3) lists[which]->assign(samples.size(), x);
        if (which == 3) samples.points[1].y = x;
        if (which == 4) options.alpha = x;
        if (which == 5) options.escape = x;
        options.slice = which == 6;
        const Energy energy(on_device(), map, samples, options);
        auto unknowns = energy.unknowns();
        unknowns.at(which == 6 ? unknowns.size() - 1 : 2) = x;
        energy.value_and_gradient(unknowns, unknowns);
      });
    }
    survives("steepened", [&] { steepened(map, x); });
    survives("with_detail", [&] { with_detail(map, x); });
    survives("with_longest_side", [&] { with_longest_side(map, x); });
    survives("effective_radius", [&] { effective_radius(field, x, 3); });
    survives("effective_radius, limit", [&] { effective_radius(field, 0, x); });
    survives("shell_thickness", [&] { shell_thickness(field, {&v, 1}, x); });
    survives("median_level", [&] { median_level(field, {&v, 1}, x); });
    survives("on_slice", [&] { on_slice({&v, 1}, x); });
    for (const StopRadii& stops : {StopRadii{x, 2, 20}, {0, x, 20}, {0, 2, x}}) {
      survives("Field", [&] {
        const std::vector<Quaternion> points{{}, {3, 0, 0, 0}};
        static_cast<void>(Field(on_device(), map, Precision::single, stops).decided_at(points, 3));
      });
    }
    MapKnobs knobs[8];
    knobs[0].detail = x;
    knobs[1].phase = Quaternion{x, 0, 0, 0};
    knobs[2].slice = x;
    knobs[3].rotate = Rotation{v, x};
    knobs[4].drift = x;
    knobs[5].translate = v;
    knobs[6].scale = x;
    knobs[7].steepness = x;
    for (const MapKnobs& knob : knobs) {
      survives("with_knobs", [&] { with_knobs(on_device(), map, knob).validate(); });
    }
    survives("rotation", [&] { Rotation::of(Rotation{v, x}.matrix()); });
    const Box box{{x, x, x}, {1, 1, 1}}, cube{{-1, -1, -1}, {1, 1, 1}};
    survives("steepest_slope, slice", [&] { steepest_slope(field, x, 0, cube); });
    survives("steepest_slope, level", [&] { steepest_slope(field, 0, x, cube); });
    survives("steepest_slope, box", [&] { steepest_slope(field, 0, 0, box); });
    survives("sample_field", [&] {
      const CellGrid grid{box, {2, 2, 2}};
      sample_field(on_device(), map, small_sample(), grid, CellOrder::z_fastest, take_nothing);
    });
    survives("write_field", [&] {
      SampleOptions options = small_sample();
      options.box = box;
      options.escape = 2 + std::abs(x);
      write_field(on_device(), map, options, folder.path() / "field.npy");
    });
    survives("extract_surface", [&] {
      SurfaceOptions options = small_surface();
      options.box = box;
      options.escape = x;
      extract_surface(on_device(), map, options);
    });
    survives("compare", [&] {
      CompareOptions options = small_compare();
      options.box = box;
      static_cast<void>(to_json(compare(on_device(), map, mesh, options).front()));
    });
    PictureOptions pictures[11];
    pictures[0].box = box;
    pictures[1].camera.azimuth = x;
    pictures[2].camera.elevation = pictures[2].camera.zoom = x;
    pictures[3].camera.look_at = v;
    pictures[4].camera.frame = box;
    pictures[5].light.lamps = {{x, x, x, {x, Rgb::Constant(x)}, x}};
    pictures[6].background.color = pictures[6].palette.clay = Rgb::Constant(x);
    pictures[7].cuts = {{'z', x, false}, {'?', x, true}};
    pictures[8].material = Material::trap;
    pictures[8].range = {x, -x};
    pictures[9].camera.distance = x;
    pictures[10].material = Material::trap;
    pictures[10].range = {0, 1, {x, -x}};
    for (PictureOptions options : pictures) {
      options.width = options.height = 8;
      options.iterations = 2;
      options.samples = 1;
      survives("of_drafts", [&] {
        Studio::of_drafts(on_device(), map, options).layered_picture(options.camera);
      });
    }
    survives("set_exposure", [&] {
      PictureOptions options;
      options.width = options.height = 8;
      Studio::of_drafts(on_device(), map, options).set_exposure(x);
    });
    survives("tone_mapped", [&] {
      for (const auto tone : {ToneCurve::neutral, ToneCurve::agx, ToneCurve::aces}) {
        CHECK_FALSE(tone_mapped(tone, Rgb(x, 1, -x)).maxCoeff() > 1);
      }
    });
    survives("aimed, shown and set_range", [&] {
      PictureOptions options = small_picture();
      options.material = Material::trap;
      Studio studio(on_device(), map, options);
      options.camera.azimuth = x;
      const std::vector others{v};
      studio.aimed(std::span(&options.camera, 1), others);
      const std::vector<float> seen = studio.shown(std::span(&options.camera, 1));
      studio.set_range(range_over(seen, Material::trap));
      range_over({static_cast<float>(x), 0.5F}, Material::height).validate();
      studio.set_range(MaterialRange{x, 1});
    });
    survives("render_mesh", [&] { render_mesh(on_device(), mesh, box, small_picture()); });
    survives("painted", [&] {
      PaintOptions options;
      options.balls = {{v, x, x}};
      options.blocks = {{box, x}};
      options.thickness = x;
      painted(on_device(), map, options);
    });
    survives("painted by a mesh", [&] {
      PaintedMesh by{{v, v, v}, {{0, 1, 9}}, {static_cast<float>(x), 0, 0}};
      PaintOptions options;
      options.mesh = by;
      painted(on_device(), map, options);
    });
    survives("painted by a ramp", [&] {
      PaintOptions options;
      options.elsewhere = x;
      options.ramp = PaintRamp{7, x, x};
      painted(on_device(), map, options);
    });
    survives("painted_share", [&] { painted_share(x); });
    survives("paint", [&] {
      const Paint paint{.cells = {4, 4, 4}, .step = 1, .shares = std::vector<std::uint8_t>(64)};
      static_cast<void>(paint.at(v) + paint.center(-1, 99, 0).x());
    });
    survives("proposed_portals", [&] {
      PortalOptions options;
      options.size = x;
      proposed_portals(on_device(), map, options);
    });
    survives("visible_depth", [&] { visible_depth({scaled_portal(x)}); });
    survives("visible_depth", [&] { visible_depth({scaled_portal(1 + 1e-16 * x)}); });
    FitOptions fitted;
    fitted.factors = 8;
    fitted.max_evaluations = 2;
    survives("fit", [&] {
      FitOptions options = fitted;
      options.detail = x;
      options.steepness = x;
      fit(on_device(), mesh, options);
    });
    survives("fit, limits", [&] {
      FitOptions options = fitted;
      options.time_limit = x;
      options.target_iou = x;
      fit(on_device(), mesh, options);
    });
    survives("exact_map", [&] {
      ExactMapOptions options = small_exact();
      options.detail = x;
      options.steepness = x;
      exact_map(on_device(), mesh, options);
    });
    survives("exact_map, versor", [&] {
      ExactMapOptions options = small_exact();
      options.versor = FactorsOfMap{{{{x, 0, 0, 0}, x}}, {x, v}};
      options.phase = {x, 0, 0, 0};
      exact_map(on_device(), mesh, options);
    });
    survives("exact_map, noise", [&] {
      ExactMapOptions options = small_exact();
      NoiseVersor noise;
      noise.scale = x;
      noise.origin = v;
      options.versor = noise;
      exact_map(on_device(), mesh, options);
    });
    survives("chosen_detail", [&] { chosen_detail(DetailWord::wild, {x, x}, kFittedRule); });
    survives("radial_spread", [&] { radial_spread(mesh, v); });
    for (const SettingOf<PortalOptions>& setting : portal_settings()) {
      PortalOptions options;
      options.size = x;
      survives("expect_in_range", [&] { expect_in_range(setting, setting.place(options)); });
      static_cast<void>(setting.values_text().size());
    }
    survives("expect_in_ranges", [&] {
      FitOptions options;
      options.time_limit = x;
      static_cast<void>(options.most_seconds());
      expect_in_ranges(fit_settings(), options);
    });
    for (const Knob& knob : knob_table()) {
      survives("expect_in_range", [&] { knob.expect_in_range(x); });
      survives("is_turned", [&] {
        Map odd = good_map();
        odd.frame.detail = odd.frame.inradius = odd.layers.steepness = x;
        static_cast<void>(knob.is_turned(knobs_of(odd)));
        static_cast<void>(knob.why_not(odd).size() + (knob.most_of(odd) > 0 ? 1 : 0));
      });
    }
    survives("to_string", [&] { to_string(DetailChoice(x)); });
    survives("quadratic_map", [&] { quadratic_map({x, x, x, x}).validate(); });
    survives("log", [&] {
      static_cast<void>(norm(exp(log(pow({x, 0, 0, x}, x)))) + coordinates({x, x, x, x})[0]);
    });
    survives("drop_small_parts", [&] { large_components(mesh, x); });
    survives("box_dimension", [&] {
      const auto f = static_cast<float>(x);
      const std::vector<Eigen::Vector3f> points{{f, 0, 0}, {0, f, 1}};
      box_dimension(points, x);
    });
    survives("box_dimension, finest", [&] {
      const std::vector<Eigen::Vector3f> points{{0, 0, 0}, {0, 1, 1}};
      box_dimension(points, x);
    });
    survives("color_name", [&] { color_name(Rgb::Constant(x)); });
    survives("animated_png_bytes", [&] {
      const std::vector<Image> images{{.width = 1, .height = 1, .pixels = {1, 2, 3}}};
      animated_png_bytes(images, x);
    });
    survives("regressions", [&] { regressions({}, nlohmann::json::object(), x); });
    survives("fit_law", [&] { fit_law({{1, 1, 1, x}, {1, 2, 1, x}, {1, 1, 2, x}}); });
    survives("measure_scaling", [&] {
      measure_scaling(on_device(),
                      {.samples = {64, 65}, .factors = {8, 9}, .iterations = {1}, .most_slots = x});
    });
    survives("mesh_of", [&] {
      mesh_of({.samples = {2, 2, 2}, .center = v, .lengths = v, .values = std::vector(8, x)});
    });
    survives("portals_from_text", [&] {
      portals_from_text("Portals radius: 1\nPortals scale: 2\nPortal location: 1 2 3\n", "a text",
                        {x, v});
    });
    survives("sample_surface", [&] { sample_surface(shapes::moved(mesh, x, v), 3, 1); });
    survives("deepest_interior_point",
             [&] { deepest_interior_point(SignedDistance(on_device(), mesh), box); });
    survives("frame", [&] {
      const ShapeToMap frame{x, v};
      static_cast<void>(frame.to_map(box).diagonal() + frame.to_shape(v).x());
    });
    survives("quarter_turns", [&] {
      static_cast<void>(direction(UpAxis::z).dot(v) + axis_number(UpAxis::y) +
                        quarter_turns(UpAxis::x, UpAxis::z).sum());
    });
  }
}

TEST_CASE("hostile counts and sizes are refused or do no harm") {
  const Map map = good_map();
  const TriangleMesh mesh = shapes::sphere(1);
  for (const int n : kHostileCounts) {
    CAPTURE(n);
    const bool is_large = n > 16;  // which may only cost time
    survives("sample_field", [&] {
      const CellGrid grid{{{-1, -1, -1}, {1, 1, 1}}, {n, 1, is_large ? 1 : n}};
      sample_field(on_device(), map, small_sample(), grid, CellOrder::z_fastest, take_nothing);
    });
    survives("SampleOptions",
             [&] { changed(small_sample(), [&](auto& o) { o.resolution = n; }).validate(); });
    survives("SurfaceOptions", [&] { SurfaceOptions{.resolution = n, .refine = n}.validate(); });
    survives("CompareOptions", [&] { CompareOptions{.resolution = n}.validate(); });
    survives("Ranks", [&] {
      const std::string bytes(3, static_cast<char>(n));
      CHECK(Ranks::bytes_of(Ranks::numbers_of(bytes)) == bytes);
      Ranks::bytes_of({static_cast<double>(n)});
    });
    survives("PortalOptions", [&] { PortalOptions{.count = n}.validate(); });
    survives("ExactMapOptions", [&] {
      changed(small_exact(), [&](auto& o) {
        o.resolution = n;
        o.versor = RandomRoots{.roots = n};
      }).validate();
    });
    survives("ProfileOptions", [&] { ProfileOptions{.repeats = n, .lane_width = n}.validate(); });
    survives("FitOptions", [&] {
      FitOptions options;
      options.max_factors = options.sample_parts = n;
      options.factors = options.max_evaluations = n;
      options.validate();
    });
    survives("PictureOptions", [&] {
      PictureOptions options;
      options.width = options.height = options.samples = n;
      options.validate();
    });
    survives("NoiseVersor", [&] { NoiseVersor{.octaves = n}.validate(); });
    refuses("resize", [&] {
      Studio studio(on_device(), map, small_picture());
      to_text(studio.lookups());
      static_cast<void>(studio.range());
      studio.resize(std::min(n, 0), n);
      studio.picture({});
    });
    survives("with_lane_width", [&] { static_cast<void>(on_device().with_lane_width(n)); });
    survives("with_tuning", [&] {
      Tuning tuning;
      tuning.lane_width = tuning.panel_block = n;
      static_cast<void>(on_device().with_tuning(Precision::single, tuning));
    });
    const Image pixel{.width = 1, .height = 1, .pixels = {1, 2, 3}};
    survives("contact_sheet", [&] { contact_sheet({&pixel, 1}, n, std::min(n, 99)); });
    survives("reduced", [&] { reduced(pixel, n); });
    survives("write_layers", [&] {
      const test::TemporaryFolder folder;
      write_layers({{1.0F}, {1.0F}, {}}, n, folder.path() / "layers");
    });
    survives("exr_bytes", [&] { exr_bytes({.image = {n, n, {}}, .layers = {}}); });
    survives("write_exr", [&] {
      const test::TemporaryFolder folder;
      write_exr({.image = {n, 1, {}}, .layers = {}}, folder.path() / "a.exr");
    });
    survives("DistanceGrid", [&] {
      const DistanceGrid grid(
          {.cells = {n, n, n}, .coarse = {1}, .blocks = {7}, .corrections = {}});
      static_cast<void>(grid.slope() + grid.farthest_inside({kNan, 0, 0}) +
                        static_cast<double>(grid.coefficients().size() + grid.data().size()));
    });
    survives("mesh_of", [&] { mesh_of({.samples = {n, n, n}, .values = {1, 2, 3}}); });
  }
  refuses("profile", [&] { profile(on_device(), {.sample_points = 0}); });
  refuses("tune", [&] { tune(on_device(), {.factors = ~std::size_t{0}}); });
  refuses("measure_scaling", [&] { measure_scaling(on_device(), {.samples = {0}}); });
  refuses("measure_scaling", [&] { measure_scaling(on_device(), {.factors = {}}); });
  refuses("fit_law", [&] { fit_law({}); });
  survives("to_csv", [&] { to_csv(ScalingReport{}), to_json(ScalingReport{}); });
  survives("profile's report", [&] {
    const ProfileReport empty;
    to_csv(empty), to_json(empty), empty.disturbances();
  });
  survives("others' reports", [&] {
    to_json(TuneReport{}), to_json(SelfTestReport{}), SelfTestReport{}.has_passed();
  });
  refuses("measure_grid", [&] { measure_grid(on_device(), {}, {{"no_setting", {1}}}); });
  refuses("measure_grid", [&] { measure_grid(on_device(), {}, {{"lane_width", {}}}); });
  survives("a grid's report", [&] { to_csv(GridReport{}), to_json(GridReport{}); });
  survives("command_profile", [&] {
    const LaunchCounter counter;
    const CommandProfile empty = command_profile({}, Trace(), counter.work(), {}, kNan);
    to_json(empty), to_text(empty);
    static_cast<void>(measure_roofs(on_device()));
    CommandMeasure measure = CommandMeter(on_device()).finish({});
    measure.cpu = {{7, 1}, {-7, kNan}};
    measure.fma_per_second_before = -1;
    to_text(command_profile({}, Trace(), counter.work(), measure, -1));
  });
  survives("with_known_tuning", [&] { static_cast<void>(with_known_tuning(on_device())); });
  survives("export_tuning", [&] { export_tuning(on_device(), "/no/such/folder/file.json"); });
  refuses("import_tuning", [&] { import_tuning(on_device(), "/no/such/file.json"); });
  survives("summaries", [&] { brief_summary({}), full_summary({}); });
}

TEST_CASE("spans without elements and pictures without pixels do no harm") {
  const Map map = good_map();
  const Field field(on_device(), map);
  CHECK(field.at({}).empty());
  CHECK(field.decided_at({}, 2).empty());
  CHECK(field.versors_at({}).empty());
  CHECK(field.images_at({}).empty());
  CHECK(field.orbits_at({}, 2).empty());
  CHECK(field.escape_counts_at({}, 2).empty());
  CHECK(field.gradient_at({}).empty());
  refuses("Energy", [&] { Energy(on_device(), map, {}); });
  refuses("shell_thickness", [&] { shell_thickness(field, {}, 0); });
  refuses("median_level", [&] { median_level(field, {}, 0); });
  refuses("with_measured_detail", [&] { with_measured_detail(on_device(), map, {}); });
  survives("box_dimension", [&] { box_dimension({}, 0.1); });
  survives("png", [&] { contact_sheet({}, 1); });
  refuses("animated_png_bytes", [&] { animated_png_bytes({}, 1); });
  const test::TemporaryFolder folder;
  for (const Image& image : broken_images()) {
    refuses("validate", [&] { image.validate(); });
    refuses("png_bytes", [&] { png_bytes(image); });
    refuses("animated_png_bytes", [&] { animated_png_bytes({&image, 1}, 1); });
    refuses("write_png", [&] { write_png(image, folder.path() / "picture.png"); });
    refuses("contact_sheet", [&] { contact_sheet({&image, 1}, 1); });
    refuses("reduced", [&] { reduced(image, 2); });
    refuses("captioned", [&] { captioned(image, "text"); });
  }
  const Image pixel{.width = 1, .height = 1, .pixels = {1, 2, 3}};
  survives("captioned", [&] { captioned(pixel, std::string(10'000, '\xff')); });
  survives("png_bytes", [&] {
    png_bytes(pixel, {{"", std::string("\0\xff", 2)}, {std::string(99, 'k'), ""}});
  });
  refuses("write_layers", [&] { write_layers({}, 0, folder.path() / "layers"); });
  survives("layer_files", [&] { layer_files({}); });
  CHECK(folder.names().empty());
}

TEST_CASE("sinks of surfaces take nothing that does not belong together") {
  const test::TemporaryFolder folder;
  const std::vector<Eigen::Vector3d> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  const std::vector<Triangle> good{{0, 1, 2}}, bad{{0, 1, 3}};
  {
    PlyFile file(folder.path() / "few_normals.ply");
    refuses("vertices", [&] { file.vertices(points, {points.data(), 1}); });
    file.vertices(points, points);
    file.triangles(bad);
    refuses("commit", [&] { file.commit(); });
    refuses("commit", [&] { file.commit([](std::uint32_t) { return true; }); });
  }
  CHECK(folder.names().empty());
  PlyFile file(folder.path() / "twice.ply", "note\xff");
  file.vertices(points, points);
  file.triangles(good);
  file.commit();
  refuses("commit", [&] { file.commit(); });
  refuses("vertices", [&] { file.vertices(points, points); });
  refuses("triangles", [&] { file.triangles(good); });

  FigureSink sink;
  sink.triangles(bad);
  sink.vertices(points, {});
  CHECK(sink.figures().triangles == 0);
  CHECK_FALSE(sink.keeps(1'000'000));
  refuses("vertices", [&] { sink.vertices({&kNowhere, 1}, {}); });
  sink.drop_small_parts(kNan);
  sink.drop_loose_pieces();
  MeshSink mesh;
  mesh.triangles(bad);
  mesh.vertices(points, {});
  refuses("validate", [&] { mesh.mesh.validate(); });
}

TEST_CASE("texts, bytes and files that hold something else are refused") {
  const test::TemporaryFolder folder;
  const auto garbage = folder.file("garbage", std::string("\0\xff{[<ply", 8));
  for (const char* extension : {".obj", ".ply", ".stl", ".off", ".o3d", ".f3d", ".poly4d", ".txt",
                                ".json", ".png", ".glb"}) {
    const auto path = folder.file("garbage" + std::string(extension), test::read_text(garbage));
    for (const auto& file :
         {path, folder.path(), folder.path() / "missing", std::filesystem::path()}) {
      CAPTURE(file);
      refuses("read_mesh", [&] { read_mesh(file); });
      refuses("read_and_inspect_mesh", [&] { read_and_inspect_mesh(file); });
      refuses("read_painted_mesh", [&] { read_painted_mesh(file, "a\xff"); });
      refuses("read_map", [&] { read_map(file); });
      survives("holds_map", [&] { static_cast<void>(holds_map(file)); });
      refuses("read_original", [&] { read_original(file); });
      refuses("read_sampled_distance", [&] { read_sampled_distance(file); });
      refuses("read_portal_text", [&] { read_portal_text(file, {}); });
      survives("file types", [&] {
        static_cast<void>(extension_of(file).size() + (format_up(file) ? 1 : 0) +
                          (holds_colors(file) ? 1 : 0));
        static_cast<void>(has_type(file, FileContent::map, FileUse::read));
        static_cast<void>(content_of(file).has_value());
        static_cast<void>(expect_type(file, FileContent::picture, FileUse::write));
      });
    }
  }
  refuses("range_of", [] { range_of({}); });
  for (const std::string& text : {std::string(), std::string(1, '\0'), std::string(1000, '\xff'),
                                  std::string("{}"), std::string("nan")}) {
    refuses("original_from_bytes", [&] { original_from_bytes(text, "a text"); });
    refuses("polynomial_from_bytes", [&] { polynomial_from_bytes(text, "a text"); });
    refuses("sampled_distance_from_bytes", [&] { sampled_distance_from_bytes(text, "a text"); });
    refuses("portals_from_text", [&] { portals_from_text(text, "a text", {}); });
    refuses("schedule_text", [&] { schedule_text(text); });
    refuses("knob_named", [&] { knob_named(text); });
    refuses("picture_setting_named", [&] { picture_setting_named(text); });
    refuses("fit_setting_named", [&] { fit_setting_named(text); });
    refuses("setting_named", [&] { setting_named(print_settings(), text, "prints"); });
    refuses("index_of", [&] { exact_settings().back().index_of(text); });
    refuses("light_color_from", [&] { light_color_from(text); });
    refuses("lamp_from", [&] { lamp_from(text); });
    if (!text.empty()) refuses("cuts_from", [&] { cuts_from(text); });
    refuses("place_of", [] { static_cast<void>(place_of({'x', 50, true}, std::nullopt)); });
    refuses("range_from", [&] { range_from(text); });
    refuses("background_from", [&] { background_from(text); });
    refuses("palette_from", [&] { palette_from(std::span(&text, 1), Material::trap); });
    refuses("look_description", [&] { look_description(text); });
    refuses("apply_look", [&] {
      PictureOptions options;
      apply_look(options, text);
    });
    refuses("apply_built_in_look", [&] {
      PictureOptions options;
      apply_built_in_look(options, text);
    });
    survives("names", [&] {
      bool flag = !text.empty();
      CHECK(option_of({.name = text, .example = "", .help = ""}, &flag).ends_with(text));
      static_cast<void>(color_named(text));
      static_cast<void>(rig_named(static_cast<RigName>(text.size())));
      static_cast<void>(palette_named(text));
      static_cast<void>(up_axis_named(text));
      static_cast<void>(detail_word_named(text));
      static_cast<void>(palette_names().size() +
                        extensions(FileContent::mesh, FileUse::read).size());
      static_cast<void>(extension_list(FileContent::map, FileUse::write));
    });
  }
  using nlohmann::json;
  for (const json& value :
       {json(), json(1), json("x"), json::array(), json::object(), json{{"format", "qjulia-map"}},
        json{{"format", 1}, {"version", "x"}, {"kind", json::array()}}}) {
    refuses("map_from_json", [&] { map_from_json(value, "a value"); });
    refuses("tuning_from", [&] { tuning_from(value); });
    refuses("regressions", [&] { regressions({}, value, 0.1); });
  }
  survives("provenance", [&] {
    Map map = good_map();
    map.provenance = json{{"name", "a\xff"}};
    map.provenance.set("\xff", "\xff");
    write_map(map, folder.path() / "map.qjulia.json");
    static_cast<void>(read_map(folder.path() / "map.qjulia.json"));
  });
  refuses("provenance", [&] {
    Map map = good_map();
    map.provenance = json(7);
    map.provenance.set("key", 1);
    map.validate();
  });
  refuses("packed_map", [&] {
    Map map = good_map();
    map.dynamics.log_scale = kNan;
    static_cast<void>(packed_map(map));
  });
  const auto nowhere = folder.path() / "no" / "such";
  survives("outputs", [&] { write_map(good_map(), nowhere / "map.qjulia.json"); });
  survives("outputs", [&] { write_mesh(shapes::box(), nowhere / "mesh.ply"); });
  survives("outputs", [&] { PlyFile(nowhere / "mesh.ply").commit(); });
  survives("outputs", [&] {
    Trace trace;
    trace.add("\xff", Trace::Row::host, Trace::Timer::wall, Trace::Clock::time_point::min(), {});
    { const TraceStage stage(nullptr, ""); }
    trace.write(nowhere / "trace.json", "\xff", {{"\xff", std::nan("")}});
  });
}

TEST_CASE("hostile wishes for devices are refused") {
  for (const char* wanted :
       {"no such device", "99:99", "-1:-1", ":", "\xff", "999999999999999:1"}) {
    CAPTURE(wanted);
    CHECK_THROWS_AS(Device::choose({wanted}), NoDeviceError);
  }
  survives("tuning_file", [] { tuning_file({}); });
  survives("with_cached_tuning", [] { with_cached_tuning(on_device()); });
  survives("to_json", [] { to_json(DeviceInfo{}); });
  survives("known_fault", [] { known_fault(DeviceInfo{}); });
  const BufferField field(on_device(), good_map());
  refuses("BufferField's points", [&] { field.at(nullptr, 1, 1, nullptr); });
  refuses("BufferField's gradient", [&] { field.gradient_at(nullptr, 1, nullptr); });
  refuses("device_from_opencl", [] { device_from_opencl(nullptr, nullptr, nullptr); });
  refuses("device_from_opencl of another context", [] {
    const Device other = Device::choose({"cpu"});
    device_from_opencl(opencl_context(on_device()), opencl_device(on_device()),
                       opencl_queue(other));
  });
  for (const std::string& source :
       {std::string(), std::string("\0\n\xff", 3), std::string("#include"),
        std::string("#include \"../map.clh\""), std::string("#include \"the caller's source\"")}) {
    for (const std::string& name : {std::string(), std::string("\0", 1), std::string("\xff{}%s")}) {
      survives("build_kernel",
               [&] { build_kernel(on_device(), good_map(), Precision::single, source, name); });
    }
  }
  survives("record", [] { on_device().sibling().record(nullptr); });
  std::stop_source source;
  source.request_stop();
  CHECK_THROWS_AS(throw_if_stopped(source.get_token()), Interrupted);
}

TEST_CASE("a check that a self-test does not have is refused") {
  const Device& device = test::shared_device();
  const std::size_t count = self_test_plan(device).size();
  for (const std::size_t number : {count, std::numeric_limits<std::size_t>::max()}) {
    try {
      self_test_check(device, number);
      FAIL_CHECK("accepts it");
    } catch (const OptionError& error) {
      CHECK(error.field() == "number");
    }
  }
}

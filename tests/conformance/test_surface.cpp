// Surfaces of sets whose shape is known, and their comparison with meshes.

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "armed_ball.hpp"
#include "edge_count.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/surface/compare.hpp"
#include "qjulia/surface/figures.hpp"
#include "qjulia/surface/surface.hpp"
#include "random_maps.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

/// R(q) = q²: F_1 = 2 ln |q|, and the filled Julia set is the unit ball.
Map square() {
  Map map;
  map.dynamics.factors = {{{0, 0, 0, 0}, 2}};
  return map;
}

/// Four roots and a pole: a lump with a hollow.
Map lump() {
  Map map;
  map.dynamics.factors = {{{0.1, 0, 0, 0}, 1.2},
                          {{0.8, 0.3, 0, 0.1}, 0.6},
                          {{-0.5, 0.6, 0.4, 0}, 0.7},
                          {{0, -0.7, 0.5, 0}, 0.8},
                          {{0.2, 0.3, -1.0, 0.05}, -0.6}};
  map.dynamics.log_scale = 0.3;
  return map;
}

/// Energy of F_1 = 2 ln |q| against the ball of radius r, by its definition.
double ball_energy(double r, int resolution) {
  const double cell = 1.15 * 2 * r / resolution;
  double weight[2] = {0, 0};
  double sum[2] = {0, 0};
  for (int i = 0; i < resolution * resolution * resolution; ++i) {
    const Eigen::Vector3d index(i % resolution, i / resolution % resolution,
                                i / resolution / resolution);
    const double radius =
        (cell * (index - Eigen::Vector3d::Constant(0.5 * (resolution - 1)))).norm();
    const int side = radius < r ? 0 : 1;
    const double w = 1 / std::max(std::abs(radius - r), cell / 2);
    weight[side] += w;
    sum[side] += w * (side == 0 ? -1 : 1) * std::tanh(10 * 2 * std::log(radius));
  }
  return -0.5 * (sum[0] / weight[0] + sum[1] / weight[1]);
}

const double kBallVolume = 4 * M_PI / 3;

}  // namespace

TEST_CASE("the set of q² is the unit ball, found without a box") {
  const int iterations = GENERATE(1, 6);
  const TriangleMesh mesh = extract_surface(test::shared_device(), square(), {48, iterations, {}});
  test::require_closed_manifold(mesh);
  CHECK(test::enclosed_volume(mesh) == Catch::Approx(kBallVolume).epsilon(0.01));
  CHECK(test::surface_area(mesh) == Catch::Approx(4 * M_PI).epsilon(iterations == 1 ? 0.01 : 0.04));
}

TEST_CASE("a field that is steeper outside has the same surface at n = 1") {
  Map map = lump();
  map.frame.box = Box{{-2, -2, -2}, {2, 2, 2}};  // or else found by the field
  const TriangleMesh mesh = extract_surface(test::shared_device(), map, {48, 1, {}});
  map.layers.steepness = 4;
  const TriangleMesh same = extract_surface(test::shared_device(), map, {48, 1, {}});
  REQUIRE(same.triangles == mesh.triangles);
  double farthest = 0;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    farthest = std::max(farthest, (same.vertices[i] - mesh.vertices[i]).norm());
  }
  CHECK(farthest < 1e-4);
  // Iterated sets differ: images that land outside land farther out.
  const auto volume = [&](double steepness) {
    map.layers.steepness = steepness;
    return test::enclosed_volume(extract_surface(test::shared_device(), map, {48, 6, {}}));
  };
  CHECK(std::abs(volume(4) - volume(1)) > 0.005);
}

TEST_CASE("surfaces come in the shape's own coordinates") {
  Map map = square();
  map.frame.shape_to_map = {2, {-0.5, 1, 3}};
  map.frame.box = Box{{-0.25, -1, -2}, {0.75, 0, -1}};
  const TriangleMesh mesh = extract_surface(test::shared_device(), map, {64, 1, {}});
  test::require_closed_manifold(mesh);
  const Eigen::Vector3d center(0.25, -0.5, -1.5);
  for (const auto& v : mesh.vertices)
    CHECK((v - center).norm() == Catch::Approx(0.5).epsilon(0.002));
}

TEST_CASE("a box that is too small grows until the set is clear of it") {
  Map map = square();
  map.frame.box = Box{{-0.2, -0.9, -0.5}, {0.7, 0.6, 0.8}};
  const TriangleMesh mesh = extract_surface(test::shared_device(), map, {64, 1, {}});
  test::require_closed_manifold(mesh);
  CHECK(test::enclosed_volume(mesh) == Catch::Approx(kBallVolume).epsilon(0.01));
}

TEST_CASE("a given box is kept, and cuts the set open") {
  SurfaceOptions options{32, 1, Box{{0, -1.2, -1.2}, {1.2, 1.2, 1.2}}};
  MeshSink sink;
  const SurfaceReport report = extract_surface(test::shared_device(), square(), options, sink);
  const TriangleMesh& mesh = sink.mesh;
  const auto count = test::count_edges(mesh);
  CHECK(count.open > 0);
  CHECK(count.open == report.open_edges);
  CHECK(count.badly_shared == 0);
  for (const auto& v : mesh.vertices) CHECK(v.x() >= 0);
  CHECK(test::surface_area(mesh) == Catch::Approx(2 * M_PI).epsilon(0.02));
}

TEST_CASE("iterated sets are closed and manifold too, over several slabs") {
  const auto device = test::shared_device();
  const int iterations = GENERATE(1, 2, 5);
  Map map = lump();
  const TriangleMesh mesh = extract_surface(device, map, {128, iterations, {}});
  test::require_closed_manifold(mesh);
  // The volume that orbits at cell centres have.
  const Field field(device, map, Precision::single, find_stop_radii(device, map));
  const Box box = mesh.box();
  constexpr int kCells = 64;
  std::vector<Eigen::Vector3d> centers;
  for (int i = 0; i < kCells * kCells * kCells; ++i) {
    const Eigen::Vector3d index(i % kCells, i / kCells % kCells, i / kCells / kCells);
    centers.emplace_back(
        box.low + box.size().cwiseProduct((index + Eigen::Vector3d::Constant(0.5)) / kCells));
  }
  const auto values = field.decided_at(on_slice(centers, map.dynamics.slice), iterations);
  const auto inside =
      std::ranges::count_if(values, [&](double f) { return f < map.dynamics.surface_level; });
  CHECK(test::enclosed_volume(mesh) ==
        Catch::Approx(static_cast<double>(inside) * box.size().prod() / (kCells * kCells * kCells))
            .epsilon(0.01));
}

TEST_CASE("looking at the shell alone gives the mesh of looking everywhere") {
  const auto device = test::shared_device();
  const auto [resolution, iterations, detail] = GENERATE(table<int, int, double>(
      {{64, 1, 0.05}, {96, 6, 0.05}, {70, 6, 0.2}, {64, 2, 0.3}, {160, 4, 0.2}}));
  Map map = test::armed_ball_map(60);
  for (Factor& factor : map.dynamics.factors) factor.exponent /= detail;
  map.dynamics.log_scale /= detail;
  map.layers.steepness = GENERATE(1.0, 2.0);
  SurfaceOptions options{resolution, iterations, {}};
  MeshSink sparse_sink, dense_sink;
  const SurfaceReport sparse = extract_surface(device, map, options, sparse_sink);
  options.dense = true;
  const SurfaceReport dense = extract_surface(device, map, options, dense_sink);
  const TriangleMesh &mesh = sparse_sink.mesh, &same = dense_sink.mesh;
  test::require_closed_manifold(mesh);
  CHECK(mesh.triangles == same.triangles);
  CHECK(mesh.vertices == same.vertices);
  CHECK(mesh.normals == same.normals);
  CAPTURE(sparse.grid_points, sparse.potentials, sparse.settled, sparse.iterated, dense.iterated);
  CHECK(sparse.grid_points == dense.grid_points);
  CHECK(dense.potentials == dense.grid_points);
  CHECK(sparse.potentials < sparse.grid_points);
  CHECK((resolution < 160 || sparse.settled > sparse.potentials));
  CHECK(dense.settled == 0);
  CHECK(sparse.iterated <= sparse.potentials);
  CHECK((iterations == 1 || sparse.iterated > 0));
  CHECK(sparse.vertices == mesh.vertices.size());
  CHECK(sparse.triangles == mesh.triangles.size());
  CHECK(sparse.open_edges == 0);
}

TEST_CASE("refined vertices lie where the set ends, closer with every halving") {
  const auto device = test::shared_device();
  Map map = test::armed_ball_map(60);
  for (Factor& factor : map.dynamics.factors) factor.exponent /= 0.05;
  map.dynamics.log_scale /= 0.05;
  const Field field(device, map, Precision::single, find_stop_radii(device, map));
  // How often a point a fiftieth of a cell to either side of a vertex, along its normal, is on the
  // side it should be.
  const auto right_sides = [&](int halvings) {
    SurfaceOptions options{64, 6, {}};
    options.refine = halvings;
    const TriangleMesh mesh = extract_surface(device, map, options);
    test::require_closed_manifold(mesh);
    const double step = mesh.box().size().maxCoeff() / 64 / 50;
    std::vector<Eigen::Vector3d> points;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
      const Eigen::Vector3d normal = mesh.normals[i].cast<double>();
      points.emplace_back(mesh.vertices[i] - step * normal);
      points.emplace_back(mesh.vertices[i] + step * normal);
    }
    const auto values = field.decided_at(on_slice(points, map.dynamics.slice), 6);
    double right = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      right += (values[i] < map.dynamics.surface_level) == (i % 2 == 0) ? 1 : 0;
    }
    return right / static_cast<double>(values.size());
  };
  const double plain = right_sides(0);
  const double refined = right_sides(8);
  CAPTURE(plain, refined);
  CHECK(refined > plain + 0.05);
}

TEST_CASE("normals point outward, across the surface") {
  const TriangleMesh mesh = extract_surface(test::shared_device(), square(), {64, 1, {}});
  REQUIRE(mesh.normals.size() == mesh.vertices.size());
  float least = 1;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    least = std::min(least, mesh.normals[i].dot(mesh.vertices[i].normalized().cast<float>()));
  }
  CHECK(least > 0.99F);
}

TEST_CASE("a set that is empty in the box gives no triangles") {
  Map map = square();
  map.dynamics.surface_level = -100;
  CHECK(extract_surface(test::shared_device(), map, {32, 1, {}}).triangles.empty());
}

TEST_CASE("a set may reach as far as its level says, and no farther than orbits are followed") {
  Map map = square();
  map.dynamics.surface_level = 5;  // F_1 = 2 ln |q|
  const TriangleMesh ball = extract_surface(test::shared_device(), map, {32, 1, {}});
  REQUIRE_FALSE(ball.vertices.empty());
  for (const auto& x : ball.vertices) CHECK(x.norm() == Catch::Approx(std::exp(2.5)).epsilon(0.01));
  map.dynamics.surface_level = 25;
  CHECK_THROWS_AS(extract_surface(test::shared_device(), map, {32, 1, {}}), InputError);
}

TEST_CASE("a stop request ends an extraction and a comparison") {
  const Device device = test::shared_device();
  std::stop_source source;
  const ProgressMonitor monitor{[&](const Progress& progress) {
                                  CHECK(progress.fraction < 1);
                                  source.request_stop();
                                },
                                source.get_token()};
  const SurfaceOptions options{192, 1, {}};
  CHECK_THROWS_AS(extract_surface(device, square(), options, monitor), Interrupted);
  CHECK_THROWS_AS(compare(device, square(), shapes::sphere(3), {32, 6}, monitor), Interrupted);
  CHECK_FALSE(extract_surface(device, square(), options).triangles.empty());
}

TEST_CASE("options out of range are refused by name") {
  CHECK_THROWS_AS((SurfaceOptions{1, 6, {}}).validate(), InputError);
  CHECK_THROWS_AS((SurfaceOptions{64, 0, {}}).validate(), InputError);
  CHECK_THROWS_AS((SurfaceOptions{64, 17, {}}).validate(), InputError);
  CHECK_THROWS_AS((SurfaceOptions{64, 1, Box{{0, 0, 0}, {1, 0, 1}}}).validate(), InputError);
  CHECK_THROWS_AS((SurfaceOptions{.resolution = 64, .iterations = 1, .refine = 21}).validate(),
                  InputError);
  CHECK_THROWS_AS((CompareOptions{4, 6}).validate(), InputError);
  CHECK_THROWS_AS((CompareOptions{64, -1}).validate(), InputError);
  CHECK_NOTHROW((CompareOptions{64, 1}).validate());
}

TEST_CASE("the ball of q² compares with spheres as balls do") {
  const auto device = test::shared_device();
  SECTION("its own") {
    const auto metrics = compare(device, square(), shapes::sphere(4), {48, 6});
    REQUIRE(metrics.size() == 2);
    CHECK(metrics[0].iterations == 1);
    CHECK(metrics[1].iterations == 6);
    for (const FitMetrics& m : metrics) {
      CHECK(m.iou > 0.97);
      CHECK(m.mean_distance < 0.003);
      CHECK(m.hausdorff_distance < 0.01);
      CHECK(m.roughness == Catch::Approx(1).epsilon(0.04));
    }
    CHECK(metrics[0].energy == Catch::Approx(ball_energy(1, 48)).epsilon(0.01));
    CHECK(metrics[1].energy < metrics[0].energy);
  }
  SECTION("one and a quarter times as wide") {
    const double r = 1.25;
    const FitMetrics m = compare(device, square(), shapes::sphere(4, r), {64, 1}).at(0);
    const double diagonal = 2 * r * std::sqrt(3.0);
    CHECK(m.iou == Catch::Approx(1 / (r * r * r)).epsilon(0.02));
    CHECK(m.mean_distance == Catch::Approx((r - 1) / diagonal).epsilon(0.03));
    CHECK(m.distance_95 == Catch::Approx((r - 1) / diagonal).epsilon(0.05));
    CHECK(m.hausdorff_distance == Catch::Approx((r - 1) / diagonal).epsilon(0.05));
    CHECK(m.slope_variation == Catch::Approx(0).margin(1e-3));  // ‖∇F_1‖ = 2/r, but for facets
    CHECK(m.roughness == Catch::Approx(1 / (r * r)).epsilon(0.02));
    CHECK(m.energy == Catch::Approx(ball_energy(r, 64)).margin(0.01));
  }
  SECTION("one beside it") {
    // 1/|x| over a unit sphere about c has mean 1 and mean square ln((1 + c)/(1 − c)) / 2c.
    TriangleMesh beside = shapes::sphere(4);
    for (auto& v : beside.vertices) v.x() += 0.5;
    const FitMetrics m = compare(device, square(), beside, {32, 1}).at(0);
    CHECK(m.slope_variation == Catch::Approx(std::sqrt(std::log(3.0) - 1)).epsilon(0.02));
    CHECK(m.distance_95 > m.mean_distance);
    CHECK(m.distance_95 < m.hausdorff_distance);
  }
  SECTION("nothing left of the set") {
    Map map = square();
    map.dynamics.surface_level = -100;
    const FitMetrics m = compare(device, map, shapes::sphere(3), {32, 1}).at(0);
    CHECK(m.iou == 0);
    CHECK(std::isnan(m.mean_distance));
    CHECK(m.roughness == 0);
    CHECK(to_json(m)["hausdorff_distance"].dump() == "null");
    CHECK(m.energy == Catch::Approx(0).margin(1e-6));
  }
}

TEST_CASE("what a mesh too thin for its cells leaves undefined is null, with the reason") {
  TriangleMesh plate = shapes::box();
  for (auto& v : plate.vertices) v.z() *= 0.01;
  Map map = square();
  const FitMetrics thin = compare(test::shared_device(), map, plate, {8, 1}).at(0);
  CHECK(std::isnan(thin.iou));
  CHECK(std::isnan(thin.energy));
  CHECK(std::isfinite(thin.mean_distance));
  CHECK(thin.roughness > 1);
  CHECK_THAT(why_undefined(thin), Catch::Matchers::ContainsSubstring("higher resolution"));
  map.dynamics.surface_level = -100;
  const FitMetrics nothing = compare(test::shared_device(), map, plate, {8, 1}).at(0);
  const auto json = to_json(nothing);
  for (const char* key : {"iou", "energy", "mean_distance", "distance_95", "roughness"}) {
    CHECK(json[key].dump() == "null");
  }
  CHECK(json["undefined"] == why_undefined(nothing));
  const FitMetrics good =
      compare(test::shared_device(), square(), shapes::sphere(3), {32, 1}).at(0);
  CHECK(why_undefined(good).empty());
  CHECK_FALSE(to_json(good).contains("undefined"));
}

TEST_CASE("a set that its grid misses has points, and one that is not there has none") {
  Map map = square();
  map.frame.box = Box{{-1, -1, -1}, {1, 1, 1}};
  map.dynamics.surface_level = -6;  // a ball of radius e⁻³ about the middle of a cell
  SurfaceOptions options{.resolution = 3, .iterations = 1};
  CHECK(extract_surface(test::shared_device(), map, options).triangles.empty());
  CHECK(has_points(test::shared_device(), map, options));
  options.box = Box{{0.5, 0.5, 0.5}, {1, 1, 1}};
  CHECK(extract_surface(test::shared_device(), map, options).triangles.empty());
  CHECK_FALSE(has_points(test::shared_device(), map, options));
}

TEST_CASE("a part is compared by what lies in it") {
  const Device device = test::shared_device();
  // The set is the unit ball; the mesh has a second ball, which only the whole misses.
  const TriangleMesh mesh =
      shapes::joined(shapes::sphere(4), shapes::moved(shapes::sphere(3), 0.5, {3, 0, 0}));
  CompareOptions options{64, 1};
  const FitMetrics whole = compare(device, square(), mesh, options).at(0);
  options.box = Box{{0, -1.2, -1.2}, {1.2, 1.2, 1.2}};
  const FitMetrics half = compare(device, square(), mesh, options).at(0);
  CHECK(whole.iou < 0.9);
  CHECK(half.iou > 0.98);
  CHECK(half.mean_distance < 0.1 * whole.mean_distance);
  CHECK(half.roughness == Catch::Approx(1).margin(0.02));
  // A part that holds no triangle's middle, of a mesh whose triangles are as large as it is.
  const TriangleMesh cube = shapes::box();
  const double corner = 1 / std::sqrt(3.0);
  options.box = Box{{-0.3, -0.3, 0.8}, {0, 0.3, 1.2}};
  const FitMetrics top = compare(device, square(), cube, options).at(0);
  CHECK(top.roughness > 1);  // the ball's cap over a flat face
  CHECK(top.roughness < 1 / corner);
  options.box = Box{{5, 5, 5}, {6, 6, 6}};
  CHECK_THROWS_WITH(compare(device, square(), mesh, options),
                    Catch::Matchers::ContainsSubstring("box: "));
  options.box = Box{{1, 0, 0}, {0, 1, 1}};
  CHECK_THROWS_WITH(compare(device, square(), mesh, options),
                    Catch::Matchers::ContainsSubstring("box: "));
}

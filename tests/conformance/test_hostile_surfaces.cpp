// Boxes, grids, sizes and triangles that nobody should give to surfaces, samples and their sinks.

#include <filesystem>

#include "hostile.hpp"
#include "original/original_file.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

using namespace qjulia;
using namespace qjulia::test;

namespace {

const Device& surface_device() { return test::shared_device(); }

/// Whether a box from (x, x, x) to (1, 1, 1) is one that coordinates of kernels have room for.
bool is_box(double x) { return is_near(x) && x < 1; }

}  // namespace

TEST_CASE("hostile boxes and radii of surfaces and samples are refused by name") {
  const Map map = good_map();
  const TemporaryFolder folder;
  for (const double x : kHostileNumbers) {
    CAPTURE(x);
    const Box box{{x, x, x}, {1, 1, 1}};
    takes(is_box(x), "sample_field", "box", [&] {
      std::size_t taken = 0;
      sample_field(surface_device(), map, small_sample(), {box, {2, 2, 2}}, CellOrder::z_fastest,
                   [&](std::span<const double> values) { taken += values.size(); });
      return taken == 8;
    });
    takes(is_box(x), "write_field", "box", [&] {
      const auto path = folder.path() / "field.npy";
      const SampleOptions options = changed(small_sample(), [&](auto& o) { o.box = box; });
      const CellGrid grid = write_field(surface_device(), map, options, path);
      CHECK(std::filesystem::remove(path));
      return grid.size() == 64;
    });
    takes(is_box(x), "extract_surface", "box", [&] {
      const SurfaceOptions options = changed(small_surface(), [&](auto& o) { o.box = box; });
      extract_surface(surface_device(), map, options).validate();
    });
    takes(is_box(x), "compare", "box", [&] {
      const CompareOptions options = changed(small_compare(), [&](auto& o) { o.box = box; });
      const FitMetrics metrics = compare(surface_device(), map, shapes::sphere(1), options).front();
      CHECK(to_json(metrics).at("iou") == metrics.iou);
      return is_within(metrics.iou, 0, 1);
    });
    // The set's own radius is about 3.
    const bool is_radius = is_within(x, 10, kLargestEscape);
    takes(is_radius, "extract_surface", "escape", [&] {
      const SurfaceOptions options = changed(small_surface(), [&](auto& o) { o.escape = x; });
      extract_surface(surface_device(), map, options);
    });
    takes(is_radius, "write_field", "escape", [&] {
      const SampleOptions options = changed(small_sample(), [&](auto& o) { o.escape = x; });
      write_field(surface_device(), map, options, folder.path() / "field.npy");
    });
    takes(is_radius, "has_points", "escape", [&] {
      const SurfaceOptions options = changed(small_surface(), [&](auto& o) { o.escape = x; });
      has_points(surface_device(), map, options);
    });
    const CellGrid grid{box, {2, 2, 2}};
    accepts("center", [&] { return grid.center(-1, 0, 99).allFinite() == std::isfinite(x); });
    takes(is_within(x, 0, 1), "Selection", "min_component",
          [&] { Selection{.min_component = x}.validate(); });
  }
  CHECK(folder.names().empty());
}

TEST_CASE("hostile resolutions of surfaces and samples are refused by name") {
  const Map map = good_map();
  for (const int n : kHostileCounts) {
    CAPTURE(n);
    const auto with = [&](auto options) {
      options.resolution = n;
      return options;
    };
    takes(is_within(n, 1, 8192), "sample_field", "cells along a side", [&] {
      std::size_t taken = 0;
      const CellGrid grid{{{-1, -1, -1}, {1, 1, 1}}, {n, 1, 1}};
      sample_field(surface_device(), map, small_sample(), grid, CellOrder::z_fastest,
                   [&](std::span<const double> values) { taken += values.size(); });
      return taken == grid.size();
    });
    takes(is_within(n, 1, 8192), "SampleOptions", "resolution",
          [&] { with(small_sample()).validate(); });
    takes(is_within(n, 2, 8192), "SurfaceOptions", "resolution",
          [&] { with(small_surface()).validate(); });
    takes(is_within(n, 0, 20), "SurfaceOptions", "refine",
          [&] { SurfaceOptions{.refine = n}.validate(); });
    takes(is_within(n, 8, 1024), "CompareOptions", "resolution",
          [&] { with(small_compare()).validate(); });
    refuses("mesh_of", "the distance field has 3 values", [&] {
      original::mesh_of({.samples = {n, n, n}, .values = {1, 2, 3}});
    });
  }
  for (const double x : kHostileNumbers) {
    const Eigen::Vector3d v(x, 0, 0);
    refuses("mesh_of", "the distance field's box has no size, or is not finite", [&] {
      original::mesh_of(
          {.samples = {2, 2, 2}, .center = v, .lengths = v, .values = std::vector(8, 1.0)});
    });
  }
}

TEST_CASE("sinks of surfaces take nothing that does not belong together") {
  const TemporaryFolder folder;
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
  refuses("vertices", "is not finite", [&] { sink.vertices({&kNowhere, 1}, {}); });
  accepts("drop_small_parts", [&] { sink.drop_small_parts(kNan); });
  accepts("drop_loose_pieces", [&] { return sink.drop_loose_pieces().count == 0; });
  MeshSink mesh;
  mesh.triangles(bad);
  mesh.vertices(points, {});
  refuses("validate", "triangles[0]", [&] { mesh.mesh.validate(); });
}

// How closely the filled Julia set itself follows a shape.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "qjulia/fit/fit.hpp"
#include "qjulia/surface/compare.hpp"
#include "shapes.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

/// An ellipsoid of half axes 1, 0.7 and 0.5, with bumps an eighth as high.
TriangleMesh bumpy_ellipsoid() {
  TriangleMesh mesh = shapes::sphere(5);
  for (auto& x : mesh.vertices) {
    const double bumps = std::sin(4 * x.x()) * std::sin(4 * x.y() + 1) * std::sin(4 * x.z() + 2);
    x = (1 + 0.25 * bumps) * x.cwiseProduct(Eigen::Vector3d(1, 0.7, 0.5));
  }
  return mesh;
}

}  // namespace

TEST_CASE("the sixth iterate's set of short fits has the shape at detail 2 %, and is rough") {
  const Device& device = test::shared_device();
  const TriangleMesh mesh = bumpy_ellipsoid();
  FitOptions options;
  options.factors = 64;
  options.max_evaluations = 200;
  options.schedule = "fast";
  options.detail = 0.02;
  CompareOptions comparing;
  comparing.resolution = 64;
  // The mean of some seeds, since one fit's IoU differs from another's by about 0.006.
  constexpr int kFits = 3;
  double iou_1 = 0;
  double iou_6 = 0;
  double roughness = 0;
  for (int seed = 1; seed <= kFits; ++seed) {
    options.seed = static_cast<std::uint64_t>(seed);
    const FitResult result = fit(device, mesh, options);
    const auto metrics = compare(device, result.map, mesh, comparing);
    REQUIRE(metrics.back().iterations == 6);
    iou_1 += metrics.front().iou / kFits;
    iou_6 += metrics.back().iou / kFits;
    roughness += metrics.back().roughness / kFits;
  }
  CAPTURE(iou_1, iou_6, roughness);
  // Reached: 0.977, 0.959 and 1.05. Vertices on interpolated differences made it 1.13.
  CHECK(iou_1 > 0.967);
  CHECK(iou_6 > 0.949);
  CHECK(roughness > 1.03);
}

#include "map_checks.hpp"

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>

#include "map/reference_iteration.hpp"
#include "picture/depth_source.hpp"
#include "picture/view.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

namespace qjulia::test {
namespace {

using Eigen::Vector3d;

double finite_or_large(double error) { return std::isfinite(error) ? error : 1e9; }

}  // namespace

std::vector<Quaternion> random_points(std::uint64_t seed, std::size_t count, double reach,
                                      double reach_w, const Vector3d& middle) {
  std::mt19937_64 bits(seed);
  std::vector<Quaternion> points(count);
  for (Quaternion& q : points) {
    q.x = middle.x() + uniform(bits, -reach, reach);
    q.y = middle.y() + uniform(bits, -reach, reach);
    q.z = middle.z() + uniform(bits, -reach, reach);
    q.w = uniform(bits, -reach_w, reach_w);
  }
  return points;
}

std::vector<double> sorted_errors(const Field& field, const Map& map,
                                  const std::vector<Quaternion>& points, int iterations) {
  const auto expected = reference::field(map, points, iterations, kUsualEscape);
  const auto found = field.at(points, iterations);
  std::vector<double> errors;
  for (std::size_t i = 0; i < points.size(); ++i) {
    errors.push_back(
        finite_or_large(std::abs(found[i] - expected[i]) / std::max(1.0, std::abs(expected[i]))));
  }
  std::ranges::sort(errors);
  return errors;
}

Quaternion reference_gradient(const Map& map, const Quaternion& q, double step) {
  const auto along = [&](const Quaternion& axis) {
    const auto f = reference::field(map, std::vector{q + step * axis, q - step * axis}, 1, 1e6);
    return (f[0] - f[1]) / (2 * step);
  };
  return {along({1, 0, 0, 0}), along({0, 1, 0, 0}), along({0, 0, 1, 0}), along({0, 0, 0, 1})};
}

std::vector<double> sorted_gradient_errors(const Field& field, const Map& map,
                                           const std::vector<Quaternion>& points, double step) {
  const auto gradients = field.gradient_at(points);
  std::vector<double> errors;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Quaternion expected = reference_gradient(map, points[i], step);
    errors.push_back(
        finite_or_large(norm(gradients[i] - expected) / std::max(1.0, norm(expected))));
  }
  std::ranges::sort(errors);
  return errors;
}

std::size_t wrongly_decided(const Map& map, const StopRadii& stops,
                            const std::vector<Quaternion>& points) {
  constexpr int kIterations = 6;
  const auto whole = reference::field(map, points, kIterations, kUsualEscape);
  const auto decided =
      Field(shared_device(), map, Precision::single, stops).decided_at(points, kIterations);
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if ((whole[i] < map.dynamics.surface_level) != (decided[i] < map.dynamics.surface_level))
      ++wrong;
  }
  return wrong;
}

MadeSurface checked_surface(const Device& device, const Map& map, SurfaceOptions options) {
  MadeSurface made;
  MeshSink sink;
  made.report = extract_surface(device, map, options, sink);
  made.mesh = std::move(sink.mesh);
  options.dense = true;
  REQUIRE(made.mesh.triangles.size() > 4000);
  CHECK(made.mesh.triangles == extract_surface(device, map, options).triangles);
  CHECK(made.report.open_edges == 0);
  return made;
}

void check_rays(const Device& device, const Map& map, const Box& framed, int iterations,
                const Camera& camera) {
  const auto source =
      picture::march_source(device, {map, iterations, {}, {}, Precision::single, Material::clay});
  constexpr int kPixels = 28;
  picture::View view = picture::camera_view(camera, framed, kPixels, kPixels, 1);
  view.footprint *= 0.1;  // steps as fine as those of larger pictures
  const auto depths = source->depths(view, 0, kPixels);
  const Field field(shared_device(), map, Precision::single,
                    {.escape = find_stop_radii(shared_device(), map).escape});
  const double middle = (view.eye - framed.center()).norm();
  const double near = middle - 0.5 * framed.diagonal(), far = middle + 0.5 * framed.diagonal();
  std::size_t hits = 0, through = 0, early = 0;
  for (int row = 0; row < kPixels; ++row) {
    for (int column = 0; column < kPixels; ++column) {
      const Vector3d direction =
          (view.dir + (column + 0.5) * view.dir_dx + (row + 0.5) * view.dir_dy).normalized();
      const auto depth =
          static_cast<double>(depths[static_cast<std::size_t>(row * kPixels + column)]);
      std::vector<Quaternion> points;
      std::vector<double> where;
      for (double depth_here = near; depth_here < far; depth_here += 0.0125) {
        where.push_back(depth_here);
        const Vector3d x = view.eye + where.back() * direction;
        points.push_back({x.x(), x.y(), x.z(), map.dynamics.slice});
      }
      const auto values = field.at(points, iterations);
      double first = -1;
      for (std::size_t k = 0; k < values.size() && first < 0; ++k) {
        if (values[k] < map.dynamics.surface_level) first = where[k];
      }
      hits += first >= 0 ? 1 : 0;
      if (first >= 0 && (depth < 0 || depth > first + 0.025)) ++through;
      if (depth >= 0 && first < 0) ++early;  // what is thinner than the steps here
    }
  }
  CAPTURE(hits, through, early);
  CHECK(hits > 120);
  CHECK(through <= hits / 50);
  CHECK(early <= hits / 10);
}

}  // namespace qjulia::test

#include <algorithm>
#include <array>
#include <cmath>

#include "check/checks.hpp"
#include "check/small_problems.hpp"
#include "map/reference_iteration.hpp"
#include "profile/workload.hpp"
#include "qjulia/map/field.hpp"

namespace qjulia::check {
namespace {

using profiling::kNoEscape;
using profiling::largest_difference;

double field(const Device& device, Precision precision) {
  const Map map = small_work().map;
  const auto points = grid_points(small_grid(), map.dynamics.slice);
  return largest_difference(
      Field(device, map, precision, {0, 0, kNoEscape}).at(points, kIterations),
      reference::field(map, points, kIterations, kNoEscape));
}

std::vector<double> flat(const std::vector<Quaternion>& all) {
  std::vector<double> numbers;
  for (const Quaternion& q : all) {
    const auto c = coordinates(q);
    numbers.insert(numbers.end(), c.begin(), c.end());
  }
  return numbers;
}

/// Versors, images, numbers of iterates and gradients. Twice iterated, rounding has not grown.
double field_queries(const Device& device, Precision precision) {
  constexpr int kTwice = 2;
  const Map map = small_work().map;
  const auto points = grid_points(small_grid(), map.dynamics.slice);
  const Field field(device, map, precision);
  std::vector<Quaternion> versors, images;
  std::vector<double> counts;
  for (const Quaternion& q : points) {
    const auto [log_norm, versor] = reference::step(map, q);
    versors.push_back(versor);
    images.push_back(norm(q) < kUsualEscape ? std::exp(log_norm) * versor : q);
    counts.push_back(norm(q) >= kUsualEscape ? 0 : norm(images.back()) < kUsualEscape ? 2 : 1);
  }
  const auto found = field.escape_counts_at(points, kTwice);
  return std::max(
      {largest_difference(flat(field.versors_at(points)), flat(versors)),
       largest_difference(flat(field.images_at(points)), flat(images)),
       largest_difference({found.begin(), found.end()}, counts),
       largest_difference(flat(field.gradient_at(points, kTwice)),
                          flat(reference::point_gradients(map, points, kTwice, kUsualEscape)))});
}

constexpr std::array kFieldChecks{
    Check{"field.cl", "F_4 at points, with the reference", 1e-4, 1e-10, field, true},
    Check{"field_queries.cl", "images and gradients at points, with the reference", 1e-4, 1e-10,
          field_queries},
};

}  // namespace

std::span<const Check> field_checks() { return kFieldChecks; }

}  // namespace qjulia::check

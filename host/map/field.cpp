#include "qjulia/map/field.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "base/range_check.hpp"
#include "device/point_batch.hpp"
#include "map/checks.hpp"
#include "map/cost.hpp"
#include "map/device_map.hpp"

namespace qjulia {

using namespace map;

using device::Argument;
using device::narrow;
using device::PointBatch;

namespace {

const Map& valid(const Map& map) {
  map.validate();
  return map;
}

void check(std::span<const Quaternion> points, int iterations) {
  base::expect_between("iterations", iterations, 1, kMostIterations);
  check_points(points);
}

Quaternion to_quaternion(const std::array<double, 4>& q) { return {q[0], q[1], q[2], q[3]}; }

/// q / |q|; `otherwise` where |q| is 0.
Quaternion unit(const Quaternion& q, const Quaternion& otherwise) {
  const double length = norm(q);
  return length > 0 ? 1 / length * q : otherwise;
}

/// R and F as images_at_points gives them. Beyond e^40 it shortens R.
Quaternion image_of(const std::array<double, 5>& found) {
  constexpr double kShortened = 40, kMost = 700;
  const Quaternion image{found[0], found[1], found[2], found[3]};
  return found[4] > kShortened ? std::exp(std::min(found[4], kMost)) * unit(image, image) : image;
}

}  // namespace

struct Field::Impl {
  DeviceMap map;
  std::stop_token stop;

  /// Launches a kernel over `count` points.
  /// @param inputs (i) → the kInputs reals of point i.
  /// @param more arguments of the kernel. @param take gets a point's number and what is found
  /// there.
  template <std::size_t kInputs, std::size_t kResults, class Inputs, class Take>
  void launch(const device::Kernel& kernel, std::size_t count, const Inputs& inputs,
              const PointWork& does, const std::vector<Argument>& more, const Take& take) const {
    PointBatch batch(map.context(), kernel, map.precision(), map.lanes(), does.cost);
    batch.run<kInputs, kResults>(
        count, inputs,
        [&](const PointBatch::Part& part) {
          std::vector<Argument> all{part.in, narrow(part.stride), narrow(part.items), map.buffer(),
                                    map.factors()};
          all.insert(all.end(), more.begin(), more.end());
          all.emplace_back(part.out);
          return device::PartCall{std::move(all),
                                  map.work(part.stride, does.slots, does.reals, does.at_most)};
        },
        take, 0, stop);
  }

  std::vector<double> evaluate(std::span<const Quaternion> points, int iterations,
                               bool decided) const {
    check(points, iterations);
    std::vector<double> field(points.size());
    launch<4, 1>(
        map.kernel("field.cl", "field_at_points"), points.size(),
        [&](std::size_t i) { return coordinates(points[i]); }, map.field_work(iterations),
        {iterations, decided ? 1 : 0},
        [&](std::size_t i, const std::array<double, 1>& f) { field[i] = f[0]; });
    return field;
  }

  /// Whether an orbit goes on from a point whose norm has this logarithm.
  bool goes_on(double log_norm) const {
    const double end = map.log_escape();
    return log_norm < (map.precision() == Precision::single ? static_cast<float>(end) : end);
  }

  using TakePoint = std::function<void(std::size_t, int, const Quaternion&, bool)>;
  /// Runs orbits, one iterate of all that have not ended at a time.
  /// @param take (i, j, q_j, whether it goes on) for each point after the start, of orbit i.
  void run_orbits(std::span<const Quaternion> starts, int iterations, const TakePoint& take) const {
    std::vector<Quaternion> at(starts.begin(), starts.end());
    std::vector<std::size_t> live;
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (goes_on(std::log(norm(at[i])))) live.push_back(i);
    }
    const device::Kernel kernel = map.kernel("field_queries.cl", "images_at_points");
    for (int j = 1; j <= iterations && !live.empty(); ++j) {
      std::vector<std::size_t> next;
      launch<4, 5>(
          kernel, live.size(), [&](std::size_t i) { return coordinates(at[live[i]]); },
          {map.step_cost(), cost::kStep, 9}, {},
          [&](std::size_t i, const std::array<double, 5>& found) {
            Quaternion& q = at[live[i]];
            q = image_of(found);
            if (goes_on(found[4])) next.push_back(live[i]);
            take(live[i], j, q, goes_on(found[4]));
          });
      live = std::move(next);
    }
  }

  /// ∂F_n/∂q, by reverse mode over the iterates of each orbit.
  void differentiate(std::span<const Quaternion> points, int iterations,
                     std::span<Quaternion> gradients) const {
    const auto row = static_cast<std::size_t>(iterations);
    std::vector<Quaternion> kept(points.size() * row);  // of each orbit, q_0 … q_{n-1}
    std::vector<int> executed(points.size(), 0);        // iterates of each
    for (std::size_t i = 0; i < points.size(); ++i) {
      kept[i * row] = points[i];
      executed[i] = goes_on(std::log(norm(points[i]))) ? 1 : 0;
    }
    run_orbits(points, iterations - 1, [&](std::size_t i, int j, const Quaternion& q, bool more) {
      kept[i * row + static_cast<std::size_t>(j)] = q;
      if (more) executed[i] = j + 1;
    });
    const auto with_more_than = [&](int iterates) {
      std::vector<std::size_t> orbits;
      for (std::size_t i = 0; i < points.size(); ++i) {
        if (executed[i] > iterates) orbits.push_back(i);
      }
      return orbits;
    };
    const std::vector<std::size_t> live = with_more_than(0);
    launch<4, 4>(
        map.kernel("field.cl", "field_gradient_at_points"), live.size(),
        [&](std::size_t i) {
          return coordinates(kept[live[i] * row + static_cast<std::size_t>(executed[live[i]] - 1)]);
        },
        {map.modulus_cost(), cost::kFieldGradient, 8}, {},
        [&](std::size_t i, const std::array<double, 4>& g) {
          gradients[live[i]] = to_quaternion(g);
        });
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (executed[i] == 0) gradients[i] = 1 / dot(points[i], points[i]) * points[i];
    }
    const device::Kernel kernel = map.kernel("field_queries.cl", "pull_back_at_points");
    for (std::size_t j = row - 1; j-- > 0;) {
      pull_back(kernel, with_more_than(static_cast<int>(j) + 1), std::span(kept).subspan(j), row,
                gradients);
    }
  }

  /// Takes gradients by q_{j+1} back to those by q_j, of the orbits with these numbers.
  /// @param orbits q_j and q_{j+1} are the first two in each row.
  void pull_back(const device::Kernel& kernel, const std::vector<std::size_t>& numbers,
                 std::span<const Quaternion> orbits, std::size_t row,
                 std::span<Quaternion> gradients) const {
    // Lengths stay here, where they cannot overflow.
    launch<12, 4>(
        kernel, numbers.size(),
        [&](std::size_t i) {
          const Quaternion* const q = &orbits[numbers[i] * row];
          std::array<double, 12> all{};
          std::ranges::copy(coordinates(q[0]), all.begin());
          std::ranges::copy(coordinates(unit(q[1], {1, 0, 0, 0})), all.begin() + 4);
          std::ranges::copy(coordinates(unit(gradients[numbers[i]], {})), all.begin() + 8);
          return all;
        },
        {2 * map.step_cost(), cost::kStep + cost::kPullBack, 16}, {},
        [&](std::size_t i, const std::array<double, 4>& found) {
          Quaternion& gradient = gradients[numbers[i]];
          const double length = norm(gradient) * norm(orbits[numbers[i] * row + 1]);
          gradient = length * to_quaternion(found);
        });
  }
};

Field::Field(const Device& device, const Map& map, Precision precision, const StopRadii& stops,
             std::stop_token stop)
    : impl_(std::make_shared<Impl>(Impl{{device, valid(map), stops, precision}, std::move(stop)})) {
}

std::vector<double> Field::at(std::span<const Quaternion> points, int iterations) const {
  return impl_->evaluate(points, iterations, false);
}

std::vector<double> Field::decided_at(std::span<const Quaternion> points, int iterations) const {
  return impl_->evaluate(points, iterations, true);
}

std::vector<Quaternion> Field::versors_at(std::span<const Quaternion> points) const {
  check_points(points);
  std::vector<Quaternion> versors(points.size());
  impl_->launch<4, 4>(
      impl_->map.kernel("field_queries.cl", "versors_at_points"), points.size(),
      [&](std::size_t i) { return coordinates(points[i]); },
      {impl_->map.step_cost(), cost::kVersorAlone, 8}, {},
      [&](std::size_t i, const std::array<double, 4>& u) { versors[i] = to_quaternion(u); });
  return versors;
}

std::vector<Quaternion> Field::images_at(std::span<const Quaternion> points, int iterations) const {
  check(points, iterations);
  std::vector<Quaternion> images(points.begin(), points.end());
  impl_->run_orbits(
      points, iterations,
      [&](std::size_t i, int /*j*/, const Quaternion& q, bool /*more*/) { images[i] = q; });
  return images;
}

std::vector<Quaternion> Field::orbits_at(std::span<const Quaternion> points, int iterations) const {
  check(points, iterations);
  const auto row = static_cast<std::size_t>(iterations) + 1;
  std::vector<Quaternion> orbits;
  orbits.reserve(points.size() * row);
  for (const Quaternion& q : points) orbits.insert(orbits.end(), row, q);
  impl_->run_orbits(points, iterations, [&](std::size_t i, int j, const Quaternion& q, bool more) {
    const auto from = static_cast<std::size_t>(j);
    std::fill_n(orbits.begin() + static_cast<std::ptrdiff_t>(i * row + from), more ? 1 : row - from,
                q);
  });
  return orbits;
}

std::vector<int> Field::escape_counts_at(std::span<const Quaternion> points, int iterations) const {
  check(points, iterations);
  std::vector<int> counts(points.size());
  impl_->launch<4, 1>(
      impl_->map.kernel("field_queries.cl", "escape_counts_at_points"), points.size(),
      [&](std::size_t i) { return coordinates(points[i]); },
      {impl_->map.field_work(iterations).cost, iterations * cost::kStep, 5, true}, {iterations},
      [&](std::size_t i, const std::array<double, 1>& n) {
        counts[i] = static_cast<int>(std::lround(n[0]));
      });
  return counts;
}

std::vector<Quaternion> Field::gradient_at(std::span<const Quaternion> points,
                                           int iterations) const {
  check(points, iterations);
  // In parts, since orbits are kept meanwhile.
  constexpr std::size_t kPart = 1 << 16;
  std::vector<Quaternion> gradients(points.size());
  for (std::size_t first = 0; first < points.size(); first += kPart) {
    const std::size_t count = std::min(kPart, points.size() - first);
    impl_->differentiate(points.subspan(first, count), iterations,
                         std::span(gradients).subspan(first, count));
  }
  return gradients;
}

std::vector<Quaternion> on_slice(std::span<const Eigen::Vector3d> points, double slice) {
  std::vector<Quaternion> quaternions(points.size());
  std::ranges::transform(points, quaternions.begin(), [slice](const Eigen::Vector3d& x) {
    return Quaternion{x.x(), x.y(), x.z(), slice};
  });
  return quaternions;
}

}  // namespace qjulia

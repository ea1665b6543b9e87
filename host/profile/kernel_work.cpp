#include "profile/kernel_work.hpp"

#include <algorithm>
#include <utility>

#include "layout/gradient_layout.h"
#include "layout/grid_block.h"
#include "layout/loss.h"
#include "layout/march.h"
#include "layout/panel_layout.h"
#include "layout/picture_layout.h"
#include "layout/placement.h"
#include "profile/cost.hpp"

namespace qjulia::profiling {
namespace {

using device::Launch;

// Slots of a factor at a point.
constexpr double kVersorAlone = cost::kStep - cost::kLog2 - cost::kTerm;  // U, where F is known
constexpr double kFieldGradient = cost::kDistance2 + 1 + 4;               // 1/N, four sums
constexpr double kJacobianEntry = cost::kDistance2 + cost::kLog2 + 1 + 1 + 4 + 5;  // weighted
constexpr double kPursuitEntry = cost::kDistance2 + cost::kLog2 + 1;
constexpr double kBounds = 2 * (cost::kDistance2 + 2 + cost::kLog2 + cost::kTerm);
// Slots of a point and a light (shade.cl): three coordinates in its map, cosine, three colours.
constexpr double kLightSight = 3 * 3 + 3 + 3;

/// Calls `take` with the struct of scalars of that type, in the launch's precision.
template <template <class> class Arguments, class Take>
auto with_arguments(const Launch& launch, std::size_t number, const Take& take) {
  if (launch.precision == Precision::dbl) return take(launch.as<Arguments<double>>(number));
  return take(launch.as<Arguments<float>>(number));
}

double real_bytes_of(const Launch& launch) {
  return static_cast<double>(device::real_bytes(launch.precision));
}

double work_items(const Launch& launch) {
  double items = 1;
  for (const std::size_t side : launch.range.global) items *= static_cast<double>(side);
  return items;
}

/// Points of so many work-items of a lane vector each.
double points_of(const Launch& launch, int groups) {
  return static_cast<double>(groups) * launch.lane_width;
}

/// The work on `points`: each has so many slots for each of so many factors, and so many reals.
LaunchWork over_factors(const Launch& launch, double points, int factors, double slots,
                        double reals, bool at_most = false) {
  return {points * factors * slots, points * reals * real_bytes_of(launch), at_most};
}

/// The work of kernels whose arithmetic is little beside what they read and write.
LaunchWork moving(const Launch& launch, double points, double reals) {
  return {0, points * reals * real_bytes_of(launch), false};
}

LaunchWork of_energy(const Launch& launch) {
  return with_arguments<qj_energy_arguments>(launch, 0, [&](const auto& a) {
    return over_factors(launch, a.stride, a.factors, cost::energy(a.iterations), cost::kEnergyReals,
                        a.iterations > 1);
  });
}

LaunchWork of_orbit_gradient(const Launch& launch) {
  return with_arguments<qj_energy_arguments>(launch, 0, [&](const auto& a) {
    return over_factors(launch, a.stride, a.factors, cost::gradient(a.iterations),
                        cost::kEnergyReals, true);
  });
}

/// The work of kernels with the arguments (…, stride, chunk, map, factors, …, rows), whose rows are
/// sums over samples.
LaunchWork of_sums(const Launch& launch, std::size_t stride, double slots) {
  const double points = launch.integer(stride);
  const int factors = launch.integer(stride + 3);
  LaunchWork work = over_factors(launch, points, factors, slots, cost::kPotentialGradientReals);
  const int columns = QJ_GRADIENT_COLUMNS(factors);
  work.bytes += static_cast<double>(launch.range.global[1]) * columns * real_bytes_of(launch);
  return work;
}

LaunchWork of_panels(const Launch& launch, double slots, bool is_pursuit) {
  return with_arguments<qj_panel_arguments>(launch, 0, [&](const auto& a) {
    const double order = is_pursuit ? QJ_PURSUIT_ORDER(a.count) : QJ_PANEL_ORDER(a.count);
    const auto blocks = static_cast<double>(launch.range.global[2]);
    return over_factors(launch, a.chunk * blocks, a.count, slots, order);
  });
}

/// (panels, chunk, order, …): the upper triangles of PᵀP.
LaunchWork of_products(const Launch& launch) {
  const double chunk = launch.integer(1), order = launch.integer(2);
  const auto count = static_cast<double>(launch.range.global[2]);
  return {count * chunk * order * (order + 1) / 2,
          count * (chunk * order + order * (order + 1)) * real_bytes_of(launch), false};
}

/// (blocks, count, chunk, …): each block's columns added up, component by component.
LaunchWork of_coarse_panels(const Launch& launch) {
  const double samples = double(launch.integer(0)) * launch.integer(2);
  const int entries = QJ_MAP_COMPONENTS * QJ_MAP_STRIDE(launch.integer(1));
  return {samples * entries, samples * (entries + QJ_MAP_COMPONENTS) * real_bytes_of(launch),
          false};
}

LaunchWork of_dense_level_set(const Launch& launch) {
  const int iterations = launch.integer(5);
  return over_factors(launch, points_of(launch, launch.integer(2)), launch.integer(4),
                      cost::energy(iterations), 1, iterations > 1);
}

LaunchWork of_field(const Launch& launch) {
  const int iterations = launch.integer(5);
  return over_factors(launch, points_of(launch, launch.integer(2)), launch.integer(4),
                      cost::energy(iterations), 5, iterations > 1);
}

/// (points, stride, groups, map, factors, …) with so many slots and reals.
LaunchWork of_points(const Launch& launch, double slots, double reals) {
  return over_factors(launch, points_of(launch, launch.integer(2)), launch.integer(4), slots,
                      reals);
}

/// The work of `of_points` where the arguments `groups` and `factors` have other numbers.
LaunchWork of_groups(const Launch& launch, std::size_t groups, std::size_t factors, double slots,
                     double reals) {
  return over_factors(launch, points_of(launch, launch.integer(groups)), launch.integer(factors),
                      slots, reals);
}

LaunchWork of_traits(const Launch& launch) {
  const double iterates = 4.0 * launch.integer(5);  // of four corners
  return over_factors(launch, points_of(launch, launch.integer(2)), launch.integer(4),
                      iterates * cost::kStep, 17, true);
}

LaunchWork of_lights(const Launch& launch, double reals, bool is_of_sky) {
  return with_arguments<qj_light_arguments>(launch, 0, [&](const auto& a) {
    const double receivers = is_of_sky && a.ground > 0 ? a.ground : a.receivers;
    return LaunchWork{receivers * (a.lights - a.lamps) * kLightSight,
                      receivers * (QJ_RECEIVER_SIZE + reals) * real_bytes_of(launch), true};
  });
}

using Counted = LaunchWork (*)(const Launch&);

/// Every kernel that commands launch. Those whose way depends on data beyond orbits' ends
/// (march_depth, place_vertices, nearest_distance, winding_number) are counted where they are
/// launched, and have here what they move at least.
const std::map<std::string_view, Counted>& counted_kernels() {
  static const std::map<std::string_view, Counted> all{
      {"energy_terms", of_energy},
      {"gradient_orbit", of_orbit_gradient},
      {"gradient_potential",
       [](const Launch& l) { return of_sums(l, 1, cost::kPotentialGradient); }},
      {"jacobian_squares", [](const Launch& l) { return of_sums(l, 1, kJacobianEntry); }},
      {"jacobian_panels", [](const Launch& l) { return of_panels(l, kJacobianEntry, false); }},
      {"pursuit_panels", [](const Launch& l) { return of_panels(l, kPursuitEntry, true); }},
      {"panel_products", of_products},
      {"panel_products_shared", of_products},
      {"coarse_panels", of_coarse_panels},
      {"sum_row_blocks",
       [](const Launch& l) { return moving(l, double(l.integer(1)) * l.integer(2), 1); }},
      {"nearest_distance",
       [](const Launch& l) { return moving(l, points_of(l, l.integer(2)), 4); }},
      {"winding_number", [](const Launch& l) { return moving(l, points_of(l, l.integer(2)), 4); }},
      {"field_at_points", of_field},
      {"field_gradient_at_points", [](const Launch& l) { return of_points(l, kFieldGradient, 8); }},
      {"versors_at_points", [](const Launch& l) { return of_points(l, kVersorAlone, 8); }},
      {"images_at_points", [](const Launch& l) { return of_points(l, cost::kStep, 9); }},
      {"escape_counts_at_points",
       [](const Launch& l) {
         return over_factors(l, points_of(l, l.integer(2)), l.integer(4),
                             l.integer(5) * cost::kStep, 5, true);
       }},
      {"pull_back_at_points",
       [](const Launch& l) { return of_points(l, cost::kStep + cost::kPullBack, 16); }},
      {"level_set_dense", of_dense_level_set},
      {"level_set_numbered", [](const Launch& l) { return of_groups(l, 3, 5, cost::kLogNorm, 6); }},
      {"level_set_points", [](const Launch& l) { return of_points(l, cost::kLogNorm, 5); }},
      {"level_set_advance", [](const Launch& l) { return of_groups(l, 5, 7, cost::kStep, 10); }},
      {"level_set_bounds", [](const Launch& l) { return of_groups(l, 2, 5, kBounds, 5); }},
      {"block_images", [](const Launch& l) { return of_groups(l, 5, 7, cost::kStep, 7); }},
      {"interpolate_rows",
       [](const Launch& l) { return moving(l, points_of(l, l.integer(7)), 36); }},
      {"settle_points", [](const Launch& l) { return moving(l, points_of(l, l.integer(7)), 2); }},
      {"cube_bounds", [](const Launch& l) { return of_groups(l, 2, 5, kBounds, 6); }},
      {"node_fields", [](const Launch& l) { return of_points(l, cost::kLogNorm, 5); }},
      {"node_versors", [](const Launch& l) { return of_points(l, kVersorAlone, 8); }},
      {"table_images", [](const Launch& l) { return moving(l, points_of(l, l.integer(2)), 9); }},
      // A level's images go on from those of the level before, but for one iterate.
      {"composed_images", [](const Launch& l) { return of_groups(l, 7, 9, cost::kStep, 9); }},
      {"trust_cells", [](const Launch& l) { return moving(l, l.integer(1), 8 * 5); }},
      {"look_up_points", [](const Launch& l) { return moving(l, l.integer(2), 5); }},
      {"look_up_rest",
       [](const Launch& l) {
         return over_factors(l, points_of(l, l.integer(5)), l.integer(7),
                             (l.integer(9) - l.integer(8)) * cost::kStep, 6, true);
       }},
      {"orbit_trait", of_traits},
      {"safe_steps", [](const Launch& l) { return of_groups(l, 3, 5, cost::kLogNorm, 2); }},
      {"grid_depth",
       [](const Launch& l) { return moving(l, double(l.integer(1)) * l.integer(3), 1); }},
      {"march_depth",
       [](const Launch& l) {
         return with_arguments<qj_march>(l, 2,
                                         [&](const auto& a) { return moving(l, a.count, 5); });
       }},
      {"place_vertices",
       [](const Launch& l) {
         return with_arguments<qj_placement>(l, 2,
                                             [&](const auto& a) { return moving(l, a.count, 7); });
       }},
      {"normals_of_depth",
       [](const Launch& l) { return moving(l, double(l.integer(1)) * l.integer(3), 4); }},
      {"sample_receivers",
       [](const Launch& l) { return moving(l, work_items(l), 4 + QJ_RECEIVER_SIZE); }},
      {"ground_receivers",
       [](const Launch& l) { return moving(l, work_items(l), 1 + QJ_RECEIVER_SIZE); }},
      {"sky_light", [](const Launch& l) { return of_lights(l, 6, true); }},
      {"ground_sky", [](const Launch& l) { return of_lights(l, 1, false); }},
      {"lamp_light",
       [](const Launch& l) { return moving(l, work_items(l), QJ_RECEIVER_SIZE + QJ_LAMP_SIZE); }},
      {"pixel_radiance", [](const Launch& l) { return moving(l, work_items(l), QJ_PIXEL_SIZE); }},
      {"develop_pixels",
       [](const Launch& l) { return moving(l, work_items(l), QJ_PIXEL_SIZE + 1); }},
      {"incident_light",
       [](const Launch& l) { return moving(l, work_items(l), QJ_RECEIVER_SIZE + 1); }},
  };
  return all;
}

}  // namespace

std::optional<LaunchWork> work_of(const Launch& launch) {
  const auto found = counted_kernels().find(launch.kernel);
  if (found == counted_kernels().end()) return std::nullopt;
  return found->second(launch);
}

void WorkCounter::launched(const Launch& launch) {
  const auto work = work_of(launch);
  const std::scoped_lock lock(counting_);
  KernelWork& all = work_[std::string(launch.kernel)];
  const bool is_double = launch.precision == Precision::dbl;
  // One that runs in both precisions is measured against the limit of single precision.
  all.is_double = is_double && (all.launches == 0 || all.is_double);
  ++all.launches;
  if (!work) return;
  all.is_known = true;
  all.slots += work->slots;
  all.bytes += work->bytes;
  all.at_most = all.at_most || work->at_most;
}

void WorkCounter::did(std::string_view kernel, const device::WalkedWork& work) {
  const std::scoped_lock lock(counting_);
  work_[std::string(kernel)].slots +=
      work.slots + work.fields * cost::kLogNorm + work.versors * kVersorAlone;
}

std::map<std::string, KernelWork> WorkCounter::work() const {
  const std::scoped_lock lock(counting_);
  return {work_.begin(), work_.end()};
}

void WorkCounter::reset() {
  const std::scoped_lock lock(counting_);
  work_.clear();
}

}  // namespace qjulia::profiling

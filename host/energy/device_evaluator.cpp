#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "device/context.hpp"
#include "device/launch_watch.hpp"
#include "energy/cost.hpp"
#include "energy/curvature.hpp"
#include "energy/evaluator.hpp"
#include "energy/panel_products.hpp"
#include "layout/gradient_layout.h"
#include "layout/loss.h"
#include "layout/panel_layout.h"
#include "map/device_map.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::energy {
namespace {

using device::Context;
using device::narrow;
using device::RealBuffer;

std::size_t divide_up(std::size_t a, std::size_t b) { return (a + b - 1) / b; }

/// How the work is cut. Nothing here depends on how many compute units there are, so that sums are
/// taken in the same order on any of them.
struct Division {
  std::size_t width;           ///< samples in a lane vector
  std::size_t stride;          ///< samples, padded
  std::size_t energy_vectors;  ///< vectors per work-item of energy_terms
  std::size_t gradient_chunk;  ///< samples per row of gradient_potential
  std::size_t orbit_items;     ///< most groups of gradient_orbit
  std::size_t orbit_group;     ///< work-items of such a group
  std::size_t panel_samples;   ///< samples in the panels at a time
  std::size_t panel_block;     ///< samples per work-item of jacobian_panels
  std::size_t energy_items() const { return divide_up(stride / width, energy_vectors); }
  std::size_t gradient_chunks() const { return divide_up(stride, gradient_chunk); }
  /// Vectors per work-item of gradient_orbit.
  std::size_t orbit_vectors() const { return divide_up(stride / width, orbit_items * orbit_group); }
  std::size_t orbit_groups() const {
    return divide_up(stride / width, orbit_vectors() * orbit_group);
  }
};

Division divide(std::size_t samples, const Tuning& tuning) {
  const auto count = [](int setting) { return static_cast<std::size_t>(setting); };
  Division d{};
  d.width = count(tuning.lane_width);
  d.stride = divide_up(std::max<std::size_t>(samples, 1), d.width) * d.width;
  d.energy_vectors = count(tuning.energy_vectors);
  d.gradient_chunk = std::clamp<std::size_t>(d.stride / count(tuning.gradient_rows), 128, 2048);
  d.orbit_items = count(tuning.orbit_items);
  d.orbit_group = count(tuning.orbit_group);
  d.panel_samples = count(tuning.panel_samples);
  d.panel_block = count(tuning.panel_block);
  return d;
}

class DeviceEvaluator final : public Evaluator {
 public:
  DeviceEvaluator(const Device& device, const Samples& samples, const EnergySettings& options,
                  Precision precision)
      : device_(device),
        options_(options),
        precision_(precision),
        samples_count_(samples.size()),
        division_(divide(samples.size(), device.tuning(precision))),
        products_(device_.context(), device.tuning(precision), precision) {
    Context& context = device_.context();
    const std::size_t stride = division_.stride;
    std::vector<double> arrays(QJ_SAMPLE_ARRAYS * stride, 0.0);
    for (std::size_t i = 0; i < stride; ++i) {
      // Padding repeats the last sample with weight 0.
      const std::size_t s = std::min(i, samples.size() - 1);
      arrays[QJ_SAMPLE_X * stride + i] = samples.position[s].x();
      arrays[QJ_SAMPLE_Y * stride + i] = samples.position[s].y();
      arrays[QJ_SAMPLE_Z * stride + i] = samples.position[s].z();
      arrays[QJ_SAMPLE_W * stride + i] = samples.off_slice[s];
      arrays[QJ_SAMPLE_WEIGHT * stride + i] = i < samples.size() ? samples.weight[s] : 0;
      arrays[QJ_SAMPLE_TARGET * stride + i] = samples.target[s];
      arrays[QJ_SAMPLE_SIDE * stride + i] = samples.side[s];
    }
    samples_ = context.upload_real(arrays, precision_);
    field_ = context.allocate_real(stride, precision_);
    cotangent_ = context.allocate_real(stride, precision_);
    energies_ = context.allocate_real(division_.energy_items(), precision_);
  }

  Evaluation evaluate(const Map& map, bool with_gradient) override {
    Evaluation result;
    if (with_gradient && options_.iterations > 1) {
      const std::size_t rows = run_orbits(map);
      result.gradient = sum_rows(rows, orbit_energies_, result.energy);
      return result;
    }
    run_energy(map);
    if (with_gradient) {
      const std::size_t rows = run_potential_gradient();
      std::vector<double> cotangents;
      std::vector<device::RealRead> more;
      if (device::launch_watch() != nullptr) {
        cotangents.resize(cotangent_.size());
        more.push_back({cotangent_, cotangents});
      }
      result.gradient = sum_rows(rows, energies_, result.energy, std::move(more));
      tell_potential_gradient(cotangents);
      return result;
    }
    std::vector<double> terms(energies_.size());
    device_.context().read(energies_, terms);
    result.energy = sum_of(terms);
    return result;
  }

  std::vector<double> field(const Map& map) override {
    run_energy(map);
    std::vector<double> values(division_.stride);
    device_.context().read(field_, values);
    values.resize(samples_count_);
    return values;
  }

  Eigen::MatrixXd gauss_newton(const Map& map) override {
    run_energy(map);
    const std::size_t order = QJ_PANEL_ORDER(factors_);
    const RealBuffer rows = device_.context().allocate_real(order * order, precision_);
    const std::size_t step = step_of(curvature_samples(order));
    const auto jacobian = kernel("gauss_newton.cl", "jacobian_panels");
    const std::size_t vectors = QJ_MAP_STRIDE(factors_) / division_.width;
    sum_products(order, step, rows, [&](std::size_t first) {
      device_.context().launch(jacobian,
                               {{vectors, division_.panel_samples / division_.panel_block, 1}},
                               {panel_arguments(map.dynamics.slice, factors_, step, first),
                                samples_, map_, field_, panels_},
                               panel_work(1, factors_, cost::kJacobianEntry, order));
    });
    return static_cast<double>(step) * to_symmetric(rows, order, places_of(factors_));
  }

  BlockCurvature gauss_newton_blocks(const Map& map, const NeighbourBlocks& blocks) override {
    run_energy(map);
    Context& context = device_.context();
    const std::size_t count = blocks.size();
    std::size_t most = 0;
    for (const auto& block : blocks) most = std::max(most, block.size());
    // Blocks are padded with factors of exponent 0, at the origin.
    const std::size_t size = QJ_MAP_SIZE(most), padded = QJ_MAP_STRIDE(most);
    std::vector<double> maps(count * size, 0.0), is_member(count * padded, 0.0);
    for (std::size_t b = 0; b < count; ++b) {
      double* const arrays = &maps[b * size + QJ_MAP_HEADER];
      for (std::size_t i = 0; i < blocks[b].size(); ++i) {
        const auto& [center, exponent] = map.dynamics.factors[blocks[b][i]];
        const auto at = coordinates(center);
        arrays[QJ_MAP_EXPONENT * padded + i] = exponent;
        for (std::size_t c = 0; c < 4; ++c) arrays[(QJ_MAP_CENTER_X + c) * padded + i] = at[c];
        is_member[b * padded + i] = 1;
      }
    }
    const RealBuffer sent = context.upload_real(maps, precision_);
    const RealBuffer members = context.upload_real(is_member, precision_);
    const std::size_t order = QJ_PANEL_ORDER(most), coarse_order = QJ_COARSE_ORDER(count);
    const RealBuffer own = context.allocate_real(count * order * order, precision_);
    const RealBuffer coarse = context.allocate_real(coarse_order * coarse_order, precision_);
    allocate_panels(count * order);
    const RealBuffer coarse_panels =
        context.allocate_real(division_.panel_samples * coarse_order, precision_);
    const auto jacobian = kernel("gauss_newton.cl", "jacobian_panels");
    const auto gather = kernel("gauss_newton.cl", "coarse_panels");
    const std::size_t samples = division_.panel_samples;
    const std::size_t items = samples / division_.panel_block;
    const std::size_t step =
        step_of(curvature_samples(1 + QJ_MAP_COMPONENTS * map.dynamics.factors.size()));
    const std::size_t taken = divide_up(division_.stride, step);
    for (std::size_t first = 0; first < taken; first += samples) {
      context.launch(
          jacobian, {{padded / division_.width, items, count}},
          {panel_arguments(map.dynamics.slice, most, step, first), samples_, sent, field_, panels_},
          panel_work(count, most, cost::kJacobianEntry, order));
      // Each block's columns are added up, component by component.
      const auto entries = static_cast<double>(QJ_MAP_COMPONENTS * padded);
      const auto gathered = static_cast<double>(count * samples);
      context.launch(
          gather, {{samples, count, 1}},
          {narrow(count), narrow(most), narrow(samples), members, panels_, coarse_panels},
          {gathered * entries,
           gathered * (entries + QJ_MAP_COMPONENTS),
           false,
           {.parts = count, .terms = most, .points = samples}});
      products_(panels_, samples, order, count, update_at(first), own);
      products_(coarse_panels, samples, coarse_order, 1, update_at(first), coarse);
    }
    panels_ = {};  // a whole stage of evaluations follows
    BlockCurvature result;
    result.blocks = blocks;
    std::vector<double> rows(count * order * order);
    context.read(own, rows);
    for (std::size_t b = 0; b < count; ++b) {
      std::vector<std::int32_t> place;
      for (std::size_t c = 0; c < QJ_MAP_COMPONENTS; ++c) {
        for (std::size_t i = 0; i < blocks[b].size(); ++i) place.push_back(narrow(c * padded + i));
      }
      result.own.push_back(static_cast<double>(step) *
                           to_symmetric({&rows[b * order * order], order * order}, order, place));
    }
    std::vector<std::int32_t> all(1 + QJ_MAP_COMPONENTS * count);
    std::iota(all.begin(), all.end(), 0);
    rows.resize(coarse_order * coarse_order);
    context.read(coarse, rows);
    result.coarse = static_cast<double>(step) * to_symmetric(rows, coarse_order, all);
    return result;
  }

  Eigen::MatrixXd pursuit_products(const Map& map,
                                   const std::vector<Quaternion>& centers) override {
    run_energy(map);
    const std::size_t count = centers.size();
    const std::size_t stride = QJ_MAP_STRIDE(count);
    std::vector<double> arrays(4 * stride, 1.0);  // padding: any place
    for (std::size_t i = 0; i < count; ++i) {
      const auto center = coordinates(centers[i]);
      for (std::size_t c = 0; c < 4; ++c) arrays[c * stride + i] = center[c];
    }
    const auto sent = device_.context().upload_real(arrays, precision_);
    const auto pursuit = kernel("gauss_newton.cl", "pursuit_panels");
    const std::size_t order = QJ_PURSUIT_ORDER(count);
    const RealBuffer rows = device_.context().allocate_real(order * order, precision_);
    const std::size_t step = step_of(curvature_samples(order));
    sum_products(order, step, rows, [&](std::size_t first) {
      device_.context().launch(
          pursuit, {{stride / division_.width, division_.panel_samples / division_.panel_block, 1}},
          {panel_arguments(map.dynamics.slice, count, step, first), samples_, sent, field_,
           panels_},
          panel_work(1, count, cost::kPursuitEntry, order));
    });
    std::vector<std::int32_t> place{QJ_PURSUIT_ONES(narrow(count)),
                                    QJ_PURSUIT_RESIDUALS(narrow(count))};
    for (std::size_t i = 0; i < count; ++i) place.push_back(narrow(i));
    return static_cast<double>(step) * to_symmetric(rows, order, place);
  }

  Eigen::VectorXd gauss_newton_diagonal(const Map& map) override {
    run_energy(map);
    const std::size_t rows = division_.gradient_chunks();
    const std::size_t vectors = QJ_MAP_STRIDE(factors_) / division_.width;
    device_.context().launch(kernel("gauss_newton.cl", "jacobian_squares"), {{vectors, rows, 1}},
                             {samples_, narrow(division_.stride), narrow(division_.gradient_chunk),
                              map_, narrow(factors_), loss(),
                              device::Argument::real(options_.alpha, precision_), field_, rows_},
                             sums_work(rows, cost::kJacobianEntry));
    const auto sums = sum_rows(rows);
    return Eigen::Map<const Eigen::VectorXd>(sums.data(), static_cast<Eigen::Index>(sums.size()));
  }

 private:
  std::int32_t loss() const { return static_cast<std::int32_t>(options_.loss); }

  /// The macros of the kernels that sum the energy.
  std::map<std::string, int> loss_defines() const {
    if (options_.loss == Loss::linear) return {{"QJ_LINEAR_LOSS", 1}};
    return {};
  }

  /// @param vectors of samples that each of `items` work-items, or groups of them, takes.
  device::Argument energy_arguments(std::size_t vectors, std::size_t items) const {
    return device::arguments(precision_, [&](auto r) {
      using real = decltype(r);
      return qj_energy_arguments<real>{.alpha = real(options_.alpha),
                                       .loss = loss(),
                                       .stride = narrow(division_.stride),
                                       .vectors = narrow(vectors),
                                       .items = narrow(items),
                                       .factors = narrow(factors_),
                                       .iterations = options_.iterations};
    });
  }

  /// @param count of factors or centres.
  /// @param step,first every step-th sample is taken, from the first-th such one.
  device::Argument panel_arguments(double slice, std::size_t count, std::size_t step,
                                   std::size_t first) const {
    return device::arguments(precision_, [&](auto r) {
      using real = decltype(r);
      return qj_panel_arguments<real>{.alpha = real(options_.alpha),
                                      .slice = real(slice),
                                      .loss = loss(),
                                      .stride = narrow(division_.stride),
                                      .step = narrow(step),
                                      .first = narrow(first),
                                      .chunk = narrow(division_.panel_samples),
                                      .block = narrow(division_.panel_block),
                                      .count = narrow(count)};
    });
  }

  /// A kernel's work at all samples.
  device::LaunchWork sample_work(double slots, double reals, bool at_most = false) const {
    const auto samples = static_cast<double>(division_.stride);
    return {samples * static_cast<double>(factors_) * slots,
            samples * reals,
            at_most,
            {.terms = factors_, .points = division_.stride}};
  }
  /// The work of kernels that fill rows with sums over samples.
  device::LaunchWork sums_work(std::size_t rows, double slots) const {
    device::LaunchWork work = sample_work(slots, cost::kPotentialGradientReals);
    const std::size_t columns = QJ_GRADIENT_COLUMNS(factors_);
    work.reals += static_cast<double>(rows * columns);
    return work;
  }
  /// The work of kernels that fill the panels of `blocks` matrices of this order, each for `count`
  /// factors or centres.
  device::LaunchWork panel_work(std::size_t blocks, std::size_t count, double slots,
                                std::size_t order) const {
    const auto samples = static_cast<double>(division_.panel_samples * blocks);
    return {samples * static_cast<double>(count) * slots,
            samples * static_cast<double>(order),
            false,
            {.parts = blocks, .terms = count, .points = division_.panel_samples}};
  }

  /// One sample in so many is taken for a matrix, so that there are at most `most`.
  std::size_t step_of(std::size_t most) const { return divide_up(division_.stride, most); }

  /// The column of each unknown in a gradient row, and its row and column in H.
  static std::vector<std::int32_t> places_of(std::size_t k) {
    std::vector<std::int32_t> place(1 + QJ_MAP_COMPONENTS * k);
    place[0] = narrow(QJ_GRADIENT_LOG_SCALE(k));
    for (std::size_t c = 0; c < QJ_MAP_COMPONENTS; ++c) {
      for (std::size_t i = 0; i < k; ++i) place[1 + c * k + i] = narrow(c * QJ_MAP_STRIDE(k) + i);
    }
    return place;
  }

  /// Sets the upper triangle of an order × order matrix, by rows, to PᵀP over every step-th sample.
  /// @param fill puts them, from number `first` of them on, into the panels P.
  template <class Fill>
  void sum_products(std::size_t order, std::size_t step, const RealBuffer& matrix,
                    const Fill& fill) {
    allocate_panels(order);
    const std::size_t taken = divide_up(division_.stride, step);
    for (std::size_t first = 0; first < taken; first += division_.panel_samples) {
      fill(first);
      products_(panels_, division_.panel_samples, order, 1, update_at(first), matrix);
    }
  }

  static PanelProducts::Update update_at(std::size_t first) {
    return first == 0 ? PanelProducts::Update::set : PanelProducts::Update::add;
  }

  /// Panels of fewer samples where the device has no memory for as many as asked for.
  void allocate_panels(std::size_t order) {
    if (panels_.size() >= division_.panel_samples * order) return;
    panels_ = {};
    Context& context = device_.context();
    const std::size_t least = std::lcm(division_.panel_block, kLeastPanelSamples);
    for (;;) {
      try {
        panels_ = context.allocate_real(division_.panel_samples * order, precision_);
        return;
      } catch (const DeviceError& error) {
        const std::size_t half = division_.panel_samples / 2;
        if (!device::is_out_of_memory(error) || half % least != 0 || half == 0) throw;
        division_.panel_samples = half;
      }
    }
  }

  Eigen::MatrixXd to_symmetric(const RealBuffer& matrix, std::size_t order,
                               const std::vector<std::int32_t>& place) const {
    std::vector<double> rows(order * order);
    device_.context().read(matrix, rows);
    return to_symmetric(rows, order, place);
  }

  /// The entries at `place` of an order × order matrix whose upper triangle is there, mirrored.
  static Eigen::MatrixXd to_symmetric(std::span<const double> rows, std::size_t order,
                                      const std::vector<std::int32_t>& place) {
    const auto n = static_cast<Eigen::Index>(place.size());
    Eigen::MatrixXd h(n, n);
    for (Eigen::Index i = 0; i < n; ++i) {
      for (Eigen::Index j = 0; j < n; ++j) {
        const auto [low, high] =
            std::minmax(place[static_cast<std::size_t>(i)], place[static_cast<std::size_t>(j)]);
        h(j, i) = rows[static_cast<std::size_t>(low) * order + static_cast<std::size_t>(high)];
      }
    }
    return h;
  }

  device::Kernel kernel(const char* file, const char* name,
                        std::map<std::string, int> defines = {}) const {
    return device_.context().kernel(
        file, name, {static_cast<int>(division_.width), precision_, std::move(defines)});
  }

  void upload(const Map& map) {
    if (map.dynamics.factors.size() != factors_) prepare(map.dynamics.factors.size());
    device_.context().write(map_, map::pack_map(map, {0, 0, options_.escape}));
  }

  void run_energy(const Map& map) {
    upload(map);
    const auto items = division_.energy_items();
    device_.context().launch(kernel("energy.cl", "energy_terms", loss_defines()), {{items, 1, 1}},
                             {energy_arguments(division_.energy_vectors, items), samples_, map_,
                              field_, cotangent_, energies_},
                             sample_work(cost::energy(options_.iterations), cost::kEnergyReals,
                                         options_.iterations > 1));
  }

  /// Everything that depends on the number of factors, once for all steps.
  void prepare(std::size_t factors) {
    Context& context = device_.context();
    factors_ = 0;  // should there be no memory for them
    map_ = context.allocate_real(QJ_MAP_SIZE(factors), precision_);
    const std::size_t columns = QJ_GRADIENT_COLUMNS(factors);
    if (options_.iterations > 1) {
      // Groups of fewer work-items where the device cannot take as many as asked for.
      while (division_.orbit_group > 1 &&
             context.largest_group(orbit_kernel()) < division_.orbit_group) {
        division_.orbit_group /= 2;
      }
      allocate_orbit_sums(factors);
    } else {
      rows_ = context.allocate_real(division_.gradient_chunks() * columns, precision_);
    }
    const std::size_t rows = rows_.size() / columns;
    panels_ = {};
    block_sums_ = context.allocate_real(divide_up(rows, kRowBlock) * columns, precision_);
    factors_ = factors;
  }

  /// From the cotangents that run_energy left. It leaves out samples whose cotangent is 0: where
  /// launches are watched, `tell_potential_gradient` says how many others there were.
  /// @return how many rows it fills.
  std::size_t run_potential_gradient() {
    const std::size_t rows = division_.gradient_chunks();
    const std::size_t vectors = QJ_MAP_STRIDE(factors_) / division_.width;
    device::LaunchWork work = sums_work(rows, cost::kPotentialGradient);
    work.at_most = true;
    if (device::launch_watch() != nullptr) work.slots = 0, work.at_most = false;
    device_.context().launch(kernel("gradient_potential.cl", "gradient_potential"),
                             {{vectors, rows, 1}},
                             {samples_, narrow(division_.stride), narrow(division_.gradient_chunk),
                              map_, narrow(factors_), cotangent_, rows_},
                             work);
    return rows;
  }

  void tell_potential_gradient(const std::vector<double>& cotangents) const {
    device::LaunchWatch* const watch = device::launch_watch();
    if (watch == nullptr) return;
    const auto used = std::ranges::count_if(cotangents, [](double l) { return l != 0; });
    watch->did("gradient_potential", static_cast<double>(used) * static_cast<double>(factors_) *
                                         cost::kPotentialGradient);
  }

  device::Kernel orbit_kernel() const {
    auto defines = loss_defines();
    defines.emplace("QJ_GROUP", narrow(division_.orbit_group));
    return kernel("gradient_orbit.cl", "gradient_orbit", std::move(defines));
  }

  /// Sums of fewer groups where the device has no memory for as many as asked for.
  void allocate_orbit_sums(std::size_t factors) {
    Context& context = device_.context();
    for (;;) {
      try {
        const std::size_t rows = division_.orbit_groups();
        // The Gauss-Newton diagonal uses them too, and its rows cannot be fewer.
        const std::size_t most_rows = std::max(rows, division_.gradient_chunks());
        rows_ = context.allocate_real(most_rows * QJ_GRADIENT_COLUMNS(factors), precision_);
        orbit_energies_ = context.allocate_real(rows, precision_);
        const std::size_t items = rows * division_.orbit_group * division_.width;
        const auto kept = static_cast<std::size_t>(options_.iterations - 1) * QJ_ORBIT_LANES;
        orbits_ = context.allocate_real(items * kept, precision_);
        // Groups that sum in local memory leave them alone.
        const std::size_t lanes = QJ_GRADIENT_LOG_SCALE(factors) * division_.width;
        lane_sums_ =
            context.allocate_real(division_.orbit_group == 1 ? rows * lanes : 1, precision_);
        return;
      } catch (const DeviceError& error) {
        if (!device::is_out_of_memory(error) || division_.orbit_items == 1) throw;
        division_.orbit_items /= 2;
      }
    }
  }

  /// Runs orbits forward and back: leaves the energies too. @return how many rows it fills.
  std::size_t run_orbits(const Map& map) {
    upload(map);
    const std::size_t rows = division_.orbit_groups();
    const std::size_t group = division_.orbit_group;
    device::Range range{{rows * group, 1, 1}, {}};
    if (group > 1) range.local = {group, 1, 1};
    try {
      device_.context().launch(orbit_kernel(), range,
                               {energy_arguments(division_.orbit_vectors(), rows), samples_, map_,
                                orbits_, lane_sums_, orbit_energies_, rows_},
                               sample_work(cost::gradient(options_.iterations), cost::kEnergyReals,
                                           /*at_most=*/true));
    } catch (const DeviceError& error) {
      if (!device::is_refused_group(error) || group == 1) throw;
      division_.orbit_group /= 2;
      factors_ = 0;  // other groups, other buffers
      return run_orbits(map);
    }
    return rows;
  }

  /// The rows summed, in the order of the unknowns, and the sum of the energies.
  /// @param more what is read in the same wait.
  std::vector<double> sum_rows(std::size_t rows, const RealBuffer& energies, double& energy,
                               std::vector<device::RealRead> more = {}) {
    std::vector<double> terms(energies.size());
    more.push_back({energies, terms});
    std::vector<double> gradient = sum_rows(rows, std::move(more));
    energy = sum_of(terms);
    return gradient;
  }

  /// @param more what is read in the same wait.
  std::vector<double> sum_rows(std::size_t rows, std::vector<device::RealRead> more = {}) {
    Context& context = device_.context();
    const std::size_t columns = QJ_GRADIENT_COLUMNS(factors_);
    const std::size_t blocks = divide_up(rows, kRowBlock);
    context.launch(kernel("reduce.cl", "sum_row_blocks"), {{columns, blocks, 1}},
                   {rows_, narrow(rows), narrow(columns), narrow(kRowBlock), block_sums_},
                   device::moving(static_cast<double>(rows * columns)));
    std::vector<double> sums(blocks * columns);
    more.push_back({block_sums_, sums});
    context.read(std::span<const device::RealRead>(more));
    std::vector<double> row(columns, 0.0), gradient;
    for (std::size_t b = 0; b < blocks; ++b) {
      for (std::size_t c = 0; c < columns; ++c) row[c] += sums[b * columns + c];
    }
    for (const std::int32_t at : places_of(factors_)) {
      gradient.push_back(row[static_cast<std::size_t>(at)]);
    }
    return gradient;
  }

  static double sum_of(const std::vector<double>& terms) {
    return std::accumulate(terms.begin(), terms.end(), 0.0);
  }

  static constexpr std::size_t kRowBlock = 64;
  static constexpr std::size_t kLeastPanelSamples =
      16;  // panel_products_shared takes so many a time

  Device device_;
  EnergySettings options_;
  Precision precision_;
  std::size_t samples_count_;
  Division division_;
  PanelProducts products_;
  RealBuffer samples_, field_, cotangent_, energies_, orbit_energies_;
  std::size_t factors_ = 0;
  RealBuffer map_, rows_, orbits_, lane_sums_, block_sums_, panels_;
};

}  // namespace

DeviceNeed device_need(std::size_t samples, std::size_t factors, const Tuning& tuning,
                       Precision precision) {
  const Division d = divide(samples, tuning);
  const std::uint64_t real = device::real_bytes(precision);
  const std::uint64_t sent = QJ_SAMPLE_ARRAYS * d.stride * real;
  const std::uint64_t rows = d.gradient_chunks() * QJ_GRADIENT_COLUMNS(factors) * real;
  return {std::max(sent, rows), sent + rows + 2 * d.stride * real};
}

std::unique_ptr<Evaluator> make_device_evaluator(const Device& device, const Samples& samples,
                                                 const EnergySettings& options,
                                                 Precision precision) {
  if (samples.size() == 0) throw std::logic_error("an evaluator needs samples");
  return std::make_unique<DeviceEvaluator>(device, samples, options, precision);
}

}  // namespace qjulia::energy

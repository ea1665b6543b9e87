#include "profile/jobs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "energy/cost.hpp"
#include "energy/evaluator.hpp"
#include "lattice/level_set.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/mesh/shape.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia::profiling {
namespace {

constexpr int kIterations = 4;
constexpr int kPictureIterations = 6;
/// At one iterate.
constexpr std::array<std::string_view, 5> kJobsOfFit{"energy", "gradient", "preconditioner",
                                                     "matrix_diagonal", "pursuit"};

/// Reals that a grid point takes: F, and for each further iterate the point and F, in and out.
constexpr double level_set_reals(int n) { return 1 + (n - 1) * 10.0; }

/// Iterates that run of each sample's n, on average: all of them, unless an orbit escapes.
double executed_iterates(const Device& device, const Workload& work, int n, Precision precision) {
  const Field field(device, work.map, precision, {0, 0, kNoEscape});
  const auto points = on_slice(work.samples.position, work.map.dynamics.slice);
  std::size_t executed = points.size();
  for (int m = 1; m < n; ++m) {
    executed += static_cast<std::size_t>(std::ranges::count_if(
        field.at(points, m), [](double f) { return f < std::log(kNoEscape); }));
  }
  return static_cast<double>(executed) / static_cast<double>(points.size());
}

bool fits(std::string_view name, std::string_view pattern) {
  if (pattern.empty()) return name.empty();
  if (pattern.front() == '*') {
    return fits(name, pattern.substr(1)) || (!name.empty() && fits(name.substr(1), pattern));
  }
  if (name.empty() || (pattern.front() != '?' && pattern.front() != name.front())) return false;
  return fits(name.substr(1), pattern.substr(1));
}

/// Makes jobs, as far as they are wanted.
class JobList {
 public:
  JobList(const Device& device, const ProfileOptions& options, std::vector<std::string>& left_out)
      : device_(device),
        options_(options),
        work_(std::make_shared<Workload>(make_workload(options))),
        left_out_(left_out) {}

  std::vector<Job> all() && {
    const int n = options_.iterations.value_or(kIterations);
    const bool has_factors = !work_->map.dynamics.factors.empty();
    if (has_factors) {
      for (const int m : {1, n}) add_energy(m);
      add_matrix();
    } else {
      left_out_.emplace_back("energy, gradient and matrix: the map has no factors");
    }
    add_distance();
    add_level_set(n);
    if (wants_all_jobs(options_)) add_surface();
    add_picture();
    return std::move(jobs_);
  }

 private:
  using Kernels = std::vector<std::string>;

  /// Whether a job of that name and n, or of any of these kernels, is asked for.
  bool is_wanted(const std::string& name, int n, const Kernels& kernels) const {
    const auto& jobs = options_.jobs;
    const bool is_of_fit = n == 1 && std::ranges::find(kJobsOfFit, name) != kJobsOfFit.end();
    if (!jobs.empty() && !fits_any(name, jobs) && !(is_of_fit && fits_any("fit", jobs))) {
      return false;
    }
    const auto& patterns = options_.kernels;
    if (patterns.empty() || fits_any(name, patterns)) return true;
    return std::ranges::any_of(kernels,
                               [&](const std::string& k) { return fits_any(k, patterns); });
  }

  void add_energy(int n) {
    const Kernels of_energy{"energy_terms"};
    const Kernels of_gradient =
        n == 1 ? Kernels{"energy_terms", "gradient_potential", "sum_row_blocks"}
               : Kernels{"gradient_orbit", "sum_row_blocks"};
    const bool energy = is_wanted("energy", n, of_energy);
    const bool gradient = is_wanted("gradient", n, of_gradient);
    if (!energy && !gradient) return;
    const std::shared_ptr<energy::Evaluator> evaluator =
        make_evaluator(device_, *work_, n, options_.precision);
    const double iterates = executed_iterates(device_, *work_, n, options_.precision);
    const std::size_t samples = work_->samples.size();
    const auto count = static_cast<double>(samples);
    const double energy_reals = cost::kEnergyReals * count;
    const double gradient_reals =
        energy_reals + (n == 1 ? cost::kPotentialGradientReals * count : 0);
    if (energy) {
      jobs_.push_back({"energy",
                       n,
                       samples,
                       iterates,
                       {cost::energy(n), energy_reals},
                       of_energy,
                       [evaluator, work = work_](const std::stop_token&) {
                         evaluator->evaluate(work->map, false);
                       }});
    }
    if (gradient) {
      jobs_.push_back({"gradient",
                       n,
                       samples,
                       iterates,
                       {cost::gradient(n), gradient_reals},
                       of_gradient,
                       [evaluator, work = work_](const std::stop_token&) {
                         evaluator->evaluate(work->map, true);
                       }});
    }
  }

  /// H = JᵀWJ, in multiply-adds of its upper triangle, and what a fit makes of it.
  void add_matrix() {
    const char* const product = device_.tuning(options_.precision).product_side > 1
                                    ? "panel_products_shared"
                                    : "panel_products";
    const Kernels of_matrix{"energy_terms", "jacobian_panels", product};
    const Kernels of_blocks{"energy_terms", "jacobian_panels", "coarse_panels", product};
    const Kernels of_diagonal{"jacobian_squares", "sum_row_blocks"};
    const Kernels of_pursuit{"pursuit_panels", product};
    const std::size_t factors = work_->map.dynamics.factors.size();
    const std::size_t samples =
        std::min<std::size_t>(work_->samples.size(), energy::curvature_samples(1 + 5 * factors));
    std::shared_ptr<energy::Evaluator> evaluator;
    const auto add = [&](const char* name, double slots, double reals, const Kernels& kernels,
                         const std::function<void(energy::Evaluator&, const Map&)>& run) {
      if (!is_wanted(name, 1, kernels)) return;
      if (!evaluator) {
        energy::Samples part;
        for (std::size_t i = 0; i < samples; ++i) part.add(work_->samples, i);
        evaluator = energy::make_device_evaluator(device_, part, {}, options_.precision);
      }
      jobs_.push_back(
          {name,
           1,
           samples,
           slots > 0 ? 1.0 : 0.0,
           {slots, reals},
           kernels,
           [evaluator, run, work = work_](const std::stop_token&) { run(*evaluator, work->map); }});
    };
    const double order = 1 + 5 * static_cast<double>(factors);
    const double slots = 0.5 * order * (order + 1) / static_cast<double>(factors);
    const double reals = cost::gauss_newton_reals(static_cast<double>(samples), order,
                                                  device_.tuning(options_.precision).panel_samples);
    const auto add_whole = [&] {
      add("gauss_newton", slots, reals, of_matrix,
          [](energy::Evaluator& e, const Map& map) { e.gauss_newton(map); });
    };
    if (!wants_all_jobs(options_)) return add_whole();
    // First, so that its kernels' rows are of the sizes that a fit has.
    const double damping = 1e-3;
    add("preconditioner", 0, 0, of_blocks, [damping](energy::Evaluator& e, const Map& map) {
      const auto blocks = energy::neighbour_blocks(map, energy::kFactorsOfBlock);
      const auto made = energy::preconditioner_of(e.gauss_newton_blocks(map, blocks), damping);
      made->gradient(made->move(Eigen::VectorXd::Ones(made->size())));
    });
    add_whole();
    add("matrix_diagonal", 0, 0, of_diagonal,
        [](energy::Evaluator& e, const Map& map) { e.gauss_newton_diagonal(map); });
    add("pursuit", 0, 0, of_pursuit, [](energy::Evaluator& e, const Map& map) {
      std::vector<Quaternion> centers;
      for (const Factor& f : map.dynamics.factors) centers.push_back(f.center);
      e.pursuit_products(map, centers);
    });
  }

  void add_distance() {
    const Kernels kernels{"nearest_distance", "winding_number"};
    if (!is_wanted("distance", 1, kernels)) return;
    constexpr int kRings = 72;
    auto mesh =
        std::make_shared<TriangleMesh>(options_.mesh ? *options_.mesh : make_sphere(kRings));
    auto points = std::make_shared<std::vector<Eigen::Vector3d>>(work_->samples.position);
    if (options_.mesh) {
      for (Eigen::Vector3d& x : *points) x = in_mesh_box(mesh->box(), x);
    }
    const auto distance = std::make_shared<SignedDistance>(device_, *mesh, options_.precision);
    jobs_.push_back(
        {"distance",
         1,
         points->size(),
         0,
         {},
         kernels,
         [distance, points](const std::stop_token& stop) { distance->at(*points, stop); }});
  }

  /// The workload's box moved onto the mesh's.
  Eigen::Vector3d in_mesh_box(const Box& box, const Eigen::Vector3d& x) const {
    const Eigen::Vector3d middle = box.center();
    return middle +
           (x - work_->box.center()) * (box.size().maxCoeff() / work_->box.size().maxCoeff());
  }

  void add_level_set(int n) {
    const Kernels kernels{"level_set_numbered", "level_set_advance"};
    if (!is_wanted("level_set", n, kernels)) return;
    const int side =
        static_cast<int>(std::lround(std::cbrt(static_cast<double>(work_->samples.size()))));
    const surface::Grid grid{
        work_->box.low, work_->box.size().maxCoeff() / side, {side, side, side}};
    const auto points = static_cast<std::size_t>(side) * static_cast<std::size_t>(side) *
                        static_cast<std::size_t>(side);
    const auto level_set = std::make_shared<surface::LevelSet>(
        device_, work_->map, StopRadii{0, 0, kNoEscape}, n, options_.precision);
    const Cost cost{cost::energy(n), level_set_reals(n) * static_cast<double>(points)};
    jobs_.push_back({"level_set", n, points, static_cast<double>(n), cost, kernels,
                     [level_set, grid](const std::stop_token&) {
                       level_set->over(grid, {{0, 0, 0}, grid.points});
                     }});
  }

  /// The map as it is, or, of the made-up one, a set that is bounded, and a ball in the main: a
  /// root at the origin makes it so.
  std::shared_ptr<const Map> drawn() const {
    auto map = std::make_shared<Map>(work_->map);
    if (!options_.map) map->dynamics.factors.front() = {{0, 0, 0, 0}, 4};
    return map;
  }

  void add_surface() {
    const Kernels kernels{"level_set_bounds",  "block_images",     "interpolate_rows",
                          "settle_points",     "level_set_points", "level_set_numbered",
                          "level_set_advance", "place_vertices"};
    SurfaceOptions surface;
    surface.iterations = options_.iterations.value_or(surface.iterations);
    if (!is_wanted("surface", surface.iterations, kernels)) return;
    surface.resolution = std::clamp(
        static_cast<int>(std::lround(2 * std::cbrt(static_cast<double>(work_->samples.size())))),
        16, 256);
    surface.precision = options_.precision;
    const auto side = static_cast<std::size_t>(surface.resolution);
    jobs_.push_back({"surface",
                     surface.iterations,
                     side * side * side,
                     0,
                     {},
                     kernels,
                     [device = device_, map = drawn(), surface](const std::stop_token& stop) {
                       ProgressMonitor monitor;
                       monitor.stop = stop;
                       extract_surface(device, *map, surface, monitor);
                     }});
  }

  void add_picture() {
    const Kernels kernels{
        "march_depth",      "safe_steps",       "grid_depth",     "normals_of_depth",
        "sample_receivers", "ground_receivers", "sky_light",      "ground_sky",
        "lamp_light",       "pixel_radiance",   "develop_pixels", "composed_images",
        "trust_cells",      "cube_bounds",      "node_fields",    "node_versors",
        "table_images",     "look_up_points",   "look_up_rest"};
    const int n = options_.iterations.value_or(kPictureIterations);
    if (!is_wanted("ray_march", n, kernels)) return;
    // 160 x 120 rays for the usual number of samples.
    constexpr double kUsualSamples = 125'000;
    const double scale =
        std::min(1.0, std::sqrt(static_cast<double>(options_.sample_points) / kUsualSamples));
    PictureOptions picture;
    picture.iterations = n;
    picture.width = std::max(16, static_cast<int>(std::lround(160 * scale)));
    picture.height = std::max(12, static_cast<int>(std::lround(120 * scale)));
    picture.samples = 1;
    picture.precision = options_.precision;
    const auto rays =
        static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
    jobs_.push_back({"ray_march",
                     picture.iterations,
                     rays,
                     0,
                     {},
                     kernels,
                     [device = device_, map = drawn(), picture](const std::stop_token& stop) {
                       ProgressMonitor monitor;
                       monitor.stop = stop;
                       render(device, *map, picture, monitor);
                     }});
  }

  Device device_;
  const ProfileOptions& options_;
  std::shared_ptr<const Workload> work_;
  std::vector<std::string>& left_out_;
  std::vector<Job> jobs_;
};

}  // namespace

bool fits_any(const std::string& name, const std::vector<std::string>& patterns) {
  return std::ranges::any_of(patterns, [&](const std::string& p) { return fits(name, p); });
}

bool wants_all_jobs(const ProfileOptions& options) {
  return options.map || !options.kernels.empty() || !options.jobs.empty();
}

std::vector<Job> jobs_of(const Device& device, const ProfileOptions& options,
                         std::vector<std::string>& left_out) {
  return JobList(device, options, left_out).all();
}

}  // namespace qjulia::profiling

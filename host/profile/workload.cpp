#include "profile/workload.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "base/random.hpp"
#include "device/context.hpp"

namespace qjulia::profiling {

KernelSeconds timed(const Device& device, const std::function<void()>& work) {
  device::Context& context = device.context();
  context.reset_kernel_times();
  const auto start = std::chrono::steady_clock::now();
  work();
  context.finish();
  KernelSeconds seconds;
  seconds.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const auto& [name, time] : context.kernel_times()) seconds.device += time.seconds;
  return seconds;
}

KernelsRun timed_by_kernel(const Device& device, const std::shared_ptr<const WorkerClock>& clock,
                           const std::function<void()>& work) {
  device::Context& context = device.context();
  // A trace that somebody else keeps goes on, and takes these launches too.
  const std::shared_ptr<Trace> kept = context.trace();
  const auto trace = kept ? kept : std::make_shared<Trace>();
  context.finish();
  if (!kept) device.record(trace);
  const std::size_t before = trace->events().size();
  std::optional<CpuSampler> sampler;
  if (clock) sampler.emplace(clock);
  const auto start = Trace::Clock::now();
  try {
    work();
    context.finish();
  } catch (...) {
    if (!kept) device.record({});
    throw;
  }
  KernelsRun run;
  const auto length = Trace::Clock::now() - start;
  run.wall = std::chrono::duration<double>(length).count();
  std::vector<CpuSample> samples;
  if (sampler) samples = sampler->samples();
  if (!kept) device.record({});
  trace->add("timed run", Trace::Row::host, Trace::Timer::wall, start, length);
  const auto began = start - std::chrono::nanoseconds(trace->events().back().start);
  std::vector<KernelSpan> spans;
  std::vector<KernelsRun::Kernel*> kernels;
  for (std::size_t i = before; i < trace->events().size(); ++i) {
    const Trace::Event& event = trace->events()[i];
    if (event.row == Trace::Row::host) continue;
    KernelsRun::Kernel& kernel = run.kernels[std::string(event.name)];
    ++kernel.launches;
    kernel.spent.seconds += 1e-9 * static_cast<double>(event.length);
    run.all.seconds += 1e-9 * static_cast<double>(event.length);
    spans.push_back(
        {began + std::chrono::nanoseconds(event.start), std::chrono::nanoseconds(event.length)});
    kernels.push_back(&kernel);
  }
  const std::vector<double> cpu = cpu_seconds_of(spans, samples, device.info().compute_units);
  for (std::size_t i = 0; i < cpu.size(); ++i) {
    kernels[i]->spent.cpu_seconds += cpu[i];
    run.all.cpu_seconds += cpu[i];
  }
  return run;
}

namespace {

/// Points in a map's box, weighted alike.
Workload workload_of(const Map& map, const ProfileOptions& options) {
  base::Random random(options.seed);
  Workload work;
  work.map = map;
  if (map.frame.box) work.box = map.frame.shape_to_map.to_map(*map.frame.box);
  for (std::size_t i = 0; i < options.sample_points; ++i) {
    Eigen::Vector3d x;
    for (int axis = 0; axis < 3; ++axis) {
      x[axis] = random.uniform(work.box.low[axis], work.box.high[axis]);
    }
    work.samples.add(x, 1 / static_cast<double>(options.sample_points), 0, 0);
  }
  return work;
}

}  // namespace

Workload make_workload(const ProfileOptions& options) {
  if (options.map) return workload_of(*options.map, options);
  base::Random random(options.seed);
  Workload work;
  const auto point = [&](double reach) {
    const double x = random.uniform(-reach, reach), y = random.uniform(-reach, reach);
    return Eigen::Vector3d(x, y, random.uniform(-reach, reach));
  };
  for (std::size_t i = 0; i < options.sample_points; ++i) {
    work.samples.add(point(1.5), 1 / static_cast<double>(options.sample_points), 0, 0);
  }
  constexpr double kRoots = 0.57;
  work.map.dynamics.log_scale = -0.1;
  for (std::size_t k = 0; k < options.factors; ++k) {
    const Eigen::Vector3d c = point(1);
    const double size = random.uniform(0.01, 0.06);
    const bool root = static_cast<double>(k) < kRoots * static_cast<double>(options.factors);
    work.map.dynamics.factors.push_back({{c.x(), c.y(), c.z(), 0}, root ? size : -size});
  }
  return work;
}

std::unique_ptr<energy::Evaluator> make_evaluator(const Device& device, const Workload& work,
                                                  int iterations, Precision precision) {
  return energy::make_device_evaluator(device, work.samples,
                                       {.iterations = iterations, .escape = kNoEscape}, precision);
}

TriangleMesh make_sphere(int rings) {
  TriangleMesh mesh;
  const int around = 2 * rings;
  const auto index = [&](int ring, int step) {
    return static_cast<std::uint32_t>(1 + (ring - 1) * around + step % around);
  };
  mesh.vertices.emplace_back(0, 0, 1);
  for (int ring = 1; ring < rings; ++ring) {
    const double polar = std::numbers::pi * ring / rings;
    for (int step = 0; step < around; ++step) {
      const double azimuth = 2 * std::numbers::pi * step / around;
      mesh.vertices.emplace_back(std::sin(polar) * std::cos(azimuth),
                                 std::sin(polar) * std::sin(azimuth), std::cos(polar));
    }
  }
  const auto south = static_cast<std::uint32_t>(mesh.vertices.size());
  mesh.vertices.emplace_back(0, 0, -1);
  for (int step = 0; step < around; ++step) {
    mesh.triangles.push_back({0, index(1, step), index(1, step + 1)});
    for (int ring = 1; ring + 1 < rings; ++ring) {
      mesh.triangles.push_back(
          {index(ring, step), index(ring + 1, step), index(ring + 1, step + 1)});
      mesh.triangles.push_back(
          {index(ring, step), index(ring + 1, step + 1), index(ring, step + 1)});
    }
    mesh.triangles.push_back({south, index(rings - 1, step + 1), index(rings - 1, step)});
  }
  return mesh;
}

const char* to_string(TuneJob job) {
  switch (job) {
    case TuneJob::energy:
      return "energy";
    case TuneJob::gradient:
      return "gradient";
    case TuneJob::orbit_energy:
      return "orbit_energy";
    case TuneJob::orbit_gradient:
      return "orbit_gradient";
    case TuneJob::gauss_newton:
      break;
  }
  return "gauss_newton";
}

double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double difference = 0, largest = std::numeric_limits<double>::min();
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double d = std::abs(a[i] - b[i]);
    if (std::isnan(d)) return std::numeric_limits<double>::infinity();
    difference = std::max(difference, d);
    largest = std::max(largest, std::abs(b[i]));
  }
  return difference / largest;
}

TuneBench::TuneBench(const Device& device, const Workload& work, Precision precision)
    : device_(device),
      map_(work.map),
      potential_(make_evaluator(device, work, 1, precision)),
      orbit_(make_evaluator(device, work, 4, precision)) {}

std::vector<double> TuneBench::run(TuneJob job) {
  if (job == TuneJob::gauss_newton) {
    const Eigen::MatrixXd h = potential_->gauss_newton(map_);
    return {h.data(), h.data() + h.size()};
  }
  const bool with_gradient = job == TuneJob::gradient || job == TuneJob::orbit_gradient;
  const bool with_orbit = job == TuneJob::orbit_energy || job == TuneJob::orbit_gradient;
  energy::Evaluation evaluation = (with_orbit ? orbit_ : potential_)->evaluate(map_, with_gradient);
  if (!with_gradient) return {evaluation.energy};
  return std::move(evaluation.gradient);
}

double TuneBench::time(TuneJob job) {
  return timed(device_, [&] { run(job); }).device;
}

}  // namespace qjulia::profiling

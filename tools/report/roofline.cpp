#include "report/roofline.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace qjulia::report {

Plot roofline(const ProfileReport& report) {
  const double ridge = report.limits.fma_per_second / report.limits.bytes_per_second;
  const double roof = 1e-9 * report.limits.fma_per_second;
  double farthest = 100 * ridge, slowest = roof / 20;
  Plot plot;
  plot.title = report.device.name;
  plot.x = {"slots (multiply-adds, multiplications, divisions) per byte of memory", true, {}};
  plot.y = {"G slots per second", true, {}};
  PlotSeries kernels;
  kernels.line = false;
  kernels.points = true;
  for (const KernelFigures& f : report.kernels) {
    if (!f.slots || !f.memory_bytes || !f.share_of_limit) continue;
    kernels.x.push_back(*f.slots / *f.memory_bytes);
    // It reached this share of the limits of its own runs, and is drawn at the same share of these.
    kernels.y.push_back(*f.share_of_limit * roof * std::min(1.0, kernels.x.back() / ridge));
    kernels.names.push_back(
        fmt::format("{}, n = {}: {:.0f} %", f.kernel, f.iterations, 100 * *f.share_of_limit));
    farthest = std::max(farthest, 4 * kernels.x.back());
    slowest = std::min(slowest, 0.5 * kernels.y.back());
  }
  const double nearest = 0.05 * ridge;
  plot.x.range = {nearest, farthest};
  plot.y.range = {slowest, 2 * roof};
  plot.series.push_back(
      {.label = fmt::format("copy, {:.1f} GB/s", 1e-9 * report.limits.bytes_per_second),
       .x = {nearest, ridge},
       .y = {0.05 * roof, roof}});
  plot.series.push_back({.label = fmt::format("multiply-adds, {:.1f} G/s", roof),
                         .x = {ridge, farthest},
                         .y = {roof, roof}});
  plot.series.push_back(std::move(kernels));
  return plot;
}

}  // namespace qjulia::report

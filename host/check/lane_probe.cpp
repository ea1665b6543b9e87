#include "check/lane_probe.hpp"

#include <cmath>
#include <limits>

#include "device/context.hpp"

namespace qjulia::check {

double on_host(LaneFunction function, double x, double y) {
  switch (function) {
    case LaneFunction::log2:
      return std::log2(x);
    case LaneFunction::exp:
      return std::exp(x);
    case LaneFunction::tanh:
      return std::tanh(x);
    case LaneFunction::angle:
      return std::atan2(x, y);
    case LaneFunction::sine:
      return std::sin(x);
    case LaneFunction::cosine:
      return std::cos(x);
    case LaneFunction::rsqrt:
      return 1 / std::sqrt(x);
    case LaneFunction::sum:
      break;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

LaneProbe::LaneProbe(const Device& device, int width, Precision precision)
    : device_(device.with_lane_width(width)), width_(width), precision_(precision) {}

std::vector<double> LaneProbe::operator()(LaneFunction function, const std::vector<double>& x,
                                          const std::vector<double>& y) const {
  device::Context& context = device_.context();
  const auto kernel =
      context.kernel("lane_math_probe.cl", "lane_math_probe", {width_, precision_, {}});
  const std::size_t groups = x.size() / static_cast<std::size_t>(width_);
  const auto out = context.allocate_real(x.size(), precision_);
  context.launch(kernel, {{groups, 1, 1}},
                 {context.upload_real(x, precision_), context.upload_real(y, precision_),
                  device::narrow(groups), static_cast<std::int32_t>(function), out},
                 device::kNotCounted);
  std::vector<double> values(x.size());
  context.read(out, values);
  return values;
}

double LaneProbe::rounded(double x) const {
  return precision_ == Precision::single ? static_cast<double>(static_cast<float>(x)) : x;
}

}  // namespace qjulia::check

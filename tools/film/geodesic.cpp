#include "film/geodesic.hpp"

#include <algorithm>
#include <cmath>

namespace qjulia::film {

Geodesic::Geodesic(double distance, double from, double to)
    : distance_(distance), from_(from), to_(to) {
  constexpr double kRho2 = kRho * kRho, kRho4 = kRho2 * kRho2;
  // Against either width so small a pan cannot be seen, and the formulae below would cancel.
  constexpr double kLeastPan = 1e-6;
  is_straight_ = distance < kLeastPan * std::min(from, to);
  if (is_straight_) {
    length_ = std::abs(std::log(to / from)) / kRho;
    return;
  }
  // r of the paper, −asinh b, in a form that does not cancel.
  const auto r = [&](double own, double sign) {
    const double b =
        (to * to - from * from + sign * kRho4 * distance * distance) / (2 * own * kRho2 * distance);
    return -std::asinh(b);
  };
  begin_ = r(from, 1);
  length_ = (r(to, -1) - begin_) / kRho;
}

Sight Geodesic::at(double way) const {
  if (is_straight_) return {way * distance_, from_ * std::pow(to_ / from_, way)};
  const double r = kRho * way * length_ + begin_;
  // w₀/ρ² (cosh r₀ tanh r − sinh r₀), as one quotient.
  const double panned = from_ / (kRho * kRho) * std::sinh(r - begin_) / std::cosh(r);
  return {std::clamp(panned, 0.0, distance_), from_ * std::cosh(begin_) / std::cosh(r)};
}

}  // namespace qjulia::film

#include "shape/morton.hpp"

namespace qjulia::shape {
namespace {

/// Spreads 21 bits to every third bit.
std::uint64_t spread(std::uint64_t v) {
  v = (v | v << 32) & 0x1f00000000ffffU;
  v = (v | v << 16) & 0x1f0000ff0000ffU;
  v = (v | v << 8) & 0x100f00f00f00f00fU;
  v = (v | v << 4) & 0x10c30c30c30c30c3U;
  return (v | v << 2) & 0x1249249249249249U;
}

std::uint64_t cell(double coordinate) {
  constexpr double kCells = 0x1fffff;
  const double place = (coordinate + 1) / 2 * kCells;
  if (!(place > 0)) return 0;
  return static_cast<std::uint64_t>(place < kCells ? place : kCells);
}

}  // namespace

std::uint64_t morton_code(const Eigen::Vector3d& x) {
  return spread(cell(x.x())) | spread(cell(x.y())) << 1 | spread(cell(x.z())) << 2;
}

}  // namespace qjulia::shape

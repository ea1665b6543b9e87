#include "fit/overlap.hpp"

#include "qjulia/field.hpp"

namespace qjulia {

Overlap::Overlap(const Device& device, const Shape& shape, const SignedDistance& distance)
    : device_(device) {
  constexpr int kCells = 48;
  constexpr double kMargin = 1.1;
  const Box box = shape.mesh.box();
  const double side = kMargin * box.size().maxCoeff();
  const Eigen::Vector3d corner = box.center() - Eigen::Vector3d::Constant(side / 2);
  std::vector<Eigen::Vector3d> points;
  for (int x = 0; x < kCells; ++x) {
    for (int y = 0; y < kCells; ++y) {
      for (int z = 0; z < kCells; ++z) {
        points.emplace_back(corner + side / kCells * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5));
      }
    }
  }
  for (const double d : distance.at(points)) inside_.push_back(d < 0);
  points_ = on_slice(points, 0);
}

double Overlap::operator()(const RationalMap& map, int iterations) const {
  const auto field = Field(device_, map).at(points_, iterations);
  std::size_t both = 0;
  std::size_t either = 0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const bool in_map = field[i] < map.surface_level;
    both += in_map && inside_[i];
    either += in_map || inside_[i];
  }
  return either == 0 ? 0 : static_cast<double>(both) / static_cast<double>(either);
}

}  // namespace qjulia

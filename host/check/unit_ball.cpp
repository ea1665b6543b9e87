#include "check/unit_ball.hpp"

#include <cmath>

namespace qjulia::check {

Map unit_ball() {
  Map map;
  map.dynamics.factors = {Factor{{0, 0, 0, 0}, 2}};
  map.frame.box = Box{Eigen::Vector3d::Constant(-1), Eigen::Vector3d::Constant(1)};
  return map;
}

Eigen::Vector3d ray_direction(const picture::View& view, int column, int row) {
  return (view.dir + (column + 0.5) * view.dir_dx + (row + 0.5) * view.dir_dy).normalized();
}

Eigen::Vector3d ray_start(const picture::View& view, int column, int row) {
  return view.eye + (column + 0.5) * view.eye_dx + (row + 0.5) * view.eye_dy;
}

double sphere_depth(const picture::View& view, int column, int row) {
  const Eigen::Vector3d start = ray_start(view, column, row);
  const Eigen::Vector3d direction = ray_direction(view, column, row);
  const double middle = -start.dot(direction);
  const double half2 = middle * middle - start.squaredNorm() + 1;
  return half2 < 0 ? -1 : middle - std::sqrt(half2);
}

}  // namespace qjulia::check

#include "energy/curvature.hpp"

#include <Eigen/Cholesky>

namespace qjulia::energy {

using Eigen::Index;

Eigen::VectorXd unit_scale(const Eigen::VectorXd& diagonal, double damping) {
  const double floor = 1e-9 * diagonal.mean() + 1e-300;
  return (diagonal.array() * (1 + damping) + floor).sqrt().inverse();
}

CurvatureFactor factorised(const Eigen::MatrixXd& h, double damping) {
  const Eigen::VectorXd scale = unit_scale(h.diagonal(), damping);
  const Index n = h.rows();
  Eigen::MatrixXd matrix(n, n);
  with_enough_damping(damping, [&](double more) {
    for (Index j = 0; j < n; ++j) {
      const double by = scale[j] / more;
      for (Index i = j + 1; i < n; ++i) matrix(i, j) = h(i, j) * scale[i] * by;
      matrix(j, j) = 1;
    }
    const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> in_place(matrix);
    return in_place.info() == Eigen::Success;
  });
  return {scale, matrix.cast<float>()};
}

Eigen::VectorXd CurvatureSum::faded(std::size_t factors, const std::vector<std::size_t>& moved) {
  const auto k = static_cast<Index>(factors);
  const bool is_first = weight.size() == 0;
  if (is_first) weight = Eigen::VectorXd::Zero(1 + 5 * k);
  Eigen::VectorXd kept = Eigen::VectorXd::Constant(1 + 5 * k, kKept);
  for (const std::size_t i : moved) {
    for (Index component = 0; component < 5; ++component) {
      kept[1 + component * k + static_cast<Index>(i)] = 0;
    }
  }
  weight = weight.cwiseProduct(kept).array() + 1;
  return is_first ? Eigen::VectorXd() : Eigen::VectorXd(kept.cwiseSqrt());
}

}  // namespace qjulia::energy

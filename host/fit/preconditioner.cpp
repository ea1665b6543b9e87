#include "fit/preconditioner.hpp"

namespace qjulia::fitting {

Eigen::VectorXd Preconditioner::move(const Eigen::VectorXd& u) const {
  if (factor_.lower.size() == 0) return u.cwiseProduct(factor_.scale);
  const Eigen::VectorXf solved =
      lower().transpose().triangularView<Eigen::Upper>().solve(u.cast<float>());
  return solved.cast<double>().cwiseProduct(factor_.scale);
}

Eigen::VectorXd Preconditioner::gradient(const Eigen::VectorXd& g) const {
  Eigen::VectorXd scaled = g.cwiseProduct(factor_.scale);
  if (factor_.lower.size() == 0) return scaled;
  return lower().triangularView<Eigen::Lower>().solve(scaled.cast<float>()).cast<double>();
}

}  // namespace qjulia::fitting

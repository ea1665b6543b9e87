#include "fit/preconditioner.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace qjulia {

Preconditioner::Preconditioner(const Eigen::MatrixXd& matrix,
                               const std::vector<std::size_t>& active, double damping) {
  const auto n = static_cast<Eigen::Index>(active.size());
  const auto at = [&](Eigen::Index i) {
    return static_cast<Eigen::Index>(active[static_cast<std::size_t>(i)]);
  };
  Eigen::VectorXd diagonal(n);
  for (Eigen::Index i = 0; i < n; ++i) diagonal[i] = matrix(at(i), at(i));
  // An unknown without effect on any sample (a centre of exponent 0, say) keeps a small share.
  const double floor = 1e-9 * diagonal.mean() + 1e-300;
  scale_ = (diagonal.array() * (1 + damping) + floor).sqrt().inverse();
  Eigen::MatrixXd scaled(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i) {
      scaled(i, j) = matrix(at(i), at(j)) * scale_[i] * scale_[j];
    }
    scaled(j, j) = 1;
  }
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> cholesky(scaled);
  // Rounding in H can cost the last digits of positiveness: more damping restores it.
  for (double more = damping; cholesky.info() != Eigen::Success && more < 1; more *= 10) {
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j; i < n; ++i) {
        scaled(i, j) = matrix(at(i), at(j)) * scale_[i] * scale_[j] / (1 + more);
      }
      scaled(j, j) = 1;
    }
    cholesky.compute(scaled);
  }
  factor_ = scaled.cast<float>();
}

Eigen::VectorXd Preconditioner::move(const Eigen::VectorXd& u) const {
  const Eigen::VectorXf solved =
      factor_.transpose().triangularView<Eigen::Upper>().solve(u.cast<float>());
  return solved.cast<double>().cwiseProduct(scale_);
}

Eigen::VectorXd Preconditioner::gradient(const Eigen::VectorXd& g) const {
  const Eigen::VectorXf scaled = g.cwiseProduct(scale_).cast<float>();
  return factor_.triangularView<Eigen::Lower>().solve(scaled).cast<double>();
}

}  // namespace qjulia

#include "fit/preconditioner.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace qjulia::fitting {

Preconditioner::Preconditioner(const Eigen::VectorXd& diagonal, double damping) {
  // A variable without effect on any sample (a centre of exponent 0, say) keeps a small share.
  const double floor = 1e-9 * diagonal.mean() + 1e-300;
  scale_ = (diagonal.array() * (1 + damping) + floor).sqrt().inverse();
}

Preconditioner::Preconditioner(const Eigen::MatrixXd& matrix, double damping)
    : Preconditioner(Eigen::VectorXd(matrix.diagonal()), damping) {
  const Eigen::Index n = matrix.rows();
  Eigen::MatrixXd scaled(n, n);
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i) {
      scaled(i, j) = matrix(i, j) * scale_[i] * scale_[j];
    }
    scaled(j, j) = 1;
  }
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> cholesky(scaled);
  // Rounding in H can cost the last digits of positiveness: more damping restores it.
  for (double more = damping; cholesky.info() != Eigen::Success && more < 1; more *= 10) {
    for (Eigen::Index j = 0; j < n; ++j) {
      for (Eigen::Index i = j; i < n; ++i) {
        scaled(i, j) = matrix(i, j) * scale_[i] * scale_[j] / (1 + more);
      }
      scaled(j, j) = 1;
    }
    cholesky.compute(scaled);
  }
  factor_ = scaled.cast<float>();
}

Eigen::VectorXd Preconditioner::move(const Eigen::VectorXd& u) const {
  if (factor_.size() == 0) return u.cwiseProduct(scale_);
  const Eigen::VectorXf solved =
      factor_.transpose().triangularView<Eigen::Upper>().solve(u.cast<float>());
  return solved.cast<double>().cwiseProduct(scale_);
}

Eigen::VectorXd Preconditioner::gradient(const Eigen::VectorXd& g) const {
  if (factor_.size() == 0) return g.cwiseProduct(scale_);
  const Eigen::VectorXf scaled = g.cwiseProduct(scale_).cast<float>();
  return factor_.triangularView<Eigen::Lower>().solve(scaled).cast<double>();
}

}  // namespace qjulia::fitting

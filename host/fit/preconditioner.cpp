#include "fit/preconditioner.hpp"

#include <cmath>

namespace qjulia::fitting {

Preconditioner::Preconditioner(const Eigen::VectorXd& diagonal, double damping) {
  // A variable without effect on any sample (a centre of exponent 0, say) keeps a small share.
  const double floor = 1e-9 * diagonal.mean() + 1e-300;
  scale_ = (diagonal.array() * (1 + damping) + floor).sqrt().inverse();
}

Preconditioner::Preconditioner(const Eigen::MatrixXd& matrix, double damping,
                               const std::function<bool(Eigen::MatrixXd&)>& factorise)
    : Preconditioner(Eigen::VectorXd(matrix.diagonal()), damping) {
  const Eigen::Index n = matrix.rows();
  Eigen::MatrixXd scaled(n, n);
  // The lower triangle with unit diagonal, what is beside it divided by `more`.
  const auto fill = [&](double more) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const double by = scale_[j] / more;
      for (Eigen::Index i = j + 1; i < n; ++i) scaled(i, j) = matrix(i, j) * scale_[i] * by;
      scaled(j, j) = 1;
    }
  };
  fill(1);
  // Rounding in H can cost the last digits of positiveness: more damping restores it.
  bool is_positive = factorise(scaled);
  for (double more = damping; !is_positive && more < 1; more *= 10) {
    fill(1 + more);
    is_positive = factorise(scaled);
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

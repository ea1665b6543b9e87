#include "energy/preconditioner.hpp"

#include <utility>

namespace qjulia::energy {
namespace {

using Eigen::VectorXd;

class FactorPreconditioner final : public Preconditioner {
 public:
  explicit FactorPreconditioner(CurvatureFactor factor) : factor_(std::move(factor)) {}

  /// L's triangle, n × n.
  auto lower() const {
    return factor_.lower.topLeftCorner(factor_.scale.size(), factor_.scale.size());
  }

  VectorXd move(const VectorXd& u) const override {
    const Eigen::VectorXf solved =
        lower().transpose().triangularView<Eigen::Upper>().solve(u.cast<float>());
    return solved.cast<double>().cwiseProduct(factor_.scale);
  }

  VectorXd gradient(const VectorXd& g) const override {
    const VectorXd scaled = g.cwiseProduct(factor_.scale);
    return lower().triangularView<Eigen::Lower>().solve(scaled.cast<float>()).cast<double>();
  }

 private:
  CurvatureFactor factor_;
};

class DiagonalPreconditioner final : public Preconditioner {
 public:
  explicit DiagonalPreconditioner(VectorXd scale) : scale_(std::move(scale)) {}

  VectorXd move(const VectorXd& u) const override { return u.cwiseProduct(scale_); }
  VectorXd gradient(const VectorXd& g) const override { return g.cwiseProduct(scale_); }

 private:
  VectorXd scale_;
};

}  // namespace

std::unique_ptr<Preconditioner> preconditioner_of(CurvatureFactor factor) {
  return std::make_unique<FactorPreconditioner>(std::move(factor));
}

std::unique_ptr<Preconditioner> preconditioner_of_diagonal(const VectorXd& diagonal,
                                                           double damping) {
  return std::make_unique<DiagonalPreconditioner>(unit_scale(diagonal, damping));
}

}  // namespace qjulia::energy

#include "energy/preconditioner.hpp"

#include <utility>

namespace qjulia::energy {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

class FactorPreconditioner final : public Preconditioner {
 public:
  explicit FactorPreconditioner(CurvatureFactor factor) : factor_(std::move(factor)) {}

  Index size() const override { return factor_.scale.size(); }
  VectorXd move(const VectorXd& u) const override { return factor_.move(u); }
  VectorXd gradient(const VectorXd& g) const override { return factor_.gradient(g); }

 private:
  CurvatureFactor factor_;
};

class TwoLevelPreconditioner final : public Preconditioner {
 public:
  TwoLevelPreconditioner(const BlockCurvature& curvature, double damping)
      : coarse_(factorised(curvature.coarse, damping)) {
    for (const auto& block : curvature.blocks) factors_ += block.size();
    for (std::size_t b = 0; b < curvature.blocks.size(); ++b) {
      own_.push_back(
          {variables_of(curvature.blocks[b], factors_), factorised(curvature.own[b], damping)});
    }
  }

  Index size() const override { return 5 * static_cast<Index>(factors_) + coarse_.scale.size(); }

  VectorXd move(const VectorXd& u) const override {
    VectorXd result(1 + 5 * static_cast<Index>(factors_));
    const VectorXd together = coarse_.move(u.tail(coarse_.scale.size()));
    result[0] = together[0];
    Index first = 0, coarse = 1;
    for (const Block& block : own_) {
      const Index n = block.factor.scale.size(), members = n / 5;
      const VectorXd apart = block.factor.move(u.segment(first, n));
      for (Index i = 0; i < n; ++i) {
        result[block.variables[static_cast<std::size_t>(i)]] =
            apart[i] + together[coarse + i / members];
      }
      first += n;
      coarse += 5;
    }
    return result;
  }

  VectorXd gradient(const VectorXd& g) const override {
    VectorXd result(size());
    VectorXd together = VectorXd::Zero(coarse_.scale.size());
    together[0] = g[0];
    Index first = 0, coarse = 1;
    for (const Block& block : own_) {
      const Index n = block.factor.scale.size(), members = n / 5;
      const VectorXd own = g(block.variables);
      result.segment(first, n) = block.factor.gradient(own);
      for (Index c = 0; c < 5; ++c) {
        together[coarse + c] = own.segment(c * members, members).sum();
      }
      first += n;
      coarse += 5;
    }
    result.tail(coarse_.scale.size()) = coarse_.gradient(together);
    return result;
  }

 private:
  struct Block {
    std::vector<Index> variables;  ///< 5m
    CurvatureFactor factor;
  };

  std::size_t factors_ = 0;
  std::vector<Block> own_;
  CurvatureFactor coarse_;
};

class DiagonalPreconditioner final : public Preconditioner {
 public:
  explicit DiagonalPreconditioner(VectorXd scale) : scale_(std::move(scale)) {}

  Index size() const override { return scale_.size(); }
  VectorXd move(const VectorXd& u) const override { return u.cwiseProduct(scale_); }
  VectorXd gradient(const VectorXd& g) const override { return g.cwiseProduct(scale_); }

 private:
  VectorXd scale_;
};

}  // namespace

std::unique_ptr<Preconditioner> preconditioner_of(CurvatureFactor factor) {
  return std::make_unique<FactorPreconditioner>(std::move(factor));
}

std::unique_ptr<Preconditioner> preconditioner_of(const BlockCurvature& curvature, double damping) {
  return std::make_unique<TwoLevelPreconditioner>(curvature, damping);
}

std::unique_ptr<Preconditioner> preconditioner_of_diagonal(const VectorXd& diagonal,
                                                           double damping) {
  return std::make_unique<DiagonalPreconditioner>(unit_scale(diagonal, damping));
}

}  // namespace qjulia::energy

#pragma once
/// An evaluator to derive from where a test changes the answer to one question.

#include <memory>
#include <utility>
#include <vector>

#include "energy/evaluator.hpp"

namespace qjulia::test {

/// Passes every question on to another evaluator.
class ForwardingEvaluator : public energy::Evaluator {
 public:
  explicit ForwardingEvaluator(std::unique_ptr<energy::Evaluator> to) : to_(std::move(to)) {}
  energy::Evaluation evaluate(const Map& map, bool with_gradient) override {
    return to_->evaluate(map, with_gradient);
  }
  std::vector<double> field(const Map& map) override { return to_->field(map); }
  Eigen::MatrixXd gauss_newton(const Map& map) override { return to_->gauss_newton(map); }
  Eigen::VectorXd gauss_newton_diagonal(const Map& map) override {
    return to_->gauss_newton_diagonal(map);
  }
  energy::BlockCurvature gauss_newton_blocks(const Map& map,
                                             const energy::NeighbourBlocks& blocks) override {
    return to_->gauss_newton_blocks(map, blocks);
  }
  Eigen::MatrixXd pursuit_products(const Map& map,
                                   const std::vector<Quaternion>& centers) override {
    return to_->pursuit_products(map, centers);
  }

 private:
  std::unique_ptr<energy::Evaluator> to_;
};

}  // namespace qjulia::test

#include "energy/curvature.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace qjulia::energy {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd unit_scale(const VectorXd& diagonal, double damping) {
  const double floor = 1e-9 * diagonal.mean() + 1e-300;
  return (diagonal.array() * (1 + damping) + floor).sqrt().inverse();
}

VectorXd CurvatureFactor::move(const VectorXd& u) const {
  const Eigen::VectorXf solved =
      lower.transpose().triangularView<Eigen::Upper>().solve(u.cast<float>());
  return solved.cast<double>().cwiseProduct(scale);
}

VectorXd CurvatureFactor::gradient(const VectorXd& g) const {
  const VectorXd scaled = g.cwiseProduct(scale);
  return lower.triangularView<Eigen::Lower>().solve(scaled.cast<float>()).cast<double>();
}

CurvatureFactor factorised(const Eigen::MatrixXd& h, double damping) {
  const VectorXd scale = unit_scale(h.diagonal(), damping);
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

void CurvatureSum::add(BlockCurvature next, const std::vector<std::size_t>& moved) {
  std::size_t factors = 0;
  for (const auto& block : next.blocks) factors += block.size();
  const bool is_first = weight.size() == 0;
  if (is_first) weight = VectorXd::Zero(static_cast<Index>(factors));
  VectorXd kept = VectorXd::Constant(weight.size(), is_first ? 0 : kKept);
  for (const std::size_t k : moved) kept[static_cast<Index>(k)] = 0;
  // Where each factor was: its block, and its place in it.
  std::vector<std::pair<std::size_t, Index>> before(factors);
  for (std::size_t b = 0; b < sum.blocks.size(); ++b) {
    for (Index i = 0; const std::size_t k : sum.blocks[b]) before[k] = {b, i++};
  }
  for (std::size_t b = 0; b < next.blocks.size(); ++b) {
    const auto& block = next.blocks[b];
    const auto members = static_cast<Index>(block.size());
    for (Index j = 0; j < members; ++j) {
      const std::size_t second = block[static_cast<std::size_t>(j)];
      for (Index i = 0; i < members; ++i) {
        const std::size_t first = block[static_cast<std::size_t>(i)];
        const double share =
            std::min(kept[static_cast<Index>(first)], kept[static_cast<Index>(second)]);
        if (share == 0 || before[first].first != before[second].first) continue;
        const Eigen::MatrixXd& own = sum.own[before[first].first];
        const Index row = before[first].second, column = before[second].second;
        const Index stride = own.rows() / 5;
        for (Index d = 0; d < 5; ++d) {
          for (Index c = 0; c < 5; ++c) {
            next.own[b](c * members + i, d * members + j) +=
                share * own(c * stride + row, d * stride + column);
          }
        }
      }
    }
  }
  sum = std::move(next);
  weight = weight.cwiseProduct(kept).array() + 1;
}

BlockCurvature CurvatureSum::mean() const {
  BlockCurvature result = sum;
  for (std::size_t b = 0; b < result.blocks.size(); ++b) {
    const auto& block = result.blocks[b];
    VectorXd scale(result.own[b].rows());
    for (Index i = 0; i < scale.size(); ++i) {
      const std::size_t k = block[static_cast<std::size_t>(i) % block.size()];
      scale[i] = 1 / std::sqrt(weight[static_cast<Index>(k)]);
    }
    result.own[b] = scale.asDiagonal() * sum.own[b] * scale.asDiagonal();
  }
  return result;
}

}  // namespace qjulia::energy

// Blocks of neighbouring factors: how maps are divided, what their matrices add up to, and the
// preconditioner that is made of them, against definitions by whole matrices.

#include <Eigen/Cholesky>
#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <set>

#include "energy/evaluator.hpp"
#include "random_maps.hpp"

using namespace qjulia;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using energy::BlockCurvature;
using energy::NeighbourBlocks;

namespace {

constexpr double kDamping = 1e-3;

/// Symmetric and positive definite, of a map's 1 + 5K unknowns, with rows of very different sizes.
MatrixXd random_matrix(std::size_t factors, std::uint64_t seed) {
  std::mt19937_64 bits(seed);
  const auto order = static_cast<Index>(1 + 5 * factors);
  MatrixXd half(order, 2 * order);
  for (double& entry : half.reshaped()) entry = test::uniform(bits, -0.5, 1);
  VectorXd size(order);
  for (double& entry : size) entry = std::pow(10, test::uniform(bits, -1, 1));
  return size.asDiagonal() * (half * half.transpose()) * size.asDiagonal();
}

/// The blocks of a whole matrix, entry by entry.
BlockCurvature in_blocks(const MatrixXd& h, const NeighbourBlocks& blocks, std::size_t factors) {
  BlockCurvature result{blocks, {}, MatrixXd::Zero(1, 1)};
  for (const auto& block : blocks) {
    const auto own = energy::variables_of(block, factors);
    result.own.emplace_back(h(own, own));
  }
  return result;
}

/// Number of the block that holds each factor.
std::vector<std::size_t> block_of(const NeighbourBlocks& blocks, std::size_t factors) {
  std::vector<std::size_t> block(factors);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    for (const std::size_t k : blocks[b]) block[k] = b;
  }
  return block;
}

MatrixXd damped(const MatrixXd& h) {
  MatrixXd matrix = h;
  matrix.diagonal() *= 1 + kDamping;
  return matrix;
}

}  // namespace

TEST_CASE("every factor is in one block, and blocks are as few and as even as can be") {
  for (const std::size_t count : {1U, 5U, 63U, 64U, 65U, 191U, 331U, 992U}) {
    for (const std::size_t most : {1U, 7U, 64U}) {
      const auto blocks = energy::neighbour_blocks(test::random_map(count, 0.1, 0.6, 3), most);
      CAPTURE(count, most);
      CHECK(blocks.size() == (count + most - 1) / most);
      std::set<std::size_t> seen;
      std::size_t least = count, largest = 0;
      for (const auto& block : blocks) {
        CHECK(std::ranges::is_sorted(block));
        seen.insert(block.begin(), block.end());
        least = std::min(least, block.size());
        largest = std::max(largest, block.size());
      }
      CHECK(seen.size() == count);
      CHECK(largest <= most);
      CHECK(largest - least <= 1);
    }
  }
}

TEST_CASE("blocks are neighbours, and factors in one place are divided by their numbers") {
  // Two heaps along Y, which is the longest side; W does not count.
  Map map = test::random_map(40, 0.1, 0.6, 5);
  for (std::size_t k = 0; k < 40; ++k) {
    Quaternion& center = map.dynamics.factors[k].center;
    center.y = center.y + (k % 2 == 0 ? 10 : -10);
    center.w = 100.0 * static_cast<double>(k);
  }
  for (const auto& block : energy::neighbour_blocks(map, 20)) {
    REQUIRE(block.size() == 20);
    for (const std::size_t k : block) CHECK(k % 2 == block.front() % 2);
  }
  for (Factor& factor : map.dynamics.factors) factor.center = {1, 2, 3, 4};
  const auto blocks = energy::neighbour_blocks(map, 20);
  CHECK(blocks.front().front() == 0);
  CHECK(blocks.front().back() == 19);
}

TEST_CASE("sums of blocks are those of the matrices where factors stay together") {
  constexpr std::size_t kFactors = 9;
  const std::vector<NeighbourBlocks> cuts{{{0, 1, 2, 3}, {4, 5, 6, 7, 8}},
                                          {{0, 1, 2, 4}, {3, 5, 6, 7, 8}},
                                          {{0, 1, 2, 4}, {3, 5, 6, 7, 8}}};
  const std::vector<std::vector<std::size_t>> moved{{}, {7}, {0, 3}};
  energy::CurvatureSum sum;
  MatrixXd expected = MatrixXd::Zero(1 + 5 * kFactors, 1 + 5 * kFactors);
  VectorXd weight = VectorXd::Zero(kFactors);
  for (std::size_t stage = 0; stage < cuts.size(); ++stage) {
    const MatrixXd h = random_matrix(kFactors, 10 + stage);
    BlockCurvature next = in_blocks(h, cuts[stage], kFactors);
    next.coarse(0, 0) = static_cast<double>(stage);
    sum.add(std::move(next), moved[stage]);
    // What is kept of an entry: nothing of factors that moved or were in two blocks.
    const auto block = block_of(cuts[stage], kFactors);
    const auto is_moved = [&](std::size_t k) {
      return std::ranges::find(moved[stage], k) != moved[stage].end();
    };
    for (std::size_t j = 0; j < kFactors; ++j) {
      weight[static_cast<Index>(j)] = (is_moved(j) ? 0 : 0.85 * weight[static_cast<Index>(j)]) + 1;
      for (std::size_t i = 0; i < kFactors; ++i) {
        for (Index c = 0; c < 5; ++c) {
          for (Index d = 0; d < 5; ++d) {
            const Index row = 1 + c * Index{kFactors} + static_cast<Index>(i);
            const Index column = 1 + d * Index{kFactors} + static_cast<Index>(j);
            double& entry = expected(row, column);
            const bool goes_on = !is_moved(i) && !is_moved(j);
            entry = block[i] == block[j] ? (goes_on ? 0.85 * entry : 0) + h(row, column) : 0;
          }
        }
      }
    }
    const BlockCurvature mean = sum.mean();
    CHECK(mean.coarse(0, 0) == static_cast<double>(stage));
    for (std::size_t b = 0; b < mean.blocks.size(); ++b) {
      const auto own = energy::variables_of(mean.blocks[b], kFactors);
      for (std::size_t i = 0; i < own.size(); ++i) {
        for (std::size_t j = 0; j < own.size(); ++j) {
          const auto weight_of = [&](Index variable) {
            return weight[(variable - 1) % Index{kFactors}];
          };
          const double right =
              expected(own[i], own[j]) / std::sqrt(weight_of(own[i]) * weight_of(own[j]));
          CHECK(mean.own[b](static_cast<Index>(i), static_cast<Index>(j)) ==
                Catch::Approx(right).epsilon(1e-12));
        }
      }
      // Masks leave it positive definite.
      CHECK(Eigen::LLT<MatrixXd>(mean.own[b]).info() == Eigen::Success);
    }
  }
}

TEST_CASE("the preconditioner is the sum of the inverses of blocks and of the coarse space") {
  constexpr std::size_t kFactors = 11;
  const NeighbourBlocks blocks = GENERATE(NeighbourBlocks{{0, 2, 4, 9}, {1, 3, 5}, {6, 7, 8, 10}},
                                          NeighbourBlocks{{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}});
  const MatrixXd h = random_matrix(kFactors, 4);
  const Index order = h.rows(), count = static_cast<Index>(blocks.size());
  BlockCurvature curvature = in_blocks(h, blocks, kFactors);
  MatrixXd coarse = MatrixXd::Zero(order, 1 + 5 * count);
  coarse(0, 0) = 1;
  MatrixXd expected = MatrixXd::Zero(order, order);
  for (Index b = 0; b < count; ++b) {
    const auto& block = blocks[static_cast<std::size_t>(b)];
    for (const std::size_t k : block) {
      for (Index c = 0; c < 5; ++c) {
        coarse(1 + c * Index{kFactors} + static_cast<Index>(k), 1 + 5 * b + c) = 1;
      }
    }
    const auto own = energy::variables_of(block, kFactors);
    expected(own, own) += damped(h(own, own)).inverse();
  }
  curvature.coarse = coarse.transpose() * h * coarse;
  expected += coarse * damped(curvature.coarse).inverse() * coarse.transpose();
  const auto made = energy::preconditioner_of(curvature, kDamping);
  REQUIRE(made->size() == order - 1 + 1 + 5 * count);
  MatrixXd move(order, made->size());
  for (Index i = 0; i < made->size(); ++i)
    move.col(i) = made->move(VectorXd::Unit(made->size(), i));
  MatrixXd gradient(made->size(), order);
  for (Index i = 0; i < order; ++i) gradient.col(i) = made->gradient(VectorXd::Unit(order, i));
  const VectorXd size = expected.diagonal().cwiseSqrt().cwiseInverse();
  CHECK((size.asDiagonal() * (move * move.transpose() - expected) * size.asDiagonal())
            .cwiseAbs()
            .maxCoeff() < 1e-4);
  CHECK((gradient - move.transpose()).cwiseAbs().maxCoeff() < 1e-5 * move.cwiseAbs().maxCoeff());
}

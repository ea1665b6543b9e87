#include "energy/evaluator.hpp"

#include <cmath>
#include <stdexcept>

#include "map/reference_iteration.hpp"

namespace qjulia::energy {
namespace {

class ReferenceEvaluator final : public Evaluator {
 public:
  ReferenceEvaluator(Samples samples, const EnergySettings& options)
      : samples_(std::move(samples)), options_(options) {}

  Evaluation evaluate(const Map& map, bool with_gradient) override {
    const std::vector<Quaternion> starts = points(map);
    const auto f = reference::field(map, starts, options_.iterations, options_.escape);
    Eigen::VectorXd slopes(static_cast<Eigen::Index>(f.size()));
    Evaluation result;
    for (std::size_t i = 0; i < f.size(); ++i) {
      const LossTerm term = term_of(i, f[i]);
      result.energy += term.energy;
      slopes[static_cast<Eigen::Index>(i)] = term.slope;
    }
    if (with_gradient) {
      const Eigen::MatrixXd gradients =
          reference::field_gradients(map, starts, options_.iterations, options_.escape);
      const Eigen::VectorXd sum = gradients.transpose() * slopes;
      result.gradient.assign(sum.begin(), sum.end());
    }
    return result;
  }

  std::vector<double> field(const Map& map) override {
    return reference::field(map, points(map), options_.iterations, options_.escape);
  }

  Eigen::MatrixXd gauss_newton(const Map& map) override {
    const std::vector<Quaternion> starts = points(map);
    const auto f = field(map);
    Eigen::VectorXd curvatures(static_cast<Eigen::Index>(f.size()));
    for (std::size_t i = 0; i < f.size(); ++i) {
      curvatures[static_cast<Eigen::Index>(i)] = term_of(i, f[i]).curvature;
    }
    const Eigen::MatrixXd jacobian = reference::field_gradients(map, starts, 1, options_.escape);
    return jacobian.transpose() * curvatures.asDiagonal() * jacobian;
  }

  Eigen::VectorXd gauss_newton_diagonal(const Map& map) override {
    return gauss_newton(map).diagonal();
  }

  BlockCurvature gauss_newton_blocks(const Map& map, const NeighbourBlocks& blocks) override {
    const Eigen::MatrixXd h = gauss_newton(map);
    const std::size_t factors = map.dynamics.factors.size();
    const auto count = static_cast<Eigen::Index>(blocks.size());
    BlockCurvature result;
    result.blocks = blocks;
    Eigen::MatrixXd moves = Eigen::MatrixXd::Zero(h.rows(), 1 + 5 * count);
    moves(0, 0) = 1;
    for (Eigen::Index b = 0; b < count; ++b) {
      const auto own = variables_of(blocks[static_cast<std::size_t>(b)], factors);
      result.own.emplace_back(h(own, own));
      const std::size_t members = own.size() / 5;
      for (std::size_t i = 0; i < own.size(); ++i) {
        moves(own[i], 1 + 5 * b + static_cast<Eigen::Index>(i / members)) = 1;
      }
    }
    result.coarse = moves.transpose() * h * moves;
    return result;
  }

  Eigen::MatrixXd pursuit_products(const Map& map,
                                   const std::vector<Quaternion>& centers) override {
    const std::vector<Quaternion> starts = points(map);
    const auto f = field(map);
    const auto rows = static_cast<Eigen::Index>(f.size());
    Eigen::MatrixXd columns(rows, 2 + static_cast<Eigen::Index>(centers.size()));
    for (Eigen::Index i = 0; i < rows; ++i) {
      const auto sample = static_cast<std::size_t>(i);
      columns(i, 0) = 1;
      columns(i, 1) = f[sample] - samples_.target[sample];
      for (std::size_t k = 0; k < centers.size(); ++k) {
        columns(i, 2 + static_cast<Eigen::Index>(k)) = std::log(norm(starts[sample] - centers[k]));
      }
      columns.row(i) *= std::sqrt(term_of(sample, f[sample]).curvature);
    }
    return columns.transpose() * columns;
  }

 private:
  std::vector<Quaternion> points(const Map& map) const {
    std::vector<Quaternion> starts;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const Eigen::Vector3d& x = samples_.position[i];
      starts.push_back({x.x(), x.y(), x.z(), map.dynamics.slice + samples_.off_slice[i]});
    }
    return starts;
  }

  LossTerm term_of(std::size_t i, double f) const { return loss_term(samples_, i, f, options_); }

  Samples samples_;
  EnergySettings options_;
};

}  // namespace

LossTerm loss_term(const Samples& samples, std::size_t i, double field,
                   const EnergySettings& options) {
  const double w = samples.weight[i];
  const double side = samples.side[i];
  const double residual = field - samples.target[i];
  if (options.loss == Loss::tanh) {
    const double t = std::tanh(options.alpha * residual);
    const double slope = options.alpha * (1 - t * t);
    return {-w * side * t, -w * side * slope, w * options.alpha * slope};
  }
  if (options.loss == Loss::linear) {
    const double slope = w * samples.target[i];
    return {slope * field, slope, 0};
  }
  if (side * residual > 0) return {};
  return {0.5 * w * residual * residual, w * residual, w};
}

std::vector<double> to_unknowns(const Map& map) {
  const std::size_t k = map.dynamics.factors.size();
  std::vector<double> v(1 + 5 * k);
  v[0] = map.dynamics.log_scale;
  for (std::size_t i = 0; i < k; ++i) {
    const auto& [center, exponent] = map.dynamics.factors[i];
    v[1 + i] = exponent;
    v[1 + k + i] = center.x;
    v[1 + 2 * k + i] = center.y;
    v[1 + 3 * k + i] = center.z;
    v[1 + 4 * k + i] = center.w;
  }
  return v;
}

Map with_unknowns(Map map, std::span<const double> v) {
  const std::size_t k = map.dynamics.factors.size();
  if (v.size() != 1 + 5 * k) throw std::logic_error("unknowns do not match the map's factors");
  map.dynamics.log_scale = v[0];
  for (std::size_t i = 0; i < k; ++i) {
    map.dynamics.factors[i] = {{v[1 + k + i], v[1 + 2 * k + i], v[1 + 3 * k + i], v[1 + 4 * k + i]},
                               v[1 + i]};
  }
  return map;
}

std::unique_ptr<Evaluator> make_reference_evaluator(Samples samples,
                                                    const EnergySettings& options) {
  return std::make_unique<ReferenceEvaluator>(std::move(samples), options);
}

}  // namespace qjulia::energy

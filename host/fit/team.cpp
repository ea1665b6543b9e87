#include "fit/team.hpp"

#include <fmt/format.h>

#include <utility>

#include "device/context.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::fitting {
namespace {

using Eigen::VectorXd;
using Numbers = Ranks::Numbers;

/// An evenly spaced part of the samples that stands for all in matrices, of which an evaluator
/// takes a part again: at least four times as many as a matrix of 2,560 factors needs.
Samples for_matrices(const Samples& samples) {
  constexpr std::size_t kEnough = 4 * curvature_samples(1 + 5 * kMostByMatrix);
  const std::size_t step = std::max<std::size_t>(1, samples.size() / kEnough);
  const std::size_t count = (samples.size() + step - 1) / step;
  const double share = static_cast<double>(samples.size()) / static_cast<double>(count);
  Samples part;
  for (std::size_t i = 0; i < samples.size(); i += step) part.add(samples, i, share);
  return part;
}

/// Energies and gradients are the sums of the parts'. Every rank factors rank 0's blocks by the
/// same instructions. Matrices are rank 0's: with 331 factors a quarter of a second's work a stage,
/// which takes longer to divide and exchange.
class DistributedEvaluator final : public Evaluator {
 public:
  DistributedEvaluator(Team& team, const EvaluatorFactory& local, int parts, const Samples& samples,
                       const EnergySettings& options)
      : team_(team), samples_(samples.size()) {
    // A part has at least one sample.
    parts_ = std::min(static_cast<std::size_t>(parts), samples_);
    team.all_gather([&] {  // memory may be short on one rank alone
      for (auto p = static_cast<std::size_t>(team.rank()); p < parts_; p += size()) {
        Samples part;
        for (std::size_t i = begin_of(p); i < begin_of(p + 1); ++i) part.add(samples, i);
        mine_.push_back(local(part, options));
      }
      if (team.rank() == 0 && parts_ > 1) of_all_ = local(for_matrices(samples), options);
      return Numbers();
    });
  }

  Evaluation evaluate(const Map& map, bool with_gradient) override {
    const auto sum =
        summed(with_gradient ? 2 + 5 * map.dynamics.factors.size() : 1, [&](Evaluator& part) {
          Evaluation e = part.evaluate(map, with_gradient);
          e.gradient.insert(e.gradient.begin(), e.energy);
          return e.gradient;
        });
    return {sum.front(), {sum.begin() + 1, sum.end()}};
  }

  std::vector<double> field(const Map& map) override {
    const auto said = ask([&](Evaluator& part) { return part.field(map); });
    std::vector<double> values;
    values.reserve(samples_);
    std::vector<std::size_t> next(size(), 0);
    for (std::size_t p = 0; p < parts_; ++p) {
      for (std::size_t i = begin_of(p); i < begin_of(p + 1); ++i) {
        values.push_back(said[p % size()][next[p % size()]++]);
      }
    }
    return values;
  }

  Eigen::MatrixXd gauss_newton(const Map& map) override {
    return first_matrix(1 + 5 * map.dynamics.factors.size(),
                        [&] { return of_matrices().gauss_newton(map); });
  }

  VectorXd gauss_newton_diagonal(const Map& map) override {
    const auto sum = summed(1 + 5 * map.dynamics.factors.size(), [&](Evaluator& part) {
      const VectorXd d = part.gauss_newton_diagonal(map);
      return Numbers(d.begin(), d.end());
    });
    return Eigen::Map<const VectorXd>(sum.data(), static_cast<Eigen::Index>(sum.size()));
  }

  BlockCurvature gauss_newton_blocks(const Map& map, const NeighbourBlocks& blocks) override {
    const Numbers said = team_.first([&] {
      const BlockCurvature own = of_matrices().gauss_newton_blocks(map, blocks);
      Numbers numbers(own.coarse.data(), own.coarse.data() + own.coarse.size());
      for (const Eigen::MatrixXd& matrix : own.own) {
        numbers.insert(numbers.end(), matrix.data(), matrix.data() + matrix.size());
      }
      return numbers;
    });
    const double* next = said.data();
    const auto matrix = [&](std::size_t order) -> Eigen::MatrixXd {
      const auto n = static_cast<Eigen::Index>(order);
      const double* const first = std::exchange(next, next + order * order);
      return Eigen::Map<const Eigen::MatrixXd>(first, n, n);
    };
    BlockCurvature result{blocks, {}, matrix(1 + 5 * blocks.size())};
    for (const auto& block : blocks) result.own.push_back(matrix(5 * block.size()));
    return result;
  }

  Eigen::MatrixXd pursuit_products(const Map& map,
                                   const std::vector<Quaternion>& centers) override {
    return first_matrix(2 + centers.size(),
                        [&] { return of_matrices().pursuit_products(map, centers); });
  }

 private:
  using Question = std::function<Numbers(Evaluator&)>;

  std::size_t size() const { return static_cast<std::size_t>(team_.size()); }
  std::size_t begin_of(std::size_t part) const { return part * samples_ / parts_; }

  /// The answers of each rank's parts, one after the other; the result is indexed by rank.
  std::vector<Numbers> ask(const Question& question) {
    return team_.all_gather([&] {
      Numbers answers;
      for (const auto& part : mine_) {
        const Numbers answer = question(*part);
        answers.insert(answers.end(), answer.begin(), answer.end());
      }
      return answers;
    });
  }

  /// The sum over the parts, in their order. @param count numbers in each part's answer.
  Numbers summed(std::size_t count, const Question& question) {
    const auto said = ask(question);
    Numbers sum(count, 0);
    for (std::size_t p = 0; p < parts_; ++p) {
      const double* part = said[p % size()].data() + p / size() * count;
      for (std::size_t i = 0; i < count; ++i) sum[i] += part[i];
    }
    return sum;
  }

  /// On rank 0: of all samples, or of as many as matrices need.
  Evaluator& of_matrices() { return of_all_ ? *of_all_ : *mine_.front(); }

  /// Rank 0's, on every rank.
  Eigen::MatrixXd first_matrix(std::size_t order, const std::function<Eigen::MatrixXd()>& compute) {
    const auto n = static_cast<Eigen::Index>(order);
    const Numbers numbers = team_.first([&] {
      const Eigen::MatrixXd matrix = compute();
      return Numbers(matrix.data(), matrix.data() + matrix.size());
    });
    return Eigen::Map<const Eigen::MatrixXd>(numbers.data(), n, n);
  }

  Team& team_;
  std::size_t samples_;
  std::size_t parts_ = 1;
  std::vector<std::unique_ptr<Evaluator>> mine_;  ///< one for each of this rank's parts, ascending
  std::unique_ptr<Evaluator> of_all_;             ///< on rank 0, where there are several parts
};

}  // namespace

std::vector<Numbers> Team::exchange(Numbers mine, double status) {
  if (!ranks_) return {std::move(mine)};
  mine.push_back(status);
  auto all = ranks_->all_gather(mine);
  std::vector<double> states;
  for (Numbers& numbers : all) {
    states.push_back(numbers.back());
    numbers.pop_back();
  }
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (states[r] != kFailed) continue;
    ended_ = true;
    throw Error(fmt::format("rank {}: {}", r, Ranks::bytes_of(all[r])));
  }
  for (std::size_t r = 0; r < all.size(); ++r) {
    if (states[r] == kWell) continue;
    throw DeviceError(fmt::format("rank {}", r), "an evaluation", static_cast<int>(states[r]));
  }
  return all;
}

std::vector<Numbers> Team::all_gather(const std::function<Numbers()>& compute) {
  if (!ranks_) return {compute()};
  Numbers mine;
  double status = kWell;
  try {
    mine = compute();
  } catch (const DeviceError& error) {
    if (!device::is_out_of_memory(error)) throw;
    status = error.code();
  }
  return exchange(std::move(mine), status);
}

Numbers Team::first(const std::function<Numbers()>& compute) {
  return std::move(all_gather([&] { return rank() == 0 ? compute() : Numbers(); }).front());
}

Numbers Team::broadcast(Numbers numbers) {
  if (rank() > 0) numbers.clear();
  return std::move(exchange(std::move(numbers), kWell).front());
}

std::string Team::broadcast_text(const std::string& text) {
  return ranks_ ? Ranks::bytes_of(broadcast(Ranks::numbers_of(text))) : text;
}

void Team::adopt(Map& map) {
  if (!ranks_) return;
  const Numbers unknowns = broadcast(to_unknowns(map));
  map = with_unknowns(std::move(map), unknowns);
}

void Team::adopt(Samples& samples) {
  adopt(samples.position);
  adopt(samples.off_slice);
  adopt(samples.weight);
  adopt(samples.target);
  adopt(samples.side);
}

void Team::adopt(SamplePool& pool) {
  adopt(pool.surface);
  adopt(pool.near);
  adopt(pool.around);
  adopt(pool.deep);
  pool.inradius = broadcast({pool.inradius}).front();
}

Clock Team::shared(Clock own) {
  return [this, own = std::move(own)] {
    const Moment mine = own();
    const Numbers now = broadcast({mine.seconds, mine.stop_requested ? 1.0 : 0.0});
    return Moment{now[0], now[1] != 0};
  };
}

void Team::leave(const std::exception& reason) {
  if (!ranks_ || ended_) return;
  Numbers last = Ranks::numbers_of(reason.what());
  last.push_back(kFailed);
  ranks_->all_gather(last);
  ended_ = true;
}

EvaluatorFactory distributed(Team& team, EvaluatorFactory local, int parts) {
  return [&team, local = std::move(local), parts](const Samples& samples,
                                                  const EnergySettings& options) {
    return std::make_unique<DistributedEvaluator>(team, local, parts, samples, options);
  };
}

DividedProblem::DividedProblem(Team& team, const Problem& own, int parts) : team_(team), own_(own) {
  EvaluatorFactory local = [&own](const Samples& samples, const EnergySettings& options) {
    return own.evaluator(samples, options);
  };
  const bool is_divided = team.size() > 1 || parts > 1;
  make_evaluator_ = is_divided ? distributed(team, std::move(local), parts) : std::move(local);
}

Samples DividedProblem::draw(const Level& level, base::Random& random) const {
  Samples samples = own_.draw(level, random);
  team_.adopt(samples);
  return samples;
}

std::vector<double> DividedProblem::distances(const std::vector<Eigen::Vector3d>& points) const {
  std::vector<double> found = own_.distances(points);
  team_.adopt(found);
  return found;
}

double DividedProblem::overlap(const Map& map, int iterations) const {
  return team_.broadcast({own_.overlap(map, iterations)}).front();
}

Map DividedProblem::agreed(Map map) const {
  team_.adopt(map);
  return map;
}

}  // namespace qjulia::fitting

#include "fit/ranked_evaluator.hpp"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <string>

#include "qjulia/error.hpp"

namespace qjulia {
namespace {

using Numbers = Ranks::Numbers;

/// What rank 0 asks for: first number of a message. The second is the evaluator's.
enum class Ask : int {
  make,
  evaluate,
  field,
  gauss_newton,
  gauss_newton_diagonal,
  pursuit,
  drop,
  end
};

constexpr std::size_t kSampleNumbers = 6;
/// Where a message's unknowns begin; their number stands before them.
constexpr std::ptrdiff_t kUnknowns = 9;

/// This rank's parts of one set of samples.
using Parts = std::vector<std::unique_ptr<Evaluator>>;

/// The evaluators of this rank, by number.
class Desk {
 public:
  Desk(Ranks& ranks, const EvaluatorFactory& local) : ranks_(ranks), local_(local) {}

  /// Answers one message: the same number of calls among ranks whatever goes wrong.
  /// @return on rank 0, what every rank said, by rank.
  std::vector<Numbers> answer(const Numbers& message, const std::vector<Numbers>& samples) {
    Numbers reply{0};
    const auto ask = static_cast<Ask>(static_cast<int>(message[0]));
    Numbers mine;
    if (ask == Ask::make) mine = ranks_.scatter(samples);
    try {
      answer_locally(ask, message, mine, reply);
    } catch (const std::exception& error) {
      const std::string what = error.what();
      reply = {1};
      reply.insert(reply.end(), what.begin(), what.end());
    }
    return ranks_.gather(reply);
  }

 private:
  void answer_locally(Ask ask, const Numbers& message, const Numbers& samples, Numbers& reply) {
    const double number = message[1];
    switch (ask) {
      case Ask::make:
        made_[number] = make(message, samples);
        return;
      case Ask::evaluate:
        for (const auto& part : made_.at(number)) {
          const Evaluation e = part->evaluate(map_of(message), message[2] != 0);
          reply.push_back(e.energy);
          reply.insert(reply.end(), e.gradient.begin(), e.gradient.end());
        }
        return;
      case Ask::field:
        for (const auto& part : made_.at(number)) {
          const auto values = part->field(map_of(message));
          reply.insert(reply.end(), values.begin(), values.end());
        }
        return;
      case Ask::gauss_newton:
        for (const auto& part : made_.at(number)) {
          const Eigen::MatrixXd h = part->gauss_newton(map_of(message));
          reply.insert(reply.end(), h.data(), h.data() + h.size());
        }
        return;
      case Ask::gauss_newton_diagonal:
        for (const auto& part : made_.at(number)) {
          const Eigen::VectorXd d = part->gauss_newton_diagonal(map_of(message));
          reply.insert(reply.end(), d.begin(), d.end());
        }
        return;
      case Ask::pursuit:
        for (const auto& part : made_.at(number)) {
          const Eigen::MatrixXd g = part->pursuit_products(map_of(message), centers_of(message));
          reply.insert(reply.end(), g.data(), g.data() + g.size());
        }
        return;
      case Ask::drop:
        made_.erase(number);
        return;
      case Ask::end:
        return;
    }
  }

  /// @param samples counts of this rank's parts, then their samples.
  Parts make(const Numbers& message, const Numbers& samples) const {
    const EnergyOptions options{message[2] == 0 ? Loss::tanh : Loss::distance,
                                static_cast<int>(message[3]), message[4], message[5]};
    Parts parts;
    const auto count = static_cast<std::size_t>(samples.at(0));
    std::size_t next = 1 + count;
    for (std::size_t p = 0; p < count; ++p) {
      Samples part;
      for (auto left = static_cast<std::size_t>(samples[1 + p]); left > 0; --left) {
        const double* s = samples.data() + next;
        part.add({s[0], s[1], s[2]}, s[3], s[4], s[5]);
        next += kSampleNumbers;
      }
      parts.push_back(local_(part, options));
    }
    return parts;
  }

  /// From number 3: slice, phase, the number of unknowns, unknowns.
  static RationalMap map_of(const Numbers& message) {
    RationalMap map;
    map.slice = message[3];
    map.phase = {message[4], message[5], message[6], message[7]};
    const auto begin = message.begin() + kUnknowns;
    const Numbers unknowns(begin, begin + static_cast<std::ptrdiff_t>(message[kUnknowns - 1]));
    map.factors.resize((unknowns.size() - 1) / 5);
    return with_unknowns(std::move(map), unknowns);
  }

  /// After the unknowns, four numbers each.
  static std::vector<Quaternion> centers_of(const Numbers& message) {
    std::vector<Quaternion> centers;
    for (std::size_t i = kUnknowns + static_cast<std::size_t>(message[kUnknowns - 1]);
         i < message.size(); i += 4) {
      centers.push_back({message[i], message[i + 1], message[i + 2], message[i + 3]});
    }
    return centers;
  }

  Ranks& ranks_;
  const EvaluatorFactory& local_;
  std::map<double, Parts> made_;
};

/// Rank 0's view of one set of samples.
class RankedEvaluator final : public Evaluator {
 public:
  RankedEvaluator(Ranks& ranks, std::shared_ptr<Desk> desk, double number, int parts,
                  const Samples& samples, const EnergyOptions& options)
      : ranks_(ranks), desk_(std::move(desk)), number_(number), samples_(samples.size()) {
    const auto size = static_cast<std::size_t>(ranks_.size());
    // A part has at least one sample.
    parts_ = std::min(static_cast<std::size_t>(parts), samples_);
    std::vector<Numbers> by_rank(size, Numbers{0});
    for (std::size_t p = 0; p < parts_; ++p) {
      ++by_rank[p % size][0];
      by_rank[p % size].push_back(static_cast<double>(end_of(p) - begin_of(p)));
    }
    for (std::size_t p = 0; p < parts_; ++p) {
      Numbers& to = by_rank[p % size];
      for (std::size_t i = begin_of(p); i < end_of(p); ++i) {
        const auto& x = samples.position[i];
        to.insert(to.end(),
                  {x.x(), x.y(), x.z(), samples.weight[i], samples.target[i], samples.side[i]});
      }
    }
    ask({static_cast<double>(Ask::make), number_, options.loss == Loss::tanh ? 0.0 : 1.0,
         static_cast<double>(options.iterations), options.alpha, options.escape},
        by_rank);
  }

  ~RankedEvaluator() override {
    try {
      ask({static_cast<double>(Ask::drop), number_});
    } catch (const std::exception&) {
      // Nothing can be lost with it.
    }
  }
  RankedEvaluator(const RankedEvaluator&) = delete;
  RankedEvaluator& operator=(const RankedEvaluator&) = delete;

  Evaluation evaluate(const RationalMap& map, bool with_gradient) override {
    const std::size_t unknowns = with_gradient ? 1 + 5 * map.factors.size() : 0;
    const auto said = ask(message(Ask::evaluate, map, with_gradient));
    Evaluation sum;
    sum.gradient.assign(unknowns, 0);
    for (std::size_t p = 0; p < parts_; ++p) {
      const double* part = part_of(said, p, 1 + unknowns);
      sum.energy += part[0];
      for (std::size_t i = 0; i < unknowns; ++i) sum.gradient[i] += part[1 + i];
    }
    return sum;
  }

  std::vector<double> field(const RationalMap& map) override {
    const auto said = ask(message(Ask::field, map, false));
    const auto size = static_cast<std::size_t>(ranks_.size());
    std::vector<std::size_t> next(size, 1);
    std::vector<double> values;
    values.reserve(samples_);
    for (std::size_t p = 0; p < parts_; ++p) {
      const std::size_t count = end_of(p) - begin_of(p);
      const double* first = said[p % size].data() + next[p % size];
      values.insert(values.end(), first, first + count);
      next[p % size] += count;
    }
    return values;
  }

  Eigen::MatrixXd gauss_newton(const RationalMap& map) override {
    const auto order = static_cast<Eigen::Index>(1 + 5 * map.factors.size());
    return summed(ask(message(Ask::gauss_newton, map, false)), order, order);
  }

  Eigen::VectorXd gauss_newton_diagonal(const RationalMap& map) override {
    const auto order = static_cast<Eigen::Index>(1 + 5 * map.factors.size());
    return summed(ask(message(Ask::gauss_newton_diagonal, map, false)), order, 1);
  }

  Eigen::MatrixXd pursuit_products(const RationalMap& map,
                                   const std::vector<Quaternion>& centers) override {
    Numbers numbers = message(Ask::pursuit, map, false);
    for (const Quaternion& c : centers) numbers.insert(numbers.end(), {c.x, c.y, c.z, c.w});
    const auto order = static_cast<Eigen::Index>(2 + centers.size());
    return summed(ask(std::move(numbers)), order, order);
  }

 private:
  std::size_t begin_of(std::size_t part) const { return part * samples_ / parts_; }
  std::size_t end_of(std::size_t part) const { return (part + 1) * samples_ / parts_; }

  /// @param count numbers every part says.
  const double* part_of(const std::vector<Numbers>& said, std::size_t part,
                        std::size_t count) const {
    const auto size = static_cast<std::size_t>(ranks_.size());
    return said[part % size].data() + 1 + part / size * count;
  }

  /// The parts' matrices, in the parts' order.
  Eigen::MatrixXd summed(const std::vector<Numbers>& said, Eigen::Index rows,
                         Eigen::Index columns) const {
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(rows, columns);
    for (std::size_t p = 0; p < parts_; ++p) {
      const double* part = part_of(said, p, static_cast<std::size_t>(rows * columns));
      sum += Eigen::Map<const Eigen::MatrixXd>(part, rows, columns);
    }
    return sum;
  }

  Numbers message(Ask what, const RationalMap& map, bool with_gradient) const {
    Numbers numbers{static_cast<double>(what),
                    number_,
                    with_gradient ? 1.0 : 0.0,
                    map.slice,
                    map.phase.x,
                    map.phase.y,
                    map.phase.z,
                    map.phase.w};
    const auto unknowns = to_unknowns(map);
    numbers.push_back(static_cast<double>(unknowns.size()));
    numbers.insert(numbers.end(), unknowns.begin(), unknowns.end());
    return numbers;
  }

  std::vector<Numbers> ask(Numbers message, const std::vector<Numbers>& samples = {}) const {
    ranks_.broadcast(message);
    auto said = desk_->answer(message, samples);
    for (std::size_t r = 0; r < said.size(); ++r) {
      if (said[r].at(0) == 0) continue;
      throw Error("rank " + std::to_string(r) + ": " +
                  std::string(said[r].begin() + 1, said[r].end()));
    }
    return said;
  }

  Ranks& ranks_;
  std::shared_ptr<Desk> desk_;
  double number_;
  std::size_t samples_;
  std::size_t parts_ = 1;
};

}  // namespace

RankedEvaluators::RankedEvaluators(Ranks& ranks, EvaluatorFactory local, int parts)
    : ranks_(ranks), local_(std::move(local)), parts_(parts) {}

RankedEvaluators::~RankedEvaluators() {
  Numbers message{static_cast<double>(Ask::end), 0};
  ranks_.broadcast(message);
}

EvaluatorFactory RankedEvaluators::factory() {
  auto desk = std::make_shared<Desk>(ranks_, local_);
  return [this, desk](const Samples& samples, const EnergyOptions& options) {
    return std::make_unique<RankedEvaluator>(ranks_, desk, next_++, parts_, samples, options);
  };
}

void serve_evaluations(Ranks& ranks, const EvaluatorFactory& local) {
  Desk desk(ranks, local);
  for (;;) {
    Numbers message;
    ranks.broadcast(message);
    if (static_cast<Ask>(static_cast<int>(message.at(0))) == Ask::end) return;
    desk.answer(message, {});
  }
}

}  // namespace qjulia

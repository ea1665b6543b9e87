#pragma once
/// One fit over many ranks: all take the same steps, each evaluates its own parts of the samples.

#include <algorithm>
#include <exception>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include "fit/budget.hpp"
#include "fit/problem.hpp"
#include "fit/sample_pool.hpp"
#include "qjulia/fit/ranks.hpp"

namespace qjulia::fitting {

/// Ranks that take the same steps and end together: when one of them fails, all throw. Every call
/// of a member function is made by all of them. A team of one exchanges nothing.
class Team {
 public:
  using Numbers = Ranks::Numbers;

  Team() = default;  ///< this process alone
  explicit Team(Ranks& ranks) : ranks_(ranks.size() > 1 ? &ranks : nullptr) {}
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  int rank() const { return ranks_ ? ranks_->rank() : 0; }
  int size() const { return ranks_ ? ranks_->size() : 1; }

  /// Does `work`, the whole of what the ranks do together. What it throws here ends it on the other
  /// ranks too, with an Error that names this rank and says why.
  template <class Work>
  std::invoke_result_t<Work> run(const Work& work) {
    try {
      auto result = work();
      exchange({}, kWell);  // a rank that is not done yet can still fail
      return result;
    } catch (const std::exception& error) {
      leave(error);
      throw;
    }
  }

  /// What every rank has computed, by rank. Where one has too little device memory for it, all
  /// throw the DeviceError that says so, and can go on.
  std::vector<Numbers> all_gather(const std::function<Numbers()>& compute);

  /// What rank 0 computes, on every rank; the others do not call `compute`. Where rank 0 has too
  /// little device memory, all throw, as in `all_gather`.
  Numbers first(const std::function<Numbers()>& compute);

  /// Rank 0's numbers, on every rank.
  Numbers broadcast(Numbers numbers);
  std::string broadcast_text(const std::string& text);
  /// Puts rank 0's values in place of this rank's, which another kind of device may have rounded
  /// otherwise.
  template <class Value>
  void adopt(std::vector<Value>& values) {
    static_assert(std::is_standard_layout_v<Value> && sizeof(Value) % sizeof(double) == 0);
    if (!ranks_) return;
    constexpr std::size_t kNumbers = sizeof(Value) / sizeof(double);
    auto* first = reinterpret_cast<double*>(values.data());
    const Numbers theirs = broadcast(Numbers(first, first + kNumbers * values.size()));
    values.resize(theirs.size() / kNumbers);
    std::ranges::copy(theirs, reinterpret_cast<double*>(values.data()));
  }
  void adopt(Map& map);  ///< its unknowns
  void adopt(Samples& samples);
  void adopt(SamplePool& pool);

  /// A clock that returns rank 0's moment on every rank.
  Clock shared(Clock own);

 private:
  std::vector<Numbers> exchange(Numbers mine, double status);
  void leave(const std::exception& reason);

  /// The last number of a rank's message, where it is no OpenCL error code (those are negative).
  static constexpr double kWell = 0;
  static constexpr double kFailed = 1;  ///< the numbers before are a text

  Ranks* ranks_ = nullptr;
  bool ended_ = false;  ///< a rank has left for an error: nothing more can be exchanged
};

/// Evaluators over the samples in `parts` equal parts, part p on rank p mod size, each with an
/// evaluator of its own that `local` makes. Energies, gradients and diagonals are summed in the
/// parts' order on every rank; matrices are rank 0's, of an evenly spaced part of all samples. So
/// the same number of parts gives the same bits, however many ranks there are.
EvaluatorFactory distributed(Team& team, EvaluatorFactory local, int parts);

/// A problem that ranks work on together. Its evaluators are divided over the ranks. Each rank
/// finishes the map itself, and all other answers are rank 0's.
class DividedProblem final : public Problem {
 public:
  /// @param parts of the samples, as for `distributed`.
  DividedProblem(Team& team, const Problem& own, int parts);

  Samples draw(const Level& level, base::Random& random) const override;
  std::unique_ptr<Evaluator> evaluator(const Samples& samples,
                                       const EnergySettings& options) const override {
    return make_evaluator_(samples, options);
  }
  std::vector<double> distances(const std::vector<Eigen::Vector3d>& points) const override;
  double overlap(const Map& map, int iterations) const override;
  FinishedMap finished(const Map& map) const override { return own_.finished(map); }
  Map agreed(Map map) const override;

 private:
  Team& team_;
  const Problem& own_;
  EvaluatorFactory make_evaluator_;
};

}  // namespace qjulia::fitting

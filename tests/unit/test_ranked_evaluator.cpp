/// Samples in parts over ranks that are threads.

#include <barrier>
#include <catch2/catch.hpp>
#include <thread>

#include "fit/random.hpp"
#include "fit/ranked_evaluator.hpp"
#include "qjulia/error.hpp"

using namespace qjulia;
using Catch::Matchers::Contains;

namespace {

/// What the threads of one test share.
struct Table {
  explicit Table(int size) : meeting(size), said(static_cast<std::size_t>(size)), handed(said) {}
  std::barrier<> meeting;
  std::vector<Ranks::Numbers> said;
  std::vector<Ranks::Numbers> handed;
  Ranks::Numbers told;
};

class Thread final : public Ranks {
 public:
  Thread(Table& table, int rank) : table_(table), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return static_cast<int>(table_.said.size()); }
  std::vector<int> all(int value) override { return {value}; }
  void broadcast(Numbers& numbers) override {
    if (rank_ == 0) table_.told = numbers;
    table_.meeting.arrive_and_wait();
    numbers = table_.told;
    table_.meeting.arrive_and_wait();
  }
  Numbers scatter(const std::vector<Numbers>& parts) override {
    if (rank_ == 0) table_.handed = parts;
    table_.meeting.arrive_and_wait();
    Numbers mine = table_.handed[static_cast<std::size_t>(rank_)];
    table_.meeting.arrive_and_wait();
    return mine;
  }
  std::vector<Numbers> gather(const Numbers& mine) override {
    table_.said[static_cast<std::size_t>(rank_)] = mine;
    table_.meeting.arrive_and_wait();
    std::vector<Numbers> all;
    if (rank_ == 0) all = table_.said;
    table_.meeting.arrive_and_wait();
    return all;
  }

 private:
  Table& table_;
  int rank_;
};

/// Runs `ask` on rank 0 of `size`.
template <class Ask>
void on_ranks(int size, int parts, const EvaluatorFactory& local, const Ask& ask) {
  Table table(size);
  std::vector<std::jthread> others;
  for (int r = 1; r < size; ++r) {
    others.emplace_back([&table, &local, r] {
      Thread ranks(table, r);
      serve_evaluations(ranks, local);
    });
  }
  Thread ranks(table, 0);
  RankedEvaluators evaluators(ranks, local, parts);
  ask(evaluators.factory());
}

const EvaluatorFactory kReference = [](const Samples& samples, const EnergyOptions& options) {
  return make_reference_evaluator(samples, options);
};

Samples some_samples(std::size_t count) {
  Random random(5);
  Samples samples;
  for (std::size_t i = 0; i < count; ++i) {
    samples.add({random.uniform(-2, 2), random.uniform(-2, 2), random.uniform(-2, 2)},
                random.uniform(0.1, 1), random.uniform(-1, 1), i % 3 == 0 ? 1 : 0);
  }
  return samples;
}

RationalMap some_map() {
  RationalMap map;
  map.slice = 0.1;
  map.log_scale = 0.3;
  map.factors = {{{0.1, 0.2, -0.3, 0.1}, 2}, {{-1, 0.5, 0.2, 0}, 1.5}, {{1.5, -1.8, 1, 0.2}, -0.7}};
  return map;
}

}  // namespace

TEST_CASE("energy and gradient are the same bits on any number of ranks") {
  const Samples samples = some_samples(53);
  const RationalMap map = some_map();
  const Evaluation whole = make_reference_evaluator(samples, {})->evaluate(map, true);
  std::vector<Evaluation> found;
  for (const int size : {1, 2, 3, 5}) {
    on_ranks(size, 5, kReference, [&](const EvaluatorFactory& make) {
      found.push_back(make(samples, {})->evaluate(map, true));
    });
  }
  for (const Evaluation& e : found) {
    CHECK(e.energy == found.front().energy);
    CHECK(e.gradient == found.front().gradient);
    CHECK(e.energy == Approx(whole.energy).epsilon(1e-12));
    for (std::size_t i = 0; i < whole.gradient.size(); ++i) {
      CHECK(e.gradient[i] == Approx(whole.gradient[i]).epsilon(1e-9).margin(1e-12));
    }
  }
}

TEST_CASE("fields come in the samples' order, curvature as a sum, options reach every rank") {
  const Samples samples = some_samples(20);
  const RationalMap map = some_map();
  const EnergyOptions options{Loss::tanh, 1, 3.0, 7.0};
  const auto whole = make_reference_evaluator(samples, options);
  on_ranks(2, 3, kReference, [&](const EvaluatorFactory& make) {
    const auto first = make(samples, options);
    const auto second = make(some_samples(4), {});
    CHECK(first->field(map) == whole->field(map));
    CHECK(first->evaluate(map, false).energy ==
          Approx(whole->evaluate(map, false).energy).epsilon(1e-12));
    CHECK(first->gauss_newton(map).isApprox(whole->gauss_newton(map), 1e-9));
    CHECK(second->field(map).size() == 4);
  });
}

TEST_CASE("more parts than samples") {
  on_ranks(2, 64, kReference, [&](const EvaluatorFactory& make) {
    CHECK(make(some_samples(3), {})->field(some_map()).size() == 3);
  });
}

TEST_CASE("an error of any rank is rank 0's to throw") {
  const EvaluatorFactory small = [](const Samples& samples, const EnergyOptions& options) {
    // The second part of five is a sample longer than the first.
    if (samples.size() > 1) throw Error("the device is full");
    return make_reference_evaluator(samples, options);
  };
  on_ranks(2, 2, small, [&](const EvaluatorFactory& make) {
    CHECK_THROWS_WITH(make(some_samples(3), {}), Contains("rank 1: the device is full"));
    CHECK(make(some_samples(2), {})->field(some_map()).size() == 2);
  });
}

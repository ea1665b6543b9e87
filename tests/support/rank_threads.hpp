#pragma once
/// Ranks that are threads of one process.

#include <barrier>
#include <vector>

#include "qjulia/fit/ranks.hpp"

namespace qjulia::test {

/// What the threads of one test share.
struct RankTable {
  explicit RankTable(int size) : meeting(size), said(static_cast<std::size_t>(size)) {}
  std::barrier<> meeting;
  std::vector<Ranks::Numbers> said;
};

class RankThread final : public Ranks {
 public:
  RankThread(RankTable& table, int rank) : table_(table), rank_(rank) {}
  int rank() const override { return rank_; }
  int size() const override { return static_cast<int>(table_.said.size()); }
  std::vector<Numbers> all_gather(const Numbers& mine) override {
    table_.said[static_cast<std::size_t>(rank_)] = mine;
    table_.meeting.arrive_and_wait();
    auto all = table_.said;
    table_.meeting.arrive_and_wait();
    return all;
  }

 private:
  RankTable& table_;
  int rank_;
};

}  // namespace qjulia::test

#pragma once
/// Processes that work on one thing together, on one machine or many. The library calls no message
/// passing itself: the command line does it over MPI, other programs as they like.

#include <cstddef>
#include <vector>

namespace qjulia {

/// This process among its fellows. Every call but `rank` and `size` is made by all of them, in the
/// same order.
class Ranks {
 public:
  using Numbers = std::vector<double>;

  virtual ~Ranks() = default;
  virtual int rank() const = 0;  ///< 0 … size − 1
  virtual int size() const = 0;
  /// Every rank's value, by rank. Waits for the last without keeping a core busy.
  virtual std::vector<int> all(int value) = 0;
  /// Rank 0's numbers, on every rank.
  virtual void broadcast(Numbers& numbers) = 0;
  /// What rank 0 has for this rank. @param parts by rank; only rank 0's count.
  virtual Numbers scatter(const std::vector<Numbers>& parts) = 0;
  /// On rank 0, what every rank has, by rank; elsewhere nothing.
  virtual std::vector<Numbers> gather(const Numbers& mine) = 0;

 protected:
  Ranks() = default;
  Ranks(const Ranks&) = default;
  Ranks& operator=(const Ranks&) = default;
};

}  // namespace qjulia

#pragma once
/// Processes that work on one thing together, on one machine or many. The library calls no message
/// passing itself: the command line does it over MPI, other programs as they like.

#include <vector>

namespace qjulia {

/// This process among its fellows. Every call but `rank` and `size` is made by all of them, in the
/// same order.
class Ranks {
 public:
  virtual ~Ranks() = default;
  virtual int rank() const = 0;  ///< 0 … size − 1
  virtual int size() const = 0;
  /// Every rank's value, by rank. Waits for the last without keeping a core busy.
  virtual std::vector<int> all(int value) = 0;

 protected:
  Ranks() = default;
  Ranks(const Ranks&) = default;
  Ranks& operator=(const Ranks&) = default;
};

}  // namespace qjulia

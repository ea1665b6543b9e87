#pragma once
/// Processes that work on one thing together, on one machine or many. The library itself calls no
/// message passing: the command does it over MPI, other programs as they like.

#include <string>
#include <vector>

namespace qjulia {

/// This process among those that run the same program (SPMD). All of them make the same calls in
/// the same order.
class Ranks {
 public:
  using Numbers = std::vector<double>;

  virtual ~Ranks() = default;
  virtual int rank() const = 0;  ///< 0 … size − 1
  virtual int size() const = 0;
  /// What every rank gives, by rank, on every rank. Lengths may differ. Returns when all have
  /// called it.
  virtual std::vector<Numbers> all_gather(const Numbers& mine) = 0;

  /// Bytes in the form that `all_gather` takes: a number from 0 to 255 for each byte, whether or
  /// not this machine's `char` has a sign.
  static Numbers numbers_of(const std::string& bytes);
  /// The bytes that `numbers_of` was given. @throws InputError when a number is not a byte.
  static std::string bytes_of(const Numbers& numbers);

 protected:
  Ranks() = default;
  Ranks(const Ranks&) = default;
  Ranks& operator=(const Ranks&) = default;
};

}  // namespace qjulia

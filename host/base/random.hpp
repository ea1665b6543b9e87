#pragma once
/// Random numbers that are the same with every standard library.

#include <cstdint>
#include <random>
#include <sstream>
#include <string>

namespace qjulia::base {

class Random {
 public:
  explicit Random(std::uint64_t seed) : bits_(seed) {}

  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits_() >> 11) * 0x1p-53; }
  /// Uniform in [low, high).
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  /// Uniform in 0 … count − 1.
  std::size_t index(std::size_t count) {
    return static_cast<std::size_t>(uniform(0, static_cast<double>(count)));
  }

  /// The state as the standard writes it, to go on from later.
  std::string state() const {
    std::ostringstream text;
    text.exceptions(std::ios::badbit);  // else a lack of memory cuts it short
    text << bits_;
    return text.str();
  }
  void set_state(const std::string& text) { std::istringstream(text) >> bits_; }

 private:
  std::mt19937_64 bits_;  ///< its sequence is fixed by the C++ standard
};

}  // namespace qjulia::base

#pragma once
/// Settings as functions of time, given by keys.

#include <string>
#include <string_view>
#include <vector>

#include "qjulia/base/setting.hpp"

namespace qjulia::film {

/// How a setting goes from one key to the next.
enum class Step {
  hold,    ///< it jumps when the next key comes
  linear,  ///< evenly
  ease,    ///< it starts and ends slowly: 3 t² − 2 t³
  spline,  ///< through all keys without a kink and without overshooting
};
/// @throws InputError that lists the words
Step step_named(std::string_view word);

/// What is before the first key and after the last.
enum class Loop {
  hold,       ///< the first and the last value
  cycle,      ///< the keys again and again
  ping_pong,  ///< to and fro
  offset,     ///< again and again, and each time on from where the last time has ended
};
Loop loop_named(std::string_view word);

struct Key {
  double time = 0;  ///< seconds
  std::vector<double> value;
  Step step = Step::spline;  ///< from this key to the next
};

class Track {
 public:
  /// @param keys of as many numbers each; logarithmic ones above 0, rotations of four numbers.
  /// @throws InputError where there are none, two have the same time, or a value cannot be used
  Track(std::vector<Key> keys, Interpolation interpolation, Loop loop = Loop::hold);

  /// The value at that time.
  std::vector<double> at(double time) const;
  /// The value at that time of the point that a camera looks at while it zooms. Where the zoom
  /// changes from one key of the point to the next, the point goes as the width of what is seen
  /// does, so that it moves evenly across the picture instead of rushing at the end.
  std::vector<double> at(double time, const Track& zoom) const;

 private:
  /// The time within the keys that stands for any time.
  double looped(double time) const;
  std::vector<double> between_keys(double time) const;
  double slope(std::size_t key, std::size_t number) const;

  std::vector<Key> keys_;  ///< in time's order; of logarithmic settings the logarithms
  Interpolation interpolation_;
  Loop loop_;
};

}  // namespace qjulia::film

#pragma once
/// Settings as functions of time, given by keys.

#include <optional>
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
  /// Evenly, and pan and zoom together so that the picture always moves equally fast.
  geodesic,
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
  std::string place{};       ///< where a user finds it, such as "turn.toml:12"; for messages
};

/// @throws InputError for a value that no key of such a setting can have
void expect_value(const std::vector<double>& value, Interpolation interpolation);

/// Where a camera looks, and how closely.
struct Gaze {
  std::vector<double> look_at;
  double zoom = 1;
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

  /// Between keys of the step `geodesic` that both tracks have at the same times: what the camera
  /// sees at that time (film/geodesic.hpp). None at other times.
  /// @param width that a zoom of 1 shows, in the unit of the point.
  static std::optional<Gaze> gaze(double time, const Track& look_at, const Track& zoom,
                                  double width);

  /// The place of the key that the value at that time comes from: the last one, or else the first.
  const std::string& place(double time) const;

 private:
  /// The keys before and after a time; none before the first and after the last.
  struct Between {
    const Key *from, *to;
    double way;  ///< 0 at the first, 1 at the second
  };
  std::optional<Between> between(double time) const;
  /// The time within the keys that stands for any time.
  double looped(double time) const;
  std::vector<double> between_keys(double time) const;
  double slope(std::size_t key, std::size_t number) const;

  std::vector<Key> keys_;             ///< in time's order; of logarithmic settings the logarithms
  std::vector<double> least_, most_;  ///< by number, over the keys
  Interpolation interpolation_;
  Loop loop_;
};

}  // namespace qjulia::film

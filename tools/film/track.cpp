#include "film/track.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

#include "film/geodesic.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::film {
namespace {

template <class Enumeration, std::size_t Count>
Enumeration named(std::string_view word, const std::array<const char*, Count>& words) {
  const auto found = std::ranges::find(words, word);
  if (found == words.end()) {
    throw InputError(fmt::format("'{}' is none of {}", word, fmt::join(words, ", ")));
  }
  return static_cast<Enumeration>(found - words.begin());
}

using Vector = Eigen::Map<const Eigen::VectorXd>;

Vector vector_of(const std::vector<double>& value) {
  return {value.data(), static_cast<Eigen::Index>(value.size())};
}

/// Along the shortest turn between two versors.
std::vector<double> turned(const std::vector<double>& from, const std::vector<double>& to,
                           double way) {
  const Eigen::VectorXd a = vector_of(from).normalized();
  Eigen::VectorXd b = vector_of(to).normalized();
  if (a.dot(b) < 0) b = -b;
  const double angle = std::acos(std::min(1.0, a.dot(b)));
  constexpr double kSmall = 1e-6;  // there a straight line is as good
  const double left = angle < kSmall ? 1 - way : std::sin((1 - way) * angle) / std::sin(angle);
  const double right = angle < kSmall ? way : std::sin(way * angle) / std::sin(angle);
  const Eigen::VectorXd between = (left * a + right * b).normalized();
  return {between.begin(), between.end()};
}

}  // namespace

Step step_named(std::string_view word) {
  return named<Step>(word, std::array{"hold", "linear", "ease", "spline", "geodesic"});
}

Loop loop_named(std::string_view word) {
  return named<Loop>(word, std::array{"hold", "cycle", "ping-pong", "offset"});
}

void expect_value(const std::vector<double>& value, Interpolation interpolation) {
  if (!std::ranges::all_of(value, [](double v) { return std::isfinite(v); })) {
    throw InputError("the value must be finite");
  }
  if (interpolation == Interpolation::rotation && !(vector_of(value).norm() > 0)) {
    throw InputError("the value is zero, which is no turn");
  }
  if (interpolation == Interpolation::logarithmic &&
      !std::ranges::all_of(value, [](double v) { return v > 0; })) {
    throw InputError("the value must be above 0");
  }
}

Track::Track(std::vector<Key> keys, Interpolation interpolation, Loop loop)
    : keys_(std::move(keys)), interpolation_(interpolation), loop_(loop) {
  if (keys_.empty()) throw InputError("it has no keys");
  std::ranges::stable_sort(keys_, {}, &Key::time);
  const auto same = std::ranges::adjacent_find(keys_, {}, &Key::time);
  if (same != keys_.end()) {
    throw InputError(fmt::format(
        "it has two keys at {} seconds{}", same->time,
        same->place.empty() ? ""
                            : fmt::format(" ({} and {})", same->place, std::next(same)->place)));
  }
  least_ = most_ = keys_.front().value;
  for (Key& key : keys_) {
    if (key.value.size() != keys_.front().value.size()) {
      throw InputError("its keys have different numbers of values");
    }
    expect_value(key.value, interpolation_);
    for (std::size_t i = 0; i < key.value.size(); ++i) {
      least_[i] = std::min(least_[i], key.value[i]);
      most_[i] = std::max(most_[i], key.value[i]);
    }
    if (interpolation_ != Interpolation::logarithmic) continue;
    for (double& number : key.value) number = std::log(number);
  }
}

const std::string& Track::place(double time) const {
  const auto after = std::ranges::upper_bound(keys_, looped(time), {}, &Key::time);
  return (after == keys_.begin() ? keys_.front() : *std::prev(after)).place;
}

double Track::looped(double time) const {
  const double begin = keys_.front().time, length = keys_.back().time - begin;
  if (length == 0 || loop_ == Loop::hold) return time;
  const double turns = std::floor((time - begin) / length);
  const double within = time - turns * length;
  const bool is_back = loop_ == Loop::ping_pong && std::fmod(std::abs(turns), 2.0) == 1;
  return is_back ? 2 * begin + length - within : within;
}

std::vector<double> Track::at(double time, const Track& zoom) const {
  const double within = looped(time);
  const auto after = std::ranges::upper_bound(keys_, within, {}, &Key::time);
  if (after == keys_.begin() || after == keys_.end() || loop_ == Loop::offset) return at(time);
  const Key& key = *std::prev(after);
  const double from = 1 / zoom.at(key.time).front(), to = 1 / zoom.at(after->time).front();
  constexpr double kLeastChange = 1.01;
  if (key.step == Step::hold || std::max(from / to, to / from) < kLeastChange) return at(time);
  // Where the zoom goes to and fro, the point would too.
  constexpr int kLooks = 32;
  double last = from;
  for (int i = 1; i <= kLooks; ++i) {
    const double width = 1 / zoom.at(std::lerp(key.time, after->time, double(i) / kLooks)).front();
    if ((width - last) * (to - from) < 0) return at(time);
    last = width;
  }
  const double way = (1 / zoom.at(within).front() - from) / (to - from);
  std::vector<double> value;
  for (std::size_t i = 0; i < key.value.size(); ++i) {
    value.push_back(std::lerp(key.value[i], after->value[i], way));
  }
  return value;
}

std::optional<Track::Between> Track::between(double time) const {
  const double within = looped(time);
  const auto after = std::ranges::upper_bound(keys_, within, {}, &Key::time);
  if (after == keys_.begin() || after == keys_.end()) return std::nullopt;
  const Key& from = *std::prev(after);
  return Between{&from, &*after, (within - from.time) / (after->time - from.time)};
}

std::optional<Gaze> Track::gaze(double time, const Track& look_at, const Track& zoom,
                                double width) {
  const auto point = look_at.between(time), closeness = zoom.between(time);
  if (!point || !closeness || look_at.loop_ == Loop::offset || zoom.loop_ == Loop::offset) {
    return std::nullopt;
  }
  const bool are_together = point->from->time == closeness->from->time &&
                            point->to->time == closeness->to->time && point->way == closeness->way;
  if (!are_together || point->from->step != Step::geodesic ||
      closeness->from->step != Step::geodesic) {
    return std::nullopt;
  }
  const auto from = vector_of(point->from->value), to = vector_of(point->to->value);
  const double distance = (to - from).norm();
  const auto width_of = [&](const Key& key) { return width / std::exp(key.value.front()); };
  const Geodesic geodesic(distance, width_of(*closeness->from), width_of(*closeness->to));
  const Sight sight = geodesic.at(point->way);
  const double share = distance > 0 ? sight.panned / distance : 0;
  const Eigen::VectorXd seen = from + share * (to - from);
  return Gaze{{seen.begin(), seen.end()}, width / sight.width};
}

std::vector<double> Track::at(double time) const {
  const double length = keys_.back().time - keys_.front().time;
  std::vector<double> value = between_keys(looped(time));
  const bool goes_on = loop_ == Loop::offset && length > 0;
  const double turns = goes_on ? std::floor((time - keys_.front().time) / length) : 0;
  for (std::size_t i = 0; i < value.size(); ++i) {
    value[i] += turns * (keys_.back().value[i] - keys_.front().value[i]);
    if (interpolation_ != Interpolation::logarithmic) continue;
    value[i] = std::exp(value[i]);
    // Nothing overshoots, but for the rounding of exp: a key may have the largest value there is.
    if (!goes_on) value[i] = std::clamp(value[i], least_[i], most_[i]);
  }
  return value;
}

std::vector<double> Track::between_keys(double time) const {
  const auto after = std::ranges::upper_bound(keys_, time, {}, &Key::time);
  if (after == keys_.begin()) return keys_.front().value;
  const Key& key = *std::prev(after);
  if (after == keys_.end() || key.step == Step::hold || interpolation_ == Interpolation::none) {
    return key.value;
  }
  const double length = after->time - key.time, t = (time - key.time) / length;
  const double eased = t * t * (3 - 2 * t);
  if (interpolation_ == Interpolation::rotation) {
    return turned(key.value, after->value,
                  key.step == Step::ease || key.step == Step::spline ? eased : t);
  }
  const auto number = static_cast<std::size_t>(after - keys_.begin());
  std::vector<double> value;
  for (std::size_t i = 0; i < key.value.size(); ++i) {
    const double from = key.value[i], to = after->value[i];
    if (key.step != Step::spline) {
      value.push_back(std::lerp(from, to, key.step == Step::ease ? eased : t));
      continue;
    }
    // The cubic of Hermite with these slopes.
    const double left = length * slope(number - 1, i), right = length * slope(number, i);
    value.push_back(from + t * left + t * t * (3 * (to - from) - 2 * left - right) +
                    t * t * t * (2 * (from - to) + left + right));
  }
  return value;
}

/// Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5, 1984): monotone where the keys are, so that
/// nothing overshoots. At the ends the parabola through three keys, so that motion does not end
/// flat.
double Track::slope(std::size_t key, std::size_t number) const {
  const auto rise = [&](std::size_t k) {
    return (keys_[k + 1].value[number] - keys_[k].value[number]) /
           (keys_[k + 1].time - keys_[k].time);
  };
  const auto span = [&](std::size_t k) { return keys_[k + 1].time - keys_[k].time; };
  const std::size_t last = keys_.size() - 1;
  if (last == 1) return rise(0);
  if (key > 0 && key < last) {
    const double before = rise(key - 1), after = rise(key);
    if (before * after <= 0) return 0;
    const double a = span(key - 1) + 2 * span(key), b = 2 * span(key - 1) + span(key);
    return (a + b) / (b / before + a / after);
  }
  const bool is_first = key == 0;
  const double near = is_first ? rise(0) : rise(last - 1);
  const double far = is_first ? rise(1) : rise(last - 2);
  const double near_span = is_first ? span(0) : span(last - 1);
  const double far_span = is_first ? span(1) : span(last - 2);
  const double end = near + (near - far) * near_span / (near_span + far_span);
  // Steeper than three times the rise would overshoot, and against it would turn back.
  if (end * near <= 0) return 0;
  return std::abs(end) > 3 * std::abs(near) ? 3 * near : end;
}

}  // namespace qjulia::film

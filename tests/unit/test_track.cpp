// Settings as functions of time.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "film/encoder.hpp"
#include "film/track.hpp"
#include "qjulia/base/error.hpp"

using namespace qjulia;
using film::Key;
using film::Loop;
using film::Step;
using film::Track;

namespace {

Track track_of(const std::vector<std::pair<double, double>>& keys, Step step,
               Loop loop = Loop::hold, Interpolation interpolation = Interpolation::linear) {
  std::vector<Key> made;
  for (const auto& [time, value] : keys) made.push_back({time, {value}, step});
  return {made, interpolation, loop};
}

double at(const Track& track, double time) { return track.at(time).front(); }

}  // namespace

TEST_CASE("a track goes through its keys and stays at its ends") {
  for (const Step step : {Step::hold, Step::linear, Step::ease, Step::spline}) {
    const Track track = track_of({{3, 2}, {1, 5}, {4, 2.5}, {7, -1}}, step);
    CHECK(at(track, 0) == 5);
    CHECK(at(track, 1) == 5);
    CHECK(at(track, 3) == Catch::Approx(2));
    CHECK(at(track, 4) == Catch::Approx(2.5));
    CHECK(at(track, 7) == -1);
    CHECK(at(track, 9) == -1);
  }
  const Track held = track_of({{0, 1}, {2, 3}}, Step::hold);
  CHECK(at(held, 1.999) == 1);
  CHECK(at(track_of({{0, 1}, {2, 3}}, Step::linear), 0.5) == 1.5);
  const Track eased = track_of({{0, 0}, {1, 1}}, Step::ease);
  CHECK(at(eased, 0.01) < 0.001);
  CHECK(at(eased, 0.5) == 0.5);
  CHECK(at(eased, 0.99) > 0.999);
}

TEST_CASE("a spline neither overshoots nor has a kink nor ends flat") {
  const std::vector<std::pair<double, double>> keys{{0, 0},   {1, 0}, {2, 1},
                                                    {2.5, 1}, {6, 9}, {7, 4}};
  const Track track = track_of(keys, Step::spline);
  for (std::size_t i = 0; i + 1 < keys.size(); ++i) {
    const auto [low, high] = std::minmax(keys[i].second, keys[i + 1].second);
    for (int k = 0; k <= 40; ++k) {
      const double value = at(track, std::lerp(keys[i].first, keys[i + 1].first, k / 40.0));
      CHECK(value >= low - 1e-12);
      CHECK(value <= high + 1e-12);
    }
  }
  const double h = 1e-6;
  for (const double time : {1.0, 2.0, 2.5, 6.0}) {
    const double before = (at(track, time) - at(track, time - h)) / h;
    const double after = (at(track, time + h) - at(track, time)) / h;
    CHECK(after == Catch::Approx(before).margin(1e-4));
  }
  const Track even = track_of({{0, 0}, {1, 1}, {2, 2}}, Step::spline);
  for (const double time : {0.1, 0.7, 1.9}) CHECK(at(even, time) == Catch::Approx(time));
}

TEST_CASE("ratios, turns and loops") {
  const Track zoom =
      track_of({{0, 1}, {2, 100}}, Step::linear, Loop::hold, Interpolation::logarithmic);
  CHECK(at(zoom, 1) == Catch::Approx(10));
  const double root = std::sqrt(0.5);
  const Track phase({{0, {1, 0, 0, 0}, Step::linear}, {1, {0, -2, 0, 0}, Step::linear}},
                    Interpolation::rotation);
  const std::vector<double> half = phase.at(0.5);
  CHECK(half[0] == Catch::Approx(root));
  CHECK(half[1] == Catch::Approx(-root));
  const auto looped = [](Loop loop, double time) {
    return at(track_of({{1, 0}, {3, 10}}, Step::linear, loop), time);
  };
  CHECK(looped(Loop::cycle, 4) == Catch::Approx(5));
  CHECK(looped(Loop::cycle, 0) == Catch::Approx(5));
  CHECK(looped(Loop::ping_pong, 4) == Catch::Approx(5));
  CHECK(looped(Loop::ping_pong, 3.5) == Catch::Approx(7.5));
  CHECK(looped(Loop::offset, 4) == Catch::Approx(15));
  CHECK(looped(Loop::offset, 0) == Catch::Approx(-5));
  // Beyond 360 degrees nothing is shortened.
  CHECK(at(track_of({{0, 0}, {1, 720}}, Step::linear), 0.75) == 540);
}

TEST_CASE("a point that is looked at moves evenly across the picture while the camera zooms") {
  const Track zoom =
      track_of({{0, 1}, {4, 100}}, Step::linear, Loop::hold, Interpolation::logarithmic);
  const Track point({{0, {0, 0, 0}}, {4, {2, -4, 0}}}, Interpolation::linear);
  CHECK(point.at(0, zoom) == std::vector<double>{0, 0, 0});
  CHECK(point.at(4, zoom) == std::vector<double>{2, -4, 0});
  // There is a place that stays where it is in the picture: where the ways meet.
  const double fixed = 2 / (1 - 0.01);
  for (const double time : {0.0, 1.0, 2.5, 3.9}) {
    const double seen = (fixed - point.at(time, zoom).front()) * zoom.at(time).front();
    CHECK(seen == Catch::Approx(fixed));
  }
  const Track there_and_back =
      track_of({{0, 1}, {2, 30}, {4, 2}}, Step::spline, Loop::hold, Interpolation::logarithmic);
  for (const double time : {0.5, 2.0, 3.5}) CHECK(point.at(time, there_and_back) == point.at(time));
  const Track still = track_of({{0, 3}, {4, 3}}, Step::linear);
  CHECK(point.at(2, still) == point.at(2));
}

TEST_CASE("keys of no use are refused") {
  using Catch::Matchers::ContainsSubstring;
  CHECK_THROWS_WITH(track_of({}, Step::hold), ContainsSubstring("no keys"));
  CHECK_THROWS_WITH(track_of({{1, 0}, {1, 2}}, Step::hold), ContainsSubstring("two keys at 1"));
  CHECK_THROWS_WITH(track_of({{0, 0}, {1, 2}}, Step::hold, Loop::hold, Interpolation::logarithmic),
                    ContainsSubstring("above 0"));
  CHECK_THROWS_WITH(Track({{0, {0, 0, 0, 0}}}, Interpolation::rotation),
                    ContainsSubstring("no turn"));
  CHECK_THROWS_WITH(Track({{0, {1}}, {1, {1, 2}}}, Interpolation::linear),
                    ContainsSubstring("of no use"));
  CHECK_THROWS_WITH(film::step_named("fast"), ContainsSubstring("hold, linear, ease, spline"));
  CHECK_THROWS_WITH(film::loop_named("fast"), ContainsSubstring("ping-pong"));
}

TEST_CASE("each type of film has its encoder's words") {
  for (const std::string& type : film::film_types()) {
    const auto words = film::encoder_words({"fol%der", "film" + type, 24, 7, false, "note"});
    CHECK(words.front() == "ffmpeg");
    CHECK(words.back() == "file:film" + type);
    CHECK(std::ranges::count(words, "file:fol%%der/frame_%04d.png") == 1);
    CHECK(std::ranges::count(words, "7") == 1);
    CHECK(std::ranges::count(words, "24") == 1);
    CHECK(std::ranges::count(words, "comment=note") == 1);
  }
  CHECK(film::frame_name(7) == "frame_0007.png");
}

// Settings as functions of time.

#include <catch2/catch_all.hpp>
#include <cmath>

#include "film/encoder.hpp"
#include "film/geodesic.hpp"
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

TEST_CASE("what goes by ratios does not leave the range of its keys, not even by rounding") {
  for (const double most : {0.1, 0.3, 0.7, 1.1, 30.0}) {
    const Track track =
        track_of({{0, 0.02}, {1.8, most}}, Step::ease, Loop::hold, Interpolation::logarithmic);
    CHECK(at(track, 5) == most);
    CHECK(at(track, -1) == 0.02);
    CHECK(at(track, 1.8 - 1e-9) <= most);
  }
}

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
                    ContainsSubstring("different numbers"));
  CHECK_THROWS_WITH(film::step_named("fast"), ContainsSubstring("hold, linear, ease, spline"));
  CHECK_THROWS_WITH(film::loop_named("fast"), ContainsSubstring("ping-pong"));
}

TEST_CASE("each type of film has its encoder's words") {
  for (const std::string& type : film::film_types()) {
    const auto words = film::encoder_words({"fol%der", "film" + type, 24, 7, 1, false, "note"});
    CHECK(words.front() == "ffmpeg");
    CHECK(words.back() == "file:film" + type);
    CHECK(std::ranges::count(words, "file:fol%%der/frame_%04d.png") == 1);
    CHECK(std::ranges::count(words, "7") == 1);
    CHECK(std::ranges::count(words, "24") == 1);
    CHECK(std::ranges::count(words, "comment=note") == 1);
  }
  CHECK(film::frame_name(7) == "frame_0007.png");
}

TEST_CASE("a value comes from the key before it") {
  const Track track({{1, {1}, Step::linear, "a:1"}, {2, {3}, Step::linear, "a:2"}},
                    Interpolation::linear);
  CHECK(track.place(0) == "a:1");
  CHECK(track.place(1.5) == "a:1");
  CHECK(track.place(2) == "a:2");
  CHECK(track.place(9) == "a:2");
}

TEST_CASE("films have the sizes that their types can have") {
  CHECK_NOTHROW(film::expect_size("a.mp4", 2, 3, false));
  CHECK_THROWS_AS(film::expect_size("a.mp4", 1, 9, false), InputError);
  CHECK_NOTHROW(film::expect_size("a.webm", 64, 65, false));
  CHECK_THROWS_AS(film::expect_size("a.webm", 640, 63, false), InputError);
  CHECK_NOTHROW(film::expect_size("a.webm", 16, 16, true));  // VP9
  CHECK_NOTHROW(film::expect_size("a.gif", 1, 1, false));
  CHECK_THROWS_AS(film::expect_size("a.webp", 16384, 1, false), InputError);
}

TEST_CASE("a geodesic is that of van Wijk and Nuij: equally fast everywhere, and shortest") {
  constexpr double kRho2 = film::Geodesic::kRho * film::Geodesic::kRho;
  // The metric, over a step so short that it is straight.
  const auto length_of = [](const film::Sight& a, const film::Sight& b) {
    const double width = std::sqrt(a.width * b.width);
    return std::hypot(film::Geodesic::kRho * (b.panned - a.panned) / width,
                      (b.width - a.width) / (film::Geodesic::kRho * width));
  };
  struct Case {
    double distance, from, to;
  };
  for (const Case& c : {Case{1, 1, 1}, Case{1, 3, 0.03}, Case{5, 0.1, 0.2}, Case{0, 2, 1e-6},
                        Case{1e-9, 1, 4}, Case{0.3, 1e-6, 1}, Case{1000, 1, 1}}) {
    CAPTURE(c.distance, c.from, c.to);
    const film::Geodesic path(c.distance, c.from, c.to);
    CHECK(path.at(0).panned == Catch::Approx(0).margin(1e-9 * c.from));
    CHECK(path.at(0).width == Catch::Approx(c.from));
    CHECK(path.at(1).panned == Catch::Approx(c.distance).margin(1e-9));
    CHECK(path.at(1).width == Catch::Approx(c.to).epsilon(1e-6));
    constexpr int kSteps = 4000;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const film::Sight a = path.at(double(i) / kSteps), b = path.at((i + 1.0) / kSteps);
      CHECK(b.panned >= a.panned);
      const double step = length_of(a, b);
      CHECK(step * kSteps == Catch::Approx(path.length()).epsilon(2e-3));
      sum += step;
    }
    CHECK(sum == Catch::Approx(path.length()).epsilon(1e-4));
  }
  // The paper's closed form, equation (9), as it stands there.
  const double distance = 2, from = 0.5, to = 0.7;
  const double b0 =
      (to * to - from * from + kRho2 * kRho2 * distance * distance) / (2 * from * kRho2 * distance);
  const double b1 =
      (to * to - from * from - kRho2 * kRho2 * distance * distance) / (2 * to * kRho2 * distance);
  const double r0 = std::log(-b0 + std::sqrt(b0 * b0 + 1));
  const double r1 = std::log(-b1 + std::sqrt(b1 * b1 + 1));
  const double length = (r1 - r0) / film::Geodesic::kRho;
  const film::Geodesic path(distance, from, to);
  CHECK(path.length() == Catch::Approx(length));
  const double r = film::Geodesic::kRho * 0.3 * length + r0;
  CHECK(path.at(0.3).panned ==
        Catch::Approx(from / kRho2 * (std::cosh(r0) * std::tanh(r) - std::sinh(r0))));
  CHECK(path.at(0.3).width == Catch::Approx(from * std::cosh(r0) / std::cosh(r)));
  CHECK(path.at(0.5).width > 1);  // from far away the whole way is seen
}

TEST_CASE("keys of pan and zoom together make a geodesic") {
  const std::vector<Key> points{{0, {0, 0, 0}, Step::geodesic}, {2, {3, 4, 0}, Step::geodesic}};
  const Track look_at(points, Interpolation::linear);
  const Track zoom({{0, {10}, Step::geodesic}, {2, {20}, Step::geodesic}},
                   Interpolation::logarithmic);
  const auto begin = Track::gaze(0, look_at, zoom, 1), middle = Track::gaze(1, look_at, zoom, 1);
  REQUIRE(begin);
  CHECK(begin->zoom == Catch::Approx(10));
  REQUIRE(middle);
  const film::Geodesic path(5, 0.1, 0.05);
  CHECK(middle->zoom == Catch::Approx(1 / path.at(0.5).width));
  CHECK(middle->look_at[0] == Catch::Approx(0.6 * path.at(0.5).panned));
  CHECK(middle->look_at[1] == Catch::Approx(0.8 * path.at(0.5).panned));
  CHECK_FALSE(Track::gaze(3, look_at, zoom, 1));
  const Track other({{0, {10}, Step::geodesic}, {3, {20}, Step::geodesic}},
                    Interpolation::logarithmic);
  CHECK_FALSE(Track::gaze(1, look_at, other, 1));
  const Track even({{0, {10}, Step::linear}, {2, {20}, Step::linear}}, Interpolation::logarithmic);
  CHECK_FALSE(Track::gaze(1, look_at, even, 1));
}

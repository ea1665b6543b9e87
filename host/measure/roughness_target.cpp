#include "qjulia/surface/roughness_target.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "qjulia/base/error.hpp"
#include "qjulia/map/detail.hpp"
#include "qjulia/map/knob_table.hpp"
#include "qjulia/mesh/shape.hpp"
#include "qjulia/surface/roughness.hpp"

namespace qjulia {
namespace {

constexpr double kNearRatio = 0.005;      ///< of ln area and ln volume
constexpr double kNearDimension = 0.005;  ///< boxes leave an error of about 0.02
constexpr double kBracketStep = 0.35;     ///< of ln detail, while the target is not yet between two
constexpr int kMostSurfaces = 60;
constexpr int kMostRounds = 6;    ///< of detail and scale in turn
constexpr double kMostScale = 4;  ///< and its inverse the least

std::vector<SettingOf<RoughnessTarget>> make_target_settings() {
  return {
      {{.name = "target_area",
        .values = "RATIO",
        .least = 1,
        .most = 100,
        .left_out = "none",
        .example = "1.2",
        .help = "Find the detail at which the surface has this many times the reference's area, "
                "to half a per cent: n = 6, without loose pieces, `target_resolution` cells. It "
                "is searched from the detail that is given otherwise"},
       [](RoughnessTarget& t) -> ValuePlace { return &t.area; }},
      {{.name = "target_dimension",
        .values = "NUMBER",
        .least = 1.5,
        .most = 3,
        .left_out = "none",
        .example = "2.05",
        .help = "Find the detail at which that surface has this box-counting dimension, as 'qjulia "
                "info' "
                "measures it, to 0.005"},
       [](RoughnessTarget& t) -> ValuePlace { return &t.dimension; }},
      {{.name = "target_volume",
        .values = "RATIO",
        .least = 0.1,
        .most = 10,
        .left_out = "none",
        .example = "1",
        .help = "With an area or a dimension: also turn the map's scale, so that the surface "
                "encloses this many times the reference's volume, to half a per cent"},
       [](RoughnessTarget& t) -> ValuePlace { return &t.volume; }},
      {{.name = "target_resolution",
        .values = "INT",
        .unit = "cells",
        .least = 64,
        .most = 2048,
        .example = "64",
        .help = "Cells along the longest side of the box of the surface that is measured: a rough "
                "surface has more area the finer its cells are"},
       [](RoughnessTarget& t) -> ValuePlace { return &t.resolution; }},
  };
}

/// A detail and a scale that were tried.
struct RoughTrial {
  double log_detail = 0;
  double log_scale = 0;
  SurfaceFigures figures;
};

class TargetSearch {
 public:
  TargetSearch(const Device& device, const Map& map, const RoughnessTarget& target,
               const RoughnessReference& reference, const ProgressMonitor& monitor)
      : device_(device), map_(map), target_(target), reference_(reference), monitor_(monitor) {
    const Knob& detail = knob_named("detail");
    if (const std::string why = detail.why_not(map); !why.empty()) {
      throw OptionError("detail", why);
    }
    most_detail_ = std::min(kMostDetail, detail.most_of(map));
    least_ = std::log(kLeastDetail);
    most_ = std::log(most_detail_);
  }

  TargetedMap found() {
    RoughTrial best = with_wanted_roughness(std::log(map_.frame.detail.value()), 0);
    if (target_.volume) best = with_wanted_volume(best);
    TargetedMap result;
    result.map = turned(best);
    result.detail = detail_of(best);
    result.scale = std::exp(best.log_scale);
    result.figures = best.figures;
    result.reference = reference_;
    result.surfaces = surfaces_;
    return result;
  }

 private:
  /// exp ∘ ln may leave the range by a rounding.
  double detail_of(const RoughTrial& trial) const {
    return std::clamp(std::exp(trial.log_detail), kLeastDetail, most_detail_);
  }

  Map turned(const RoughTrial& trial) const {
    MapKnobs knobs;
    knobs.detail = detail_of(trial);
    if (trial.log_scale != 0) knobs.scale = std::exp(trial.log_scale);
    return with_knobs(device_, map_, knobs);
  }

  RoughTrial tried(double log_detail, double log_scale) {
    throw_if_stopped(monitor_.stop);
    RoughTrial trial{log_detail, log_scale, {}};
    const RoughnessOptions options{.resolution = target_.resolution};
    trial.figures = figures_of_set(device_, turned(trial), options, monitor_);
    ++surfaces_;
    if (std::isnan(excess(trial))) {
      throw OptionError(
          "target_resolution",
          fmt::format("{} cells are too coarse to count boxes; give more", target_.resolution));
    }
    monitor_.report({"finding the detail",
                     static_cast<double>(surfaces_) / (surfaces_ + kExpectedMore), -1,
                     fmt::format("detail {:.3g}: {}", detail_of(trial), reached(trial))});
    return trial;
  }

  double area_ratio(const RoughTrial& t) const { return t.figures.area / reference_.area; }
  double volume_ratio(const RoughTrial& t) const { return t.figures.volume / reference_.volume; }

  /// How much rougher than wanted: ln of areas, or a difference of dimensions.
  double excess(const RoughTrial& t) const {
    return target_.area ? std::log(area_ratio(t) / *target_.area)
                        : t.figures.dimension - target_.dimension.value();
  }
  double nearness() const { return target_.area ? kNearRatio : kNearDimension; }
  bool is_near(const RoughTrial& t) const { return std::abs(excess(t)) <= nearness(); }

  std::string reached(const RoughTrial& t) const {
    return target_.area ? fmt::format("{:.3f} times the area", area_ratio(t))
                        : fmt::format("dimension {:.3f}", t.figures.dimension);
  }

  /// The set grows rougher with the detail until it dissolves: towards a detail on the other side
  /// of the target, then between the two.
  RoughTrial with_wanted_roughness(double log_detail, double log_scale) {
    RoughTrial at = tried(std::clamp(log_detail, least_, most_), log_scale);
    if (is_near(at)) return at;
    RoughTrial beyond = at, nearest = at;
    int declines = 0;  // in a row: one may be chance
    while (excess(beyond) * excess(at) > 0) {
      at = beyond;
      const double step = excess(at) < 0 ? kBracketStep : -kBracketStep;
      const double next = std::clamp(at.log_detail + step, least_, most_);
      if (next == at.log_detail || declines == 2) throw unreachable(nearest);
      beyond = tried(next, log_scale);
      if (is_near(beyond)) return beyond;
      const bool is_nearer = std::abs(excess(beyond)) < std::abs(excess(nearest));
      declines = is_nearer ? 0 : declines + 1;
      if (is_nearer) nearest = beyond;
    }
    return between(at, beyond);
  }

  /// By regula falsi, with a step to the middle whenever an end stays twice.
  RoughTrial between(RoughTrial a, RoughTrial b) {
    int stayed = 0;  // > 0: how often a stayed; < 0: b
    while (surfaces_ < kMostSurfaces && std::abs(b.log_detail - a.log_detail) > 1e-5) {
      const double share = std::abs(stayed) >= 2 ? 0.5 : excess(a) / (excess(a) - excess(b));
      const RoughTrial middle =
          tried(a.log_detail + share * (b.log_detail - a.log_detail), a.log_scale);
      if (is_near(middle)) return middle;
      const bool is_on_side_of_a = excess(middle) * excess(a) > 0;
      stayed = is_on_side_of_a ? std::min(stayed, 0) - 1 : std::max(stayed, 0) + 1;
      (is_on_side_of_a ? a : b) = middle;
    }
    throw unreachable(std::abs(excess(a)) < std::abs(excess(b)) ? a : b);
  }

  bool has_wanted_volume(const RoughTrial& t) const {
    return std::abs(std::log(volume_ratio(t) / target_.volume.value())) <= kNearRatio;
  }

  /// Scale by secants for the volume, then the detail again, until both hold.
  RoughTrial with_wanted_volume(RoughTrial at) {
    // ln V rises by about δ · diagonal · A / V for a step of 1 in ln s.
    double slope =
        detail_of(at) * map_.frame.own_diagonal().value() * at.figures.area / at.figures.volume;
    for (int round = 0; round < kMostRounds && !has_wanted_volume(at); ++round) {
      const double missing = std::log(target_.volume.value() / volume_ratio(at));
      const double log_scale = at.log_scale + missing / slope;
      if (!(std::abs(log_scale) <= std::log(kMostScale))) throw no_volume(at);
      const RoughTrial scaled = with_wanted_roughness(at.log_detail, log_scale);
      const double risen = std::log(volume_ratio(scaled) / volume_ratio(at));
      const double measured = risen / (log_scale - at.log_scale);
      if (measured > 0) slope = measured;
      at = scaled;
    }
    if (!has_wanted_volume(at)) throw no_volume(at);
    return at;
  }

  OptionError unreachable(const RoughTrial& nearest) const {
    const bool is_area = target_.area.has_value();
    const double wanted = is_area ? *target_.area : target_.dimension.value();
    const bool is_least = excess(nearest) > 0;
    return {is_area ? "target_area" : "target_dimension",
            fmt::format("{} cannot be reached: at {} cells this map has {} at {}, with a detail of "
                        "{:.3g}; {}",
                        wanted, target_.resolution, reached(nearest), is_least ? "least" : "most",
                        detail_of(nearest),
                        is_least ? "ask for more" : "ask for less, or measure with finer cells")};
  }

  OptionError no_volume(const RoughTrial& nearest) const {
    return {
        "target_volume",
        fmt::format("{} cannot be reached: the scale {:.3g} gives {:.3f} times the volume; ask "
                    "for one nearer to it",
                    target_.volume.value(), std::exp(nearest.log_scale), volume_ratio(nearest))};
  }

  static constexpr double kExpectedMore = 6;

  const Device& device_;
  const Map& map_;
  const RoughnessTarget& target_;
  const RoughnessReference& reference_;
  const ProgressMonitor& monitor_;
  double most_detail_ = 0;
  double least_ = 0, most_ = 0;  ///< ln detail
  int surfaces_ = 0;
};

}  // namespace

std::span<const SettingOf<RoughnessTarget>> target_settings() {
  static const std::vector<SettingOf<RoughnessTarget>> all = make_target_settings();
  return all;
}

void RoughnessTarget::validate() const {
  expect_in_ranges(target_settings(), *this);
  if (area && dimension) {
    throw OptionError("target_dimension",
                      "it and an area are both reached by the detail; give one of them");
  }
  if (volume && !area && !dimension) {
    throw OptionError("target_volume", "it goes with an area or a dimension; give one of them too");
  }
  if (!is_set() && resolution != RoughnessTarget{}.resolution) {
    throw OptionError("target_resolution",
                      "there is no target to measure; give an area or a dimension too");
  }
}

RoughnessReference reference_of(const Device& device, const TriangleMesh& mesh,
                                const std::stop_token& stop) {
  mesh.validate();
  const SurfaceFigures figures = measure(outer_surface(device, mesh, stop).mesh, stop);
  return {figures.area, figures.volume};
}

TargetedMap with_roughness(const Device& device, const Map& map, const RoughnessTarget& target,
                           const std::optional<RoughnessReference>& reference,
                           const ProgressMonitor& monitor) {
  target.validate();
  map.validate();
  if (!target.is_set()) {
    throw InputError("give an area or a dimension that the map's set is to have");
  }
  RoughnessReference against;
  if (reference) {
    against = *reference;
  } else {
    const SurfaceFigures smooth =
        figures_of_set(device, map, {.resolution = target.resolution, .iterations = 1}, monitor);
    against = {smooth.area, smooth.volume};
  }
  if (!(against.area > 0 && std::isfinite(against.area)) ||
      (target.volume && !(against.volume > 0 && std::isfinite(against.volume)))) {
    throw InputError("what the set is measured against has no area, or encloses no volume");
  }
  return TargetSearch(device, map, target, against, monitor).found();
}

nlohmann::json to_json(const TargetedMap& reached) {
  return {{"detail", reached.detail},
          {"scale", reached.scale},
          {"area_ratio", reached.figures.area / reached.reference.area},
          {"volume_ratio", reached.figures.volume / reached.reference.volume},
          {"figures", to_json(reached.figures)},
          {"surfaces", reached.surfaces}};
}

}  // namespace qjulia

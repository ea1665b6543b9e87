#include "map/device_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "kind_parts.hpp"
#include "layout/map_layout.h"
#include "layout/paint_layout.h"
#include "layout/portal_layout.h"
#include "map/kinds.hpp"
#include "map/leaves.hpp"

namespace qjulia::map {
namespace {

static_assert(kMostIterations == QJ_MOST_ITERATIONS);
static_assert(Paint::kMargin == QJ_PAINT_MARGIN);

constexpr double kNone = 1e30;  // stands for a logarithm without bound, in any precision

/// What a paint's grid costs, in logarithms of distances to centres; measured.
constexpr double kPaintCost = 40;

/// What a kind costs at a point, in the same.
template <class Kinds>
double cost_of(const Kinds& kinds, const Map& map) {
  return std::visit([&](const auto& kind) { return kind.cost(map.dynamics); }, kinds);
}

double log_or(double radius, double otherwise) {
  return radius > 0 && std::isfinite(radius) ? std::log(radius) : otherwise;
}

template <class Real>
void append_portal(std::vector<Real>& reals, const Portal& portal) {
  std::array<double, QJ_PORTAL_SIZE> all{};
  const Eigen::Matrix3d matrix = portal.scale * portal.rotation.matrix();
  all[QJ_PORTAL_RADIUS] = portal.radius;
  all[QJ_PORTAL_SCALE] = portal.scale;
  all[QJ_PORTAL_MASK] = side_of(portal.mask);
  put(all, QJ_PORTAL_CENTER, portal.center);
  put(all, QJ_PORTAL_DESTINATION, portal.destination);
  put(all, QJ_PORTAL_MATRIX, matrix.reshaped<Eigen::RowMajor>());
  extend(reals, all);
}

template <class Real>
void append_paint(std::vector<Real>& reals, const Paint& paint) {
  const auto lack = [](std::uint8_t share) {
    return static_cast<double>(Paint::kWhole - share) / (Paint::kWhole + 1);
  };
  const auto [least, most] = std::ranges::minmax(paint.shares);
  std::array<double, QJ_PAINT_HEADER> header{};
  header[QJ_PAINT_PER_CELL] = 1 / paint.step;
  header[QJ_PAINT_LEAST] = lack(most);
  header[QJ_PAINT_MOST] = lack(least);
  put(header, QJ_PAINT_ORIGIN, paint.origin);
  put(header, QJ_PAINT_CELLS, paint.cells);
  extend(reals, header);
  for (const std::uint8_t share : paint.shares) reals.push_back(static_cast<Real>(lack(share)));
  reals.push_back(Real{0});
}

/// The buffer that layout/map_layout.h describes.
template <class Real>
std::vector<Real> packed(const Map& map, const StopRadii& stops) {
  const std::size_t factors = map.dynamics.factors.size();
  const std::size_t stride = QJ_MAP_STRIDE(factors);
  std::vector<Real> reals(QJ_MAP_SIZE(factors), Real{0});
  const auto set = [&](std::size_t at, double value) { reals[at] = static_cast<Real>(value); };
  set(QJ_MAP_LOG_SCALE, map.dynamics.log_scale);
  set(QJ_MAP_SLICE, map.dynamics.slice);
  std::ranges::copy(coordinates(map.dynamics.phase), reals.begin() + QJ_MAP_PHASE);
  set(QJ_MAP_LOG_ESCAPE, log_or(stops.escape, kNone));
  set(QJ_MAP_LOG_INNER, log_or(stops.inner, -kNone));
  set(QJ_MAP_LOG_OUTER, log_or(stops.outer, kNone));
  set(QJ_MAP_SURFACE_LEVEL, map.dynamics.surface_level);
  set(QJ_MAP_STEEPER, map.layers.steepness - 1);
  for (std::size_t k = 0; k < factors; ++k) {
    const auto& [center, exponent] = map.dynamics.factors[k];
    set(QJ_MAP_HEADER + QJ_MAP_EXPONENT * stride + k, exponent);
    for (std::size_t c = 0; c < 4; ++c) {
      set(QJ_MAP_HEADER + (QJ_MAP_CENTER_X + c) * stride + k, coordinates(center)[c]);
    }
  }
  // The modulus comes last: it may be large, and reals hold its place exactly all the same.
  const auto add = [&](const char* /*name*/, const auto& member) { append(reals, member); };
  set(QJ_MAP_VERSOR, static_cast<double>(reals.size()));
  visit_members(map.dynamics.versor, add);
  set(QJ_MAP_PORTALS, static_cast<double>(reals.size()));
  set(QJ_MAP_PORTAL_COUNT, static_cast<double>(map.layers.portals.size()));
  for (const Portal& portal : map.layers.portals) append_portal(reals, portal);
  set(QJ_MAP_PAINT, static_cast<double>(reals.size()));
  if (map.layers.paint) append_paint(reals, *map.layers.paint);
  set(QJ_MAP_MODULUS, static_cast<double>(reals.size()));
  visit_members(map.dynamics.modulus, add);
  return reals;
}

}  // namespace

std::vector<double> pack_map(const Map& map, const StopRadii& stops) {
  return packed<double>(map, stops);
}

std::map<std::string, std::string> kind_files(const Map& map) {
  std::map<std::string, std::string> files{
      {"QJ_MODULUS", name_of(map.dynamics.modulus) + "_modulus.clh"},
      {"QJ_VERSOR", name_of(map.dynamics.versor) + "_versor.clh"}};
  if (map.layers.paint) files.emplace("QJ_PAINT", "painted.clh");
  if (!map.layers.portals.empty()) files.emplace("QJ_PORTALS", "portals.clh");
  return files;
}

DeviceMap::DeviceMap(const Device& device, const Map& map, const StopRadii& stops,
                     Precision precision)
    : device_(device),
      factors_(static_cast<int>(map.dynamics.factors.size())),
      precision_(precision),
      kinds_(kind_files(map)),
      modulus_cost_(cost_of(map.dynamics.modulus, map)),
      step_cost_(modulus_cost_ + cost_of(map.dynamics.versor, map)),
      slice_(map.dynamics.slice),
      has_cube_bounds_(
          std::visit([](const auto& kind) { return kind.kHasCubeBounds; }, map.dynamics.modulus)),
      log_escape_(log_or(stops.escape, kNone)),
      log_inner_(log_or(stops.inner, -kNone)),
      log_outer_(std::min(log_escape_, log_or(stops.outer, kNone))) {
  interpolates_ = map.layers.portals.empty() &&
                  std::visit([](const auto& kind) { return kind.kIsSmooth; }, map.dynamics.versor);
  if (map.layers.paint) {
    modulus_cost_ += kPaintCost;
    step_cost_ += kPaintCost;
  }
  for (const Factor& factor : map.dynamics.factors) centers_.push_back(factor.center);
  buffer_ =
      precision == Precision::dbl
          ? context().upload_real(std::span<const double>(packed<double>(map, stops)), precision)
          : context().upload_real(std::span<const float>(packed<float>(map, stops)));
}

device::Kernel DeviceMap::kernel(const char* file, const char* name,
                                 const std::map<std::string, int>& defines) const {
  return context().kernel(file, name,
                          {device_.lane_width(precision_), precision_, defines, kinds_});
}

}  // namespace qjulia::map

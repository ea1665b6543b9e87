#include "fit/subspace.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "fit/farthest_points.hpp"

namespace qjulia::fitting {
namespace {

using Eigen::Index;

using Group = std::vector<std::size_t>;

/// The numbers of the roots (a > 0), or of the poles.
Group of_sign(const Map& map, bool roots) {
  Group group;
  for (std::size_t k = 0; k < map.dynamics.factors.size(); ++k) {
    if ((map.dynamics.factors[k].exponent > 0) == roots) group.push_back(k);
  }
  return group;
}

double squared_gap(const Map& map, std::size_t j, std::size_t k) {
  const Quaternion d = map.dynamics.factors[j].center - map.dynamics.factors[k].center;
  return d.x * d.x + d.y * d.y + d.z * d.z;
}

/// Cuts a group into `count` by the nearest of as many seeds, each seed the member farthest from
/// those before it.
std::vector<Group> clusters(const Map& map, const Group& group, std::size_t count) {
  std::vector<Group> cut(std::min(count, group.size()));
  const auto seeds = farthest_points(
      group.size(), cut.size(), 0,
      [&](std::size_t i, std::size_t j) { return squared_gap(map, group[i], group[j]); });
  for (std::size_t i = 0; i < group.size(); ++i) cut[seeds.nearest[i]].push_back(group[i]);
  // Twins of a seed leave nothing for a later one.
  std::erase_if(cut, [](const Group& members) { return members.empty(); });
  return cut;
}

}  // namespace

Subspace::Subspace(const Map& map, const Level& level, Unknowns allowed) {
  const std::size_t count = map.dynamics.factors.size();
  const auto factors = static_cast<Index>(count);
  const bool centers = allowed == Unknowns::all;
  const Group roots = of_sign(map, true);
  const Group poles = of_sign(map, false);
  std::vector<Eigen::Triplet<double>> entries{{0, 0, 1.0}};  // the log scale's column
  Index columns = 1;
  // Component 0 is a factor's exponent, 1 … 4 its centre's X … W.
  const auto add_column = [&](Index component, const Group& group, const auto& value) {
    for (const std::size_t k : group) {
      entries.emplace_back(1 + component * factors + static_cast<Index>(k), columns, value(k));
    }
    ++columns;
  };
  const auto one = [](std::size_t) { return 1.0; };
  const auto exponent = [&](std::size_t k) { return map.dynamics.factors[k].exponent; };
  switch (level.space) {
    case Space::scalars:
      if (!roots.empty()) add_column(0, roots, exponent);
      if (!poles.empty()) add_column(0, poles, exponent);
      break;
    case Space::clusters:
      for (const Group* side : {&roots, &poles}) {
        const std::size_t share = static_cast<std::size_t>(level.clusters) * side->size() / count;
        for (const Group& group : clusters(map, *side, std::max<std::size_t>(1, share))) {
          add_column(0, group, exponent);
          for (Index component = 1; centers && component <= 4; ++component) {
            add_column(component, group, one);
          }
        }
      }
      break;
    case Space::exponents:
    case Space::all:
      whole_ = level.space == Space::all && centers;
      for (Index component = 0; component <= (whole_ ? 4 : 0); ++component) {
        for (std::size_t k = 0; k < count; ++k) add_column(component, {k}, one);
      }
      break;
  }
  prolongation_.resize(1 + 5 * factors, columns);
  prolongation_.setFromTriplets(entries.begin(), entries.end());
}

}  // namespace qjulia::fitting

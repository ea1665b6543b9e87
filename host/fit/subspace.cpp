#include "fit/subspace.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "fit/farthest_points.hpp"

namespace qjulia::fitting {
namespace {

using Eigen::Index;

/// P's columns, one after the other.
class Columns {
 public:
  explicit Columns(std::size_t factors) : factors_(static_cast<Index>(factors)) {}

  void add(Index unknown, double value) { entries_.emplace_back(unknown, count_, value); }
  void end() { ++count_; }
  void one(Index unknown) {
    add(unknown, 1);
    end();
  }
  /// Unknown of factor k: component 0 the exponent, 1 … 4 the centre's X … W.
  Index unknown(std::size_t k, Index component) const {
    return 1 + component * factors_ + static_cast<Index>(k);
  }
  Eigen::SparseMatrix<double> matrix() const {
    Eigen::SparseMatrix<double> p(1 + 5 * factors_, count_);
    p.setFromTriplets(entries_.begin(), entries_.end());
    return p;
  }

 private:
  Index factors_;
  Index count_ = 0;
  std::vector<Eigen::Triplet<double>> entries_;
};

using Group = std::vector<std::size_t>;

/// The numbers of the roots (a > 0), or of the poles.
Group of_sign(const RationalMap& map, bool roots) {
  Group group;
  for (std::size_t k = 0; k < map.factors.size(); ++k) {
    if ((map.factors[k].exponent > 0) == roots) group.push_back(k);
  }
  return group;
}

double squared_gap(const RationalMap& map, std::size_t j, std::size_t k) {
  const Quaternion d = map.factors[j].center - map.factors[k].center;
  return d.x * d.x + d.y * d.y + d.z * d.z;
}

/// Cuts a group into `count` by the nearest of as many seeds, each seed the member farthest from
/// those before it.
std::vector<Group> clusters(const RationalMap& map, const Group& group, std::size_t count) {
  std::vector<Group> cut(std::min(count, group.size()));
  const auto seeds = farthest_points(
      group.size(), cut.size(), 0,
      [&](std::size_t i, std::size_t j) { return squared_gap(map, group[i], group[j]); });
  for (std::size_t i = 0; i < group.size(); ++i) cut[seeds.nearest[i]].push_back(group[i]);
  // Twins of a seed leave nothing for a later one.
  std::erase_if(cut, [](const Group& members) { return members.empty(); });
  return cut;
}

/// One factor on all of the group's exponents.
void add_common_factor(Columns& columns, const RationalMap& map, const Group& group) {
  if (group.empty()) return;
  for (const std::size_t k : group) columns.add(columns.unknown(k, 0), map.factors[k].exponent);
  columns.end();
}

}  // namespace

Subspace::Subspace(const RationalMap& map, const Level& level, Unknowns allowed) {
  const std::size_t factors = map.factors.size();
  const bool centers = allowed == Unknowns::all;
  Columns columns(factors);
  columns.one(0);
  const Group roots = of_sign(map, true);
  const Group poles = of_sign(map, false);
  switch (level.space) {
    case Space::scalars:
      add_common_factor(columns, map, roots);
      add_common_factor(columns, map, poles);
      break;
    case Space::clusters:
      for (const Group* side : {&roots, &poles}) {
        const std::size_t share = static_cast<std::size_t>(level.clusters) * side->size() / factors;
        for (const Group& group : clusters(map, *side, std::max<std::size_t>(1, share))) {
          add_common_factor(columns, map, group);
          for (Index component = 1; centers && component <= 4; ++component) {
            for (const std::size_t k : group) columns.add(columns.unknown(k, component), 1);
            columns.end();
          }
        }
      }
      break;
    case Space::exponents:
    case Space::all:
      whole_ = level.space == Space::all && centers;
      for (Index component = 0; component <= (whole_ ? 4 : 0); ++component) {
        for (std::size_t k = 0; k < factors; ++k) columns.one(columns.unknown(k, component));
      }
      break;
  }
  prolongation_ = columns.matrix();
}

}  // namespace qjulia::fitting

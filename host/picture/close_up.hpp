#pragma once
/// Where a lattice of images for a close-up has nodes.

#include <Eigen/Core>
#include <functional>
#include <span>
#include <vector>

#include "lattice/image_lattice.hpp"
#include "picture/view.hpp"

namespace qjulia::picture {

/// Whether anything within `reach` of a point can be seen in a perspective view.
class InSight {
 public:
  /// @param coarse a view with few pixels. @param depths of its pixels, right to about `error`.
  InSight(const View& coarse, std::vector<float> depths, double error);

  bool operator()(const Eigen::Vector3d& p, double reach) const { return sees(p, reach, reach); }
  /// The same, at most `aside` from the point across the view and `behind` along it.
  bool sees(const Eigen::Vector3d& p, double aside, double behind) const;

 private:
  View view_;
  std::vector<float> depths_;
  double error_;
  Eigen::Vector3d axis_;
};

/// A perspective view that shows little of the set, and a few of its rays.
struct CloseUp {
  View view;
  View few;                   ///< the same rays, but few
  std::vector<float> depths;  ///< of `few`
  double displacement = 0;    ///< how far the set may seem to lie elsewhere at most, map units
  double typical = 0;         ///< the same, as the median
  /// How far images after 1, 2, … iterates move where points that are seen do, map units a map
  /// unit.
  std::vector<double> stretches;
  double reach = 0;       ///< depths of few rays tell those of others to about this, map units
  double around = 0;      ///< rays of lights come from about so far around what is seen
  double outer = 0;       ///< ln r_out
  double steepest = 0;    ///< greatest |∇F₁| about the band
  double most_nodes = 0;  ///< that are worth making
};

/// Whether a level with images that move `stretch` times as far as points do saves more than it
/// costs. @param typical displacement, map units.
bool is_worth_composing(const View& view, double typical, double stretch);

/// Whether rays are likely to ask for orbits at most `reach` from p, map coordinates.
using HasOrbitsNear = std::function<bool(const Eigen::Vector3d& p, double reach)>;

/// F of points after one iterate more than the first of some levels composes, as it is looked up;
/// NaN where it is not known.
using Fields = std::function<std::vector<float>(const std::vector<Eigen::Vector3d>& points)>;
using FieldsAfter = std::function<Fields(std::span<const surface::ImageLattice::Level> levels)>;

/// The levels that are worth making, the one that composes most iterates first. That of first
/// iterates lies wherever rays in sight run orbits, each other one where orbits in sight need as
/// many iterates; or if that is too much, about what is seen. With each iterate more, nodes lie
/// closer.
std::vector<surface::ImageLattice::Level> levels_for(const CloseUp& close_up,
                                                     const HasOrbitsNear& has_orbits_near,
                                                     const FieldsAfter& fields_after);

}  // namespace qjulia::picture

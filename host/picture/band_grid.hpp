#pragma once
/// What a regular grid shows of a set before rays are marched: how far they may go, and where the
/// set roughly is.

#include <memory>
#include <stop_token>
#include <utility>

#include "device/context.hpp"
#include "lattice/level_set.hpp"
#include "map/device_map.hpp"
#include "picture/depth_source.hpp"
#include "picture/view.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"
#include "surface/loose_places.hpp"

namespace qjulia::picture {

/// What rays need to know of the band of undecided points.
struct Band {
  StopRadii stops;
  double radius = 0;    ///< a ball about the origin of this radius holds the set
  double level = 0;     ///< F₁ at the band's outer surface
  double steepest = 0;  ///< ‖∇F₁‖ about it
};

/// @param shape a box about the fitted shape, map coordinates.
Band find_band(const Device& device, const MarchedSet& set, const Box& shape);

/// Over the box of {F₁ < band.level} in the part that is seen, in map coordinates.
class BandGrid {
 public:
  BandGrid(const Device& device, const MarchedSet& set, const Band& band);

  /// The buffer that layout/picture_layout.h describes; `safe` holds the safe steps at its points
  /// (ray_march.cl).
  const device::RealBuffer& layout() const { return layout_; }
  const device::RealBuffer& safe() const { return safe_; }

  /// Depths of `rows` rows of a view, to about a cell.
  std::vector<float> depths(const View& view, int first_row, int rows);

  /// Later iterates are looked up from now on, where the grid's values are asked for.
  void look_up(std::shared_ptr<const surface::OrbitLookup> lookup) { lookup_ = std::move(lookup); }

  const map::DeviceMap& map() const { return map_; }
  const Box& bounds() const { return bounds_; }
  /// Whether nothing of the set lies in the part that is seen.
  bool is_empty() const { return is_empty_; }
  double step() const { return grid_.step; }
  /// The mean length, over rays through the box that meet no inside, that lies among undecided
  /// points; map units. 0 where there are portals.
  double way_in_band() const { return way_in_band_; }

  /// Points that reach about as far in every direction as the set. Pieces are left out that hang on
  /// nothing, with gaps of more than about a cell, and are less than a hundredth as large as the
  /// largest body. Where there are portals, copies may be small, and all pieces count.
  std::vector<Eigen::Vector3d> outline();
  /// Lower bounds on how far points lie below the surface of {F₁ < L}.
  std::vector<float> ways_inside(const std::vector<Eigen::Vector3d>& points) const;

  /// What of the set hangs on nothing large. @pre the grid is over all of the set.
  surface::LoosePlaces loose_places();
  /// Looks more finely at what `loose_places` found.
  void look_finer(surface::LoosePlaces& places, int finer, const surface::Sight& is_in_sight,
                  const std::stop_token& stop) const;
  /// Depths are those of the set without it from now on; before the first of them.
  void leave_out(const surface::LoosePlaces& places);

  /// Whether rays are likely to ask for orbits at most `reach` from p, map coordinates.
  bool has_orbits_near(const Eigen::Vector3d& p, double reach) const;

 private:
  /// The safe steps at the points of these numbers.
  std::vector<double> safe_steps(const surface::Grid& grid,
                                 std::vector<std::int32_t> numbers) const;
  surface::LevelSet level_set() const;
  /// Rays ask for orbits where they are nearer than this to the band, map units.
  double near() const;
  /// Tells whether points are inside; valid as long as this lives.
  surface::Insides insides(const std::stop_token& stop) const;
  /// F_n − L at the grid's points, as far as it matters.
  const std::vector<float>& values();
  /// At all points of `grid`, given those of a coarser one: computed near the band alone.
  std::vector<double> safe_steps(const surface::Grid& grid, const surface::Grid& coarse,
                                 const std::vector<double>& coarse_steps) const;

  MarchedSet set_;
  Band band_;
  map::DeviceMap map_;
  surface::Grid grid_;
  Box bounds_;
  bool is_empty_ = false;
  double way_in_band_ = 0;
  std::vector<double> steps_;  ///< at the grid's points
  double inner_;               ///< safe step at F₁ = ln r_in
  double deepest_;             ///< few orbits are asked for where the safe step is less
  std::shared_ptr<const surface::OrbitLookup> lookup_;
  std::vector<float> values_;  ///< as `values` has them, once it was called
  std::vector<std::pair<std::size_t, float>> left_out_;  ///< numbers and values before
  device::RealBuffer layout_, safe_, sent_values_;
  device::Kernel grid_depth_;
};

}  // namespace qjulia::picture

#pragma once
/// Where the first iterates take points of the slice near a set, computed once at the nodes of a
/// lattice and interpolated between them (kernels/image_lattice.clh).

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <stop_token>
#include <vector>

#include "device/context.hpp"
#include "lattice/grid.hpp"
#include "map/device_map.hpp"
#include "qjulia/base/box.hpp"

namespace qjulia::surface {

class ImageLattice {
 public:
  /// Tells nothing: every image is computed.
  explicit ImageLattice(const map::DeviceMap& map);

  struct Fineness {
    double displacement;  ///< how far the set may seem to lie elsewhere at most, map units
    double typical;       ///< the same, as the median
    double stretch;       ///< how far images move where points do, map units a map unit
    double most_nodes;    ///< that are worth making; there may be somewhat more, or none
  };
  /// The numbers of the cells of a grid that will be asked for. A cell has the number of its lowest
  /// point, and another cell on every side.
  using CellsOf = std::function<std::vector<std::int32_t>(const Grid&)>;

  /// Over some cells of a grid about `box`. @throws Interrupted
  ImageLattice(const map::DeviceMap& map, const Box& box, const CellsOf& cells_of,
               const Fineness& fineness, const std::stop_token& stop);

  /// Nodes for images after so many iterates.
  struct Level {
    int iterates = 1;
    double displacement = 0;  ///< how far the set may seem to lie elsewhere at most, map units
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< of the grid, in its rows
    Grid grid;                        ///< with whole groups of nodes along its first axis
    std::vector<std::int32_t> cells;  ///< as `CellsOf` says
  };
  /// @param levels the one that composes most iterates first; more than one, or one of several
  /// iterates, for maps without paint alone. @throws Interrupted
  ImageLattice(const map::DeviceMap& map, std::span<const Level> levels,
               const std::stop_token& stop);

  /// What kernels know of levels (kernels/layout/image_lattice.h).
  static std::vector<double> layout_of(std::span<const Level> levels);
  /// The grid that begins a step and a half before the box's low corner, for a level.
  static Grid grid_about(const Box& box, double step);
  /// Distance of nodes, map units, for a map whose images after so many iterates move `stretch`
  /// times as far as points do. @param typical displacement, map units.
  static double step_for(double typical, double stretch);

  /// Whether it serves points inside `box` for this displacement.
  bool serves(const Box& box, double displacement) const;

  /// How many nodes were computed.
  std::size_t nodes() const { return nodes_; }
  /// The share of the cells asked for that interpolation serves.
  double trusted_share() const { return trusted_share_; }
  /// How many iterates images are composed of at most; 0 without any.
  int iterates() const { return iterates_; }

  // These are what kernels take (kernels/image_lattice.clh).
  const device::RealBuffer& layout() const { return layout_; }
  const device::Buffer<std::int32_t>& places() const { return places_; }
  const device::RealBuffer& field() const { return field_; }
  const device::RealBuffer& versors() const { return versors_; }
  const device::Buffer<std::uint8_t>& trusted() const { return trusted_; }

 private:
  /// How closely cells have to be interpolated that are trusted: F and U to within `least`, or to
  /// within `moves` times what they change by from a node to the next.
  struct Allowed {
    double least, moves;
  };
  using AllowedOf = std::function<Allowed(const Level&)>;
  void make(const map::DeviceMap& map, std::span<const Level> levels, const AllowedOf& allowed_of,
            const std::stop_token& stop);

  Box box_;
  double displacement_ = 0;
  std::size_t nodes_ = 0;
  double trusted_share_ = 0;
  int iterates_ = 0;
  device::RealBuffer layout_, field_, versors_;
  device::Buffer<std::int32_t> places_;
  device::Buffer<std::uint8_t> trusted_;
};

}  // namespace qjulia::surface

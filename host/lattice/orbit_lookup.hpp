#pragma once
/// Orbits that are looked up rather than computed, for large surfaces and for the loose pieces
/// of pictures (kernels/looked_up_orbit.clh).

#include <Eigen/Core>
#include <memory>
#include <stop_token>
#include <vector>

#include "device/point_batch.hpp"
#include "lattice/image_lattice.hpp"
#include "lattice/image_table.hpp"
#include "lattice/level_set.hpp"

namespace qjulia::surface {

/// What looking up an orbit costs, in factors' logarithms.
inline constexpr double kLookUpCost = 60;

struct OrbitLookup {
  ImageLattice lattice;  ///< of first iterates
  ImageTable table;      ///< of later ones
  int tabled;            ///< the table serves iterates from this one on
};

/// Whether making tables for orbits of the grid's points takes less time than they save.
bool tables_pay(const Map& map, const Grid& grid);

/// For points of the grid's box near the surface of F_n at `level`, which may seem to lie by
/// `displacement` elsewhere, map units. Null if the map's orbits cannot be looked up so closely.
/// @param set the map's, for bounds. @throws Interrupted
std::shared_ptr<const OrbitLookup> make_lookup(const map::DeviceMap& map, const LevelSet& set,
                                               double level, const Grid& grid, double displacement,
                                               const std::stop_token& stop);

/// F of these points after so many iterates, or of the iterate that ended the orbit before, looked
/// up however coarse the table is; NaN where the lattice does not tell the iterates before the
/// last. @throws Interrupted
std::vector<float> looked_up_fields(const map::DeviceMap& map, const ImageLattice& lattice,
                                    const ImageTable& table, int iterates,
                                    const std::vector<Eigen::Vector3d>& points,
                                    const std::stop_token& stop);

/// A call of kernels/look_up.cl's look_up_points for so many points.
device::PartCall look_up_call(Arguments arguments, std::size_t points);

/// Appends the lattice as kernels take it, then the table.
void append_lattice(const ImageLattice& lattice, Arguments& arguments);
void append_table(const ImageTable& table, Arguments& arguments);

}  // namespace qjulia::surface

#pragma once
/// The modulus of a map R(q) = e^F(q) U(q): how far from the origin each image lies. F has several
/// kinds, and this is their list.
///
/// A kind is a struct in qjulia/map/kinds/NAME_modulus.hpp with the members that a map file and a
/// device hold; its field on the device is in kernels/NAME_modulus.clh.

#include <variant>

#include "qjulia/map/kinds/distance_modulus.hpp"
#include "qjulia/map/kinds/factors_modulus.hpp"
#include "qjulia/map/kinds/quadratic_modulus.hpp"

namespace qjulia {

using Modulus = std::variant<FactorsModulus, QuadraticModulus, DistanceModulus>;

}  // namespace qjulia

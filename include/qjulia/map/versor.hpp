#pragma once
/// The versor of a map R(q) = e^F(q) U(q): in which direction from the origin each image lies. U, a
/// unit quaternion, has several kinds, and this is their list.
///
/// A kind is a struct in qjulia/map/kinds/NAME_versor.hpp with the members that a map file and a
/// device hold; its field on the device is in kernels/NAME_versor.clh.

#include <variant>

#include "qjulia/map/kinds/factors_versor.hpp"
#include "qjulia/map/kinds/noise_versor.hpp"
#include "qjulia/map/kinds/quadratic_versor.hpp"

namespace qjulia {

using Versor = std::variant<FactorsVersor, QuadraticVersor, NoiseVersor>;

}  // namespace qjulia

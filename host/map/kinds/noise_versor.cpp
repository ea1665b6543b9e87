#include "map/checks.hpp"
#include "qjulia/map/versor.hpp"

namespace qjulia {

void NoiseVersor::validate() const {
  map::check_within("noise.octaves", octaves, 1, kMostOctaves);
  map::check_within("noise.scale", scale, kLeastScale, kMostScale);
  map::check_origin("noise.origin", origin);
}

}  // namespace qjulia

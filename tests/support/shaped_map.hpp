#pragma once
/// A small map with what its file says of the shape that it was fitted to.

#include "random_maps.hpp"

namespace qjulia::test {

inline Map shaped_map() {
  Map map = random_map(12, 0.001, 0.6, 5);
  map.frame.box = Box{{-1, -1, -1}, {1, 1, 1}};
  map.frame.inradius = 0.5;
  map.frame.detail = 0.02;
  return map;
}

}  // namespace qjulia::test

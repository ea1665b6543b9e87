#pragma once
/// What a distance modulus keeps besides numbers: its grid, in map files and on devices.

#include <array>
#include <memory>
#include <vector>

#include "layout/distance_layout.h"
#include "map/leaves.hpp"

namespace qjulia::map {

static_assert(DistanceGridData::kCoarse == QJ_DISTANCE_MARGIN);

template <>
struct KeyedLeaf<std::shared_ptr<const DistanceGrid>> {
  static constexpr std::array<std::string_view, 3> keys = {"cells", "blocks", "data"};
  static nlohmann::json json_of(const std::shared_ptr<const DistanceGrid>& grid);
  static void read(const Object& object, std::shared_ptr<const DistanceGrid>& grid);
};

template <class Real>
void append(std::vector<Real>& reals, const DistanceModulus& modulus) {
  const std::vector<float>& coefficients = modulus.grid->coefficients();
  std::array<double, QJ_DISTANCE_HEADER> header{};
  header[QJ_DISTANCE_PER_SHELL] = 1 / modulus.shell;
  header[QJ_DISTANCE_INRADIUS] = modulus.inradius;
  header[QJ_DISTANCE_FOURTH] = modulus.fourth == FourthCoordinate::round ? 1 : 0;
  header[QJ_DISTANCE_STEP] = modulus.step;
  header[QJ_DISTANCE_SLOPE] = modulus.grid->slope();
  put(header, QJ_DISTANCE_ORIGIN, modulus.origin);
  put(header, QJ_DISTANCE_CELLS, modulus.grid->data().cells);
  reals.reserve(reals.size() + header.size() + coefficients.size() + 1);
  extend(reals, header);
  extend(reals, coefficients);
  reals.push_back(Real{0});
}

}  // namespace qjulia::map

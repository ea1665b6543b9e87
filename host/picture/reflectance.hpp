#pragma once
/// How much of even light a rough surface reflects.

#include <vector>

namespace qjulia::picture {

/// GGX with the height-correlated shadowing of Smith reflects the share a F0 + b of even light,
/// without what is reflected more than once. @return pairs (a, b), as layout/picture_layout.h says.
/// Source: Karis 2013, "Real Shading in Unreal Engine 4", the split sum.
const std::vector<float>& reflectance_table();

}  // namespace qjulia::picture

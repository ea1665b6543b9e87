#pragma once
/// Descriptions of what every map that is made of a mesh has: its shell and how it stands.

#include "qjulia/base/setting.hpp"

namespace qjulia::map {

Setting detail_setting();
Setting steepness_setting();
Setting up_setting();

}  // namespace qjulia::map

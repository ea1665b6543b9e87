#pragma once
/// Where a set is cut open.

#include <optional>
#include <string>
#include <vector>

#include "qjulia/base/box.hpp"

namespace qjulia {

/// A plane across an axis, beyond which the set is cut away.
struct Cut {
  char axis = 'z';          ///< x, y or z
  double at = 0;            ///< along the axis: shape units, or per cent of the shape's box
  bool is_percent = false;  ///< what `at` is

  void validate() const;  ///< @throws OptionError naming `cut`
};

/// Where the cut is, shape units. @param box from which per cent are counted: the shape's.
/// @throws OptionError for an invalid cut, and where there is no box and the cut is in per cent
double place_of(const Cut& cut, const std::optional<Box>& box);

/// "z=50%,x=0.2": axes, and where they are cut; empty where nothing is. @throws InputError
std::vector<Cut> cuts_from(const std::string& text);
std::string to_string(const std::vector<Cut>& cuts);

}  // namespace qjulia

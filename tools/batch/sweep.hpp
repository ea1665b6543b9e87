#pragma once
/// The lists of a [[sweep]], and their combinations.

#include <optional>
#include <string>
#include <vector>

#include "batch/batch.hpp"

namespace qjulia::batch {

/// One value that a sweep gives an option.
struct AxisValue {
  std::string label;                     ///< what names of entries call it
  std::optional<ManifestOption> option;  ///< nothing for a flag that is not set
};

/// An option that a sweep gives one value after another.
struct SweepAxis {
  std::string name;  ///< the option's, as on the command line
  std::vector<AxisValue> values;
};

/// One choice of a value for each axis.
struct Combination {
  std::string suffix;  ///< "-OPTIONVALUE" for each axis, the options by name; empty without axes
  std::vector<ManifestOption> options;
};

/// The text with an underscore for each character that a name cannot have.
std::string label_in_name(std::string text);

/// How many combinations there are: 1 without axes. The largest number where they are more.
std::size_t combination_count(const std::vector<SweepAxis>& axes);

/// Every combination, the last option by name changing fastest.
std::vector<Combination> combinations(std::vector<SweepAxis> axes);

}  // namespace qjulia::batch

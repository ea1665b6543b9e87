#pragma once
/// One option taken through a list of values: a picture for each.

#include <string>
#include <vector>

#include "map_options.hpp"
#include "qjulia/picture.hpp"

namespace qjulia::tools {

struct Sweep {
  std::string name;  ///< of the option, without dashes
  std::vector<double> values;
};

/// What can be swept, for help and errors.
extern const char* const kSweepNames;

/// "NAME=FROM:TO:COUNT", both ends included, or "NAME=A,B,C". @throws InputError
Sweep parse_sweep(const std::string& text);

/// `count` azimuths once around, from `first` on.
Sweep turntable(double first, int count);

/// Whether only the camera moves.
bool is_of_camera(const Sweep& sweep);

/// Sets the swept option to `value`. @throws InputError where it must be whole and is not.
void set(const Sweep& sweep, double value, MapOptions& map, PictureOptions& picture);

}  // namespace qjulia::tools

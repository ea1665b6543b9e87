#pragma once
/// A map as a formula for other programs: its mathematics in GLSL, which is that of the explorer's
/// pages, or in OpenCL C, with the map's factors as constant arrays.

#include <stop_token>
#include <string>

#include "qjulia/device/device.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::formula {

enum class Program {
  fragmentarium,  ///< Fragmentarium and FragM: a distance estimate for DE-Raytracer.frag
  shadertoy,      ///< Shadertoy: a picture, with a ray marcher of its own
  mandelbulber,   ///< Mandelbulber 2: settings with a custom formula in OpenCL, and a camera
};

/// The most factors that a formula for Shadertoy may have: its constant arrays then have 500
/// vectors. Browsers compile more than that too slowly, or not at all.
constexpr std::size_t kMostFactorsOfShadertoy = 400;

/// @throws InputError naming what a formula cannot hold of the map, and what to do: another kind
///   than rational, portals, paint, too many factors for the program.
void expect_formula(const Map& map, Program program);

/// What a march along rays needs to know of a map.
struct Reach {
  StopRadii stops;
  double steepest = 0;  ///< ‖∇F_1‖ about the band of undecided points, without steepness
};

/// Takes about a second.
Reach reach_of(const Device& device, const Map& map, const std::stop_token& stop = {});

/// The source of `CustomIteration`, a formula in OpenCL C for Mandelbulber 2.
/// @throws InputError as `expect_formula` does.
std::string opencl_formula(const Map& map, const Reach& reach, const std::string& name);

/// The text of the shader, or of the settings that hold the formula. Its positions are in the
/// shape's frame: the box is centred, its longest side is 2 and up is Y, as the map says, or as
/// `kDefaultUp` where it does not.
/// @param name what the shader calls the map, such as its file's name.
/// @throws InputError as `expect_formula` does.
std::string formula_text(const Map& map, const Reach& reach, Program program,
                         const std::string& name);

}  // namespace qjulia::formula

#pragma once
/// Lamps, their colours, and what is behind a set: what users give as words.

#include <optional>
#include <string>
#include <string_view>

#include "qjulia/base/colors.hpp"

namespace qjulia {

/// The colour of a light: a temperature, as of a black body, or any colour.
struct LightColor {
  static constexpr double kLeastKelvin = 1700, kMostKelvin = 25000;

  /// 6,500 K is white; less is redder, more is bluer. Where it is given, `rgb` has no meaning.
  std::optional<double> kelvin = 6500;
  Rgb rgb = Rgb::Ones();

  /// @throws OptionError naming this field for a temperature out of range, or a colour whose parts
  /// are not 0 to 1.
  void validate(const char* field) const;
  /// Linear sRGB, whose greatest part is 1 for a temperature.
  /// Source: Kim et al. 2002 (US patent 7,024,034), cubic splines of the Planckian locus.
  Rgb linear() const;
  friend bool operator==(const LightColor&, const LightColor&) = default;
};

/// "3200K", or a colour as `color_named` has it. @throws InputError for another text, or for a
/// temperature out of range.
LightColor light_color_from(std::string_view text);
/// "3200K" or "#ff8000".
std::string to_string(const LightColor& color);

/// A light that turns with the camera, and stays level when the camera rises.
struct Lamp {
  static constexpr double kMostStrength = 100, kMostSize = 60;

  double azimuth = -61.7;   ///< degrees from the camera to the right
  double elevation = 41.4;  ///< degrees above the horizon, -90 to 90
  double strength = 1;      ///< 0 to kMostStrength
  LightColor color{5500, Rgb::Ones()};
  double size = 3;  ///< degrees from its middle to its edge, 0 to kMostSize: a large one casts soft
                    ///< shadows and has broad highlights
  /// @throws OptionError naming `lamp`.
  void validate() const;
  friend bool operator==(const Lamp&, const Lamp&) = default;
};

/// Three to five values with commas between them: azimuth, elevation, strength, then a colour and a
/// size if wanted. @throws InputError saying what to give.
Lamp lamp_from(std::string_view text);
/// All five values.
std::string to_string(const Lamp& lamp);

/// What is behind the set.
enum class Backdrop {
  studio,       ///< a light grey wall, brightest behind the set, in the light of the sky and lamps
  plain,        ///< one colour
  environment,  ///< what is around the set
  transparent   ///< pixels have an alpha; shadows on the ground are black and partly transparent
};

struct Background {
  Backdrop kind = Backdrop::studio;
  Rgb color = Rgb::Ones();  ///< a plain one's
  friend bool operator==(const Background&, const Background&) = default;
};

/// "studio", "transparent", "environment", or a colour as `color_named` has it. @throws InputError
Background background_from(std::string_view text);
std::string to_string(const Background& background);

}  // namespace qjulia

#pragma once
/// Lamps, their colours and rigs of them, what is behind a set, and how light becomes a picture.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "qjulia/colors.hpp"

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

/// Lamps and a sky that go together.
enum class RigName { studio, rim, low_key, noon, dusk, museum };

struct Rig {
  static constexpr std::size_t kMostLamps = 8;

  std::vector<Lamp> lamps;  ///< the first is the key light
  /// What the sky and the floor send from all sides: 1 is that of the studio.
  double fill = 1;
  LightColor fill_color{};
  double wall = 1;  ///< share of the light that is on the wall of the studio, too
};

Rig rig_named(RigName name);

/// The light of a picture: a rig, and what is different from it.
struct Lighting {
  RigName rig = RigName::studio;
  /// In place of the rig's first lamps, one by one; more than it has are added.
  std::vector<Lamp> lamps{};
  std::optional<double> fill{};
  std::optional<LightColor> fill_color{};

  /// The rig with what is different. Lamps of no strength are left out.
  Rig whole() const;
  void validate() const;  ///< @throws OptionError
};

/// How radiance becomes what a screen shows.
enum class ToneCurve {
  neutral,  ///< Khronos PBR Neutral 1.0: colours stay as they are, but for the brightest
  agx,      ///< AgX (Sobotka): bright colours fade slowly to white
  aces,     ///< Narkowicz 2015, a fit of ACES: much contrast
  none,     ///< what is brighter than white is white
};

/// Linear sRGB from linear sRGB, 0 … 1. This is what pictures are compared with: kernels have their
/// own.
Rgb tone_mapped(ToneCurve curve, const Rgb& radiance);

/// What is behind the set.
enum class Backdrop {
  studio,      ///< a light grey wall, brightest behind the set, in the light of the sky and lamps
  plain,       ///< one colour
  transparent  ///< pixels have an alpha; shadows on the ground are black and partly transparent
};

struct Background {
  Backdrop kind = Backdrop::studio;
  Rgb color = Rgb::Ones();  ///< a plain one's
  friend bool operator==(const Background&, const Background&) = default;
};

/// "studio", "transparent", or a colour as `color_named` has it. @throws InputError
Background background_from(std::string_view text);
std::string to_string(const Background& background);

}  // namespace qjulia

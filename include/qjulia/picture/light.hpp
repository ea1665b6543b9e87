#pragma once
/// Rigs of lamps, and how light becomes a picture.

#include <optional>
#include <string>
#include <vector>

#include "qjulia/base/lamp.hpp"

namespace qjulia {

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

/// The built-in environments.
std::vector<std::string> environment_names();

/// The light of a picture: a rig, and what is different from it.
struct Lighting {
  RigName rig = RigName::studio;
  /// In place of the rig's first lamps, one by one; more than it has are added.
  std::vector<Lamp> lamps{};
  /// Degrees about the up axis, as a camera's azimuth turns: where the lamps' azimuths count from.
  /// By default the camera's, so that the shape turns under the lamps.
  std::optional<double> lamp_turn{};
  std::optional<double> fill{};
  std::optional<LightColor> fill_color{};
  /// What is around the set: one of `environment_names`, or a panorama of a file, .hdr or .exr. Its
  /// light takes the place of the rig's, `fill` and `fill_color` multiply it, and lamps are those
  /// above alone. Empty: none.
  std::string environment{};
  /// How strongly the set lights itself with what it gets of the lamps' light; 1 is as much as in
  /// nature, after one reflection.
  double bounce = 0;
  double environment_turn = 0;  ///< degrees about the up axis, as a camera's azimuth turns

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

}  // namespace qjulia

#pragma once
/// The settings of a picture that a user turns while looking at it, described: options of commands,
/// sweeps, requests, pages, provenance and the reference come from this table.

#include <span>
#include <string_view>

#include "qjulia/base/setting.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {

/// What a `Studio` makes again where a setting changes.
enum class Remade {
  set,      ///< all: grids, lattices and tables of the set
  sky,      ///< the light of the sky, and the ground
  nothing,  ///< pictures take the new value
};

struct PictureSetting : SettingOf<PictureOptions> {
  /// Whether it moves the camera and nothing else, so that a `Studio` stays as it is.
  bool is_of_camera = false;
  /// Whether it says what the set looks like, and may stand in a look.
  bool is_of_look = false;
  /// Of settings that are not the camera's.
  Remade remade = Remade::set;
};

std::span<const PictureSetting> picture_settings();

/// The setting whose member of the struct has this name. @throws InputError where there is none.
const PictureSetting& picture_setting_named(std::string_view name);

}  // namespace qjulia

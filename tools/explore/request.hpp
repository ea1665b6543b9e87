#pragma once
/// What a page asks to see, or to have made of what it shows, as it stands in the address of a
/// request.

#include <Eigen/Core>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "qjulia/base/error.hpp"
#include "qjulia/map/knobs.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia::explore {

/// Names and values of a request's query, such as "detail" and "0.02". Names are those of `qjulia
/// render`'s options; where an option takes several numbers, commas stand between them.
using Query = std::multimap<std::string, std::string>;

struct ViewRequest {
  static constexpr int kMostPixels = 4096 * 4096, kMostSamples = 4;

  MapKnobs knobs;
  PictureOptions picture;
  bool is_draft = false;
  bool is_steady =
      false;              ///< the camera is so far away that it sees the whole set at every azimuth
  bool is_apart = false;  ///< one of many small pictures, after which no light is kept
  bool shows_mesh = false;  ///< that a map is being fitted to, in place of the map
  /// A place in the picture whose point is asked for: shares of its sides, from the upper left.
  Eigen::Vector2d at{0.5, 0.5};
  std::string knobs_text;  ///< the same for requests with the same knobs
  /// It is equal for requests that differ in the camera alone, or in size where they are drafts.
  std::string studio_text;
};

/// What is no number, unknown, given twice or too large for a page; knobs and pictures check their
/// own ranges. @throws InputError naming it
ViewRequest read_view(const Query& query);

struct MakeRequest {
  static constexpr int kMostCells = 1024, kMostFrames = 120;
  static constexpr int kMostPixels = 1 << 28;  ///< in all frames together

  ViewRequest view;
  bool is_turntable = false;
  std::string extension;                         ///< that the file has: a mesh's, or ".png"
  int resolution = SurfaceOptions{}.resolution;  ///< of meshes
  std::optional<double> millimetres;  ///< the mesh's longest side; by default shape units
  int frames = 36;
};

/// Names are those of `read_view`, and `make` (a mesh's type, such as "ply", or "png" or
/// "turntable"), `resolution`, `millimetres`, `frames`. @throws InputError naming what is wrong
MakeRequest read_make(Query query);

/// What a page's brush does to the map.
struct BrushRequest {
  static constexpr std::size_t kMostPlaces = 256;
  static constexpr int kMostPixels = 1 << 21;  ///< of the picture in which points are looked for

  ViewRequest view;
  /// Where the brush is put, shares of the picture's sides from the upper left; none: the whole set
  /// is painted.
  std::vector<Eigen::Vector2d> places;
  double radius = 0.1;         ///< of the brush, as a share of the longest side of the map's box
  double share = 0;            ///< of the detail that painted places have, 0 to 1
  std::optional<double> copy;  ///< a copy of this size is planted at the one place instead
};

/// Names are those of `read_view`, and `places` (such as "0.5,0.4;0.52,0.4"), `radius`, `share`,
/// `copy`. @throws InputError naming what is wrong
BrushRequest read_brush(Query query);

/// What is wrong with an option, under its name in a query: "look_at" is "look-at".
std::string message_of(const OptionError& error);

}  // namespace qjulia::explore

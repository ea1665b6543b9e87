#pragma once
/// What a page asks to have made of what it shows.

#include <optional>
#include <string>

#include "explore/view_request.hpp"
#include "qjulia/surface.hpp"

namespace qjulia::explore {

struct MakeRequest {
  static constexpr int kMostCells = 1024, kMostFrames = 120;
  static constexpr int kMostPixels = 1 << 28;  ///< of all frames

  ViewRequest view;
  bool is_turntable = false;
  std::string extension;  ///< of a mesh's file
  SurfaceOptions surface;
  std::optional<double> millimetres;  ///< the mesh's longest side; by default shape units
  int frames = 36;
};

/// Names are those of `read_view`, and `make` (ply, obj, off, stl, glb, turntable), `resolution`,
/// `millimetres`, `frames`. @throws InputError naming what is wrong
MakeRequest read_make(Query query);

}  // namespace qjulia::explore

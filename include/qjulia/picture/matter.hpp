#pragma once
/// What the set is made of, apart from its colour.

namespace qjulia {

/// Each is 0 … 1 unless it says otherwise.
struct Matter {
  double roughness = 0.55;  ///< 0 is polished, 1 is chalk (GGX, its width is the square)
  double metal = 0;         ///< 1 reflects all light in its own colour
  double coat = 0;          ///< a clear, polished layer over it
  double sheen = 0;         ///< light on edges, as of velvet
  double wax = 0;           ///< how much light goes through what is thin
  double glow = 0;          ///< what a part of the palette sends by itself, 0 to 10
  double glow_from = 0.7;   ///< where on the palette that begins
  double glow_full = 1;     ///< where it is strongest; below `glow_from`, the lower part glows
  double fog = 0;           ///< how strongly the far side fades into the background
};

}  // namespace qjulia

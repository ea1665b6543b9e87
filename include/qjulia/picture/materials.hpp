#pragma once
/// The list of materials, and what the program must know of each.

#include <span>
#include <string>

#include "qjulia/picture/picture.hpp"

namespace qjulia {

struct MaterialFacts {
  Material material;
  const char* word;  ///< as users call it
  const char* help;  ///< what it shows, as in "trap, HELP"; empty for clay
  /// The number by which kernels (QJ_TRAIT_… in kernels/layout/picture_layout.h) and the shaders of
  /// pages know it; -1 for none.
  int trait;
  bool is_of_orbits = false;        ///< iterates tell it; else it is clear from the point alone
  bool is_rank = false;             ///< its numbers have an order and no other meaning
  bool is_length = false;           ///< its numbers are lengths, shape units
  bool goes_on_inside = false;      ///< cut faces have it, too
  bool follows_iterations = false;  ///< its numbers change with the number of iterations
  bool needs_factors = false;       ///< it is of maps with factors alone
};

/// All materials, in the order of `Material`.
std::span<const MaterialFacts> materials();

/// All but clay with what they show, as a part of a sentence: "trap, how close …; or height, …".
std::string materials_help();

/// @throws OptionError for a number that is no material
const MaterialFacts& facts_of(Material material);

}  // namespace qjulia

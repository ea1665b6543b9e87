#pragma once
/// How thick a shell is asked for: a number, or a word that suits thick and thin shapes alike.

#include <string>
#include <variant>

#include "qjulia/mesh.hpp"

namespace qjulia {

/// Relative to what the shape can bear without losing limbs.
enum class DetailWord {
  automatic,  ///< fractal, and still the shape
  smooth,     ///< an eighth of it: grooves too fine to see
  clear,      ///< half of it
  wild        ///< twice as much
};

/// δ as a fraction of the box's diagonal, or a word that is turned into it for a shape.
using DetailChoice = std::variant<DetailWord, double>;

/// "auto", "smooth", "clear" or "wild", or a number in as many digits as it takes.
std::string to_string(const DetailChoice& detail);

/// How thin a shape is: its box's diagonal times area over volume. 6 √3 ≈ 10.4 for a ball and a
/// cube, 19 for the bunny, 61 for a standing figure with fingers.
/// @param mesh without hidden parts; units do not matter.
double thinness(const TriangleMesh& mesh);

/// Of `chosen_detail`. With the same δ, exact maps are rougher than fitted ones.
constexpr double kFittedShare = 0.2, kExactShare = 0.12;

/// δ for a shape of that thinness. With x = thinness − 6 √3, `automatic` is share / x, at most
/// 0.02, where x is capped at 30, or at 3/7 of its value where that is larger. A ball's set loses
/// nothing of the shape at any δ; other fitted sets lose about 0.05 to 0.13 times δ x
/// (docs/fitting.md).
double chosen_detail(const DetailChoice& detail, double thinness, double share);

}  // namespace qjulia

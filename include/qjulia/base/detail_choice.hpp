#pragma once
/// How thick a shell is asked for: a number, or a word that means the same roughness on all shapes.

#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace qjulia {

/// Details relative to `automatic`, which is chosen for each shape.
enum class DetailWord {
  automatic,  ///< the set is fractal, and still has the shape
  smooth,     ///< an eighth of `automatic`: grooves too fine to see
  clear,      ///< half of it
  wild        ///< twice as much
};

/// δ as a fraction of the box's diagonal, or a word from which it is chosen for a shape.
using DetailChoice = std::variant<DetailWord, double>;

/// "auto", "smooth", "clear" or "wild", or a number in as many digits as it takes.
std::string to_string(const DetailChoice& detail);
/// The word's value; none for another word.
std::optional<DetailWord> detail_word_named(std::string_view name);

}  // namespace qjulia

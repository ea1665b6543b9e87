#include "qjulia/picture/materials.hpp"

#include <fmt/format.h>

#include <array>

#include "layout/picture_layout.h"
#include "qjulia/base/error.hpp"

namespace qjulia {
namespace {

constexpr int kNoTrait = -1;
constexpr int kHeight = 4;  // of shaders alone

constexpr std::array kMaterials = {
    MaterialFacts{.material = Material::clay, .word = "clay", .help = "", .trait = kNoTrait},
    MaterialFacts{.material = Material::iterations,
                  .word = "iterations",
                  .help = "how long the orbit of a point stays undecided",
                  .trait = QJ_TRAIT_ITERATIONS,
                  .is_of_orbits = true,
                  .is_rank = true,
                  .follows_iterations = true},
    MaterialFacts{.material = Material::trap,
                  .word = "trap",
                  .help = "how close two iterates come to the plane X = 0, seen from the origin",
                  .trait = QJ_TRAIT_TRAP,
                  .is_of_orbits = true,
                  .is_rank = true,
                  .follows_iterations = true},
    MaterialFacts{.material = Material::groove,
                  .word = "groove",
                  .help = "from the bottoms of grooves to the tips of ridges",
                  .trait = QJ_TRAIT_GROOVE,
                  .is_of_orbits = true,
                  .is_rank = true},
    MaterialFacts{.material = Material::height,
                  .word = "height",
                  .help = "along the up axis",
                  .trait = kHeight,
                  .is_length = true,
                  .goes_on_inside = true},
    MaterialFacts{.material = Material::factor,
                  .word = "factor",
                  .help = "which factor of the map is nearest, poles in the lower half of the "
                          "palette and roots in the upper",
                  .trait = QJ_TRAIT_FACTOR,
                  .is_of_orbits = true,
                  .goes_on_inside = true,
                  .needs_factors = true},
};

static_assert([] {
  for (std::size_t i = 0; i < kMaterials.size(); ++i) {
    if (kMaterials[i].material != static_cast<Material>(i)) return false;
  }
  return true;
}());
static_assert([] {
  for (const MaterialFacts& one : kMaterials) {
    for (const MaterialFacts& other : kMaterials) {
      if (&one != &other && one.trait == other.trait) return false;
    }
  }
  return true;
}());

}  // namespace

std::span<const MaterialFacts> materials() { return kMaterials; }

std::string materials_help() {
  std::string text;
  for (const MaterialFacts& facts : kMaterials) {
    if (facts.material == Material::clay) continue;
    if (!text.empty()) text += &facts == &kMaterials.back() ? "; or " : "; ";
    text += fmt::format("{}, {}", facts.word, facts.help);
  }
  return text;
}

const char* to_string(Material material) { return facts_of(material).word; }

const MaterialFacts& facts_of(Material material) {
  const auto index = static_cast<std::size_t>(material);
  if (index < kMaterials.size()) return kMaterials[index];
  std::string words;
  for (const MaterialFacts& facts : kMaterials) {
    words += fmt::format("{}{}", words.empty() ? "" : ", ", facts.word);
  }
  throw OptionError("material", fmt::format("{} is no material; give one of {}",
                                            static_cast<int>(material), words));
}

}  // namespace qjulia

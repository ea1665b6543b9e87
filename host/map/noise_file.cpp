#include "map/noise_file.hpp"

#include <array>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace qjulia::map {
namespace {

constexpr const char* kVectors = "vectors";
constexpr const char* kQuaternions = "quaternions";

}  // namespace

nlohmann::json noise_json(const NoiseVersor& noise) {
  return {{"octaves", noise.octaves},
          {"scale", noise.scale},
          {"seed", noise.seed},
          {"values", noise.values == NoiseValues::vectors ? kVectors : kQuaternions},
          {"origin", {noise.origin.x(), noise.origin.y(), noise.origin.z()}}};
}

NoiseVersor read_noise(const Object& object) {
  object.expect_only(
      std::array<std::string_view, 5>{"octaves", "scale", "seed", "values", "origin"});
  NoiseVersor noise;
  noise.octaves = object.integer("octaves");
  noise.scale = object.number("scale");
  const double seed = object.number("seed");
  if (!(seed >= 0 && seed <= std::numeric_limits<std::uint32_t>::max()) ||
      seed != static_cast<double>(static_cast<std::uint32_t>(seed))) {
    object.refuse("has a \"seed\" that is no whole number from 0 to 4294967295");
  }
  noise.seed = static_cast<std::uint32_t>(seed);
  const std::string values = object.text("values");
  if (values != kVectors && values != kQuaternions) {
    object.refuse("has \"values\" that are neither \"vectors\" nor \"quaternions\"");
  }
  noise.values = values == kVectors ? NoiseValues::vectors : NoiseValues::quaternions;
  noise.origin = object.vector("origin");
  return noise;
}

}  // namespace qjulia::map

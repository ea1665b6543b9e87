#pragma once
/// Colours of pictures.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace qjulia {

/// Linear red, green and blue, 0 … 1.
using Rgb = Eigen::Vector3d;

/// The sRGB colour that "#ff8000", "ff8000", "f80", "white" or "black" stands for; none where the
/// text is no colour.
std::optional<Rgb> color_named(std::string_view text);
/// "#ff8000": the nearest sRGB colour of 8 bits.
std::string color_name(const Rgb& color);

/// What the set is painted with.
struct Palette {
  static constexpr std::size_t kMostStops = 8;

  Rgb clay{0.66, 0.45, 0.32};
  /// 2 … kMostStops, evenly from the least to the greatest number where the material shows one.
  std::vector<Rgb> stops{
      {0.13, 0.15, 0.36}, {0.13, 0.42, 0.46}, {0.80, 0.68, 0.42}, {0.62, 0.20, 0.10}};
};

/// "earth", the one above, "ember", "ice", "moss" or "grey"; or one whose lightness rises evenly:
/// "fern", from violet through green to yellow, "slate", blue to yellow, which looks the same to
/// colour-blind people, and "dusk", black through red to cream; or "wheel", which is cyclic. None
/// for another name.
std::optional<Palette> palette_named(std::string_view name);
/// All names, the default's first.
std::vector<std::string> palette_names();

}  // namespace qjulia

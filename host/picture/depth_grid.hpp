#pragma once
/// A picture of depths, looked at for where it is smooth.

#include <vector>

namespace qjulia::picture {

inline std::size_t index(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
         static_cast<std::size_t>(column);
}

enum class PixelKind { empty, smooth, rough };

struct DepthGrid {
  int columns = 0;
  int rows = 0;
  std::vector<float> depths;  ///< row by row; below 0 where nothing is

  float at(int column, int row) const { return depths[index(column, row, columns)]; }

  /// Empty: nothing in the 3 × 3 pixels around. Smooth: depth is nearly linear over them. `pixel`:
  /// a pixel's width in units of depth.
  PixelKind kind(int column, int row, double pixel) const;

  /// The least depth of the pixels about (x, y), pixel centres at whole coordinates: of the 2 × 2
  /// nearest, or of 4 × 4 where one of these is empty.
  float nearest(double x, double y) const;

  /// Bilinear, between the depths of pixel centres at whole coordinates.
  float interpolated(double x, double y) const;
};

}  // namespace qjulia::picture

#pragma once
/// Panoramas as files.

#include <cmath>
#include <string>

#include "picture/environment.hpp"

namespace qjulia::test {

/// A Radiance file, pixel by pixel. @param radiance of a column and a row.
template <class Radiance>
std::string hdr_bytes(int width, const Radiance& radiance) {
  std::string bytes = "#?RADIANCE\nSOFTWARE=test\nFORMAT=32-bit_rle_rgbe\n\n-Y " +
                      std::to_string(width / 2) + " +X " + std::to_string(width) + "\n";
  for (int row = 0; row < width / 2; ++row) {
    for (int column = 0; column < width; ++column) {
      const Eigen::Vector3d c = radiance(column, row);
      int exponent = 0;
      std::frexp(c.maxCoeff(), &exponent);
      for (const double part : c) bytes += static_cast<char>(std::ldexp(part, 8 - exponent));
      bytes += static_cast<char>(exponent + 128);
    }
  }
  return bytes;
}

inline std::string even_hdr_bytes(double radiance) {
  return hdr_bytes(16, [&](int, int) { return Eigen::Vector3d::Constant(radiance); });
}

}  // namespace qjulia::test

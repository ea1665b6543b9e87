#pragma once
/// Turns depths into colours on the device.

#include <cstdint>
#include <span>
#include <vector>

#include "device/context.hpp"
#include "picture/depth_source.hpp"
#include "picture/lights.hpp"

namespace qjulia::picture {

/// What is around the shape.
struct Scene {
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  double ground = 0;  ///< height along up
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1;
  bool has_ground = true;
  Backdrop backdrop = Backdrop::studio;
  Rgb color = Rgb::Zero();  ///< a plain backdrop's
  Palette palette{};
};

/// Shares of the open sky's light that reach points of the ground. The points lie in a square about
/// the middle of the shape, `side` × `side`, closer together the nearer they are to it, row by row
/// along `right` and `front` (layout/picture_layout.h).
struct GroundLight {
  int side = 0;
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();
  Eigen::Vector3d front = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d open = Eigen::Vector3d::Zero();  ///< what the open sky sends there
  std::vector<float> shares{};
};

/// The sky's light on the ground around the shape, which no camera changes. Each light stands for
/// its part of the sky: its shadow is as soft as that part is wide.
/// @param sky with depth maps. @param fineness as for lights.
GroundLight ground_light(const Device& device, const Scene& scene, std::vector<Light> sky,
                         double fineness);

/// Rows of a picture, of a view whose pixels are `samples` × `samples` samples.
struct Strip {
  int first_row = 0;  ///< pixels
  int rows = 0;
  int samples = 1;
  int halo = 0;  ///< rows of samples that `depths` holds above first_row
  /// One for each depth: the position in the palette, 0 … 1; or, if below 0, minus the lightness of
  /// clay. Empty: all are plain clay.
  std::vector<float> traits{};
  /// The result of `near_shadow` for each pixel; empty: no near shadows.
  std::vector<std::uint8_t> near_shadow{};
  double narrowest_penumbra = 1;  ///< of the key light's map on samples, texels
  std::vector<float> depths{};    ///< whole rows of samples, from first_row · samples − halo on
};

/// What a strip shows.
struct Shaded {
  std::vector<std::uint8_t> pixels;  ///< sRGB bytes
  std::vector<std::uint8_t> alpha;   ///< one for each pixel
  std::vector<float> normals;        ///< 3 numbers a sample, of every row in the strip
};

class Shading {
 public:
  /// @param lights with depth maps.
  Shading(const Device& device, const Scene& scene, const GroundLight& ground,
          std::span<const Light> lights);

  /// @param with_normals else there are none.
  Shaded shade(const View& view, const Strip& strip, bool with_normals) const;

 private:
  Device device_;
  int lights_count_;
  device::Buffer<float> lights_, key_, maps_, scene_, ground_;
  device::Kernel normals_, sample_receivers_, ground_receivers_, sky_light_, key_light_, pixels_;
};

}  // namespace qjulia::picture

#pragma once
/// Turns depths into colours on the device.

#include <cstdint>
#include <span>
#include <vector>

#include "device/context.hpp"
#include "picture/depth_source.hpp"
#include "picture/lights.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::picture {

/// What is around the shape, in the map's coordinates.
struct Scene {
  PictureOptions options{};  ///< what the picture was asked to have: colours, matter, tone, bounce
  Eigen::Vector3d up = Eigen::Vector3d::UnitY();
  double ground_height = 0;  ///< along up
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1;
  Rig rig{};
  /// In place of the rig's sky; null: none.
  const Surrounded* around = nullptr;
  /// Its axes where `up` is up.
  CameraAxes around_axes{Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
                         Eigen::Vector3d::UnitZ()};
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
GroundLight ground_light(const Device& device, const Scene& scene, std::span<const Light> sky,
                         double fineness);

/// Normals of a view's depths, 3 numbers each.
std::vector<float> normals_of(const Device& device, const View& view,
                              const std::vector<float>& depths);

/// What kernels know of them, as layout/picture_layout.h says.
std::vector<float> packed(const Scene& scene, const GroundLight& ground);

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
  double narrowest_penumbra = 1;  ///< of the lamps' maps on samples, texels
  std::vector<float> depths{};    ///< whole rows of samples, from first_row · samples − halo on
};

/// What a strip shows.
struct Shaded {
  std::vector<float> pixels;   ///< before they are developed: layout/picture_layout.h
  std::vector<float> normals;  ///< 3 numbers a sample, of every row in the strip
  /// What radiance is made of: for each pixel QJ_PART_LAMPS numbers and 3 for each lamp.
  std::vector<float> parts;
};

class Shading {
 public:
  /// @param lamps the key light first. @param sky lights as well; all with depth maps.
  /// @param bounces `bounce_levels` of each lamp, where the scene has a bounce.
  Shading(const Device& device, const Scene& scene, const GroundLight& ground,
          std::span<const Light> lamps, std::span<const Light> sky,
          std::span<const std::vector<float>> bounces = {});

  /// @param with_layers else there are no normals and no parts.
  Shaded shade(const View& view, const Strip& strip, bool with_layers) const;

  /// @param pixels whole rows of a picture of this size, from `first_row` on. @param exposure what
  /// radiance is multiplied by.
  /// @param most what stands for 1. @return sRGB and how opaque a pixel is, 4 numbers each.
  std::vector<std::uint16_t> develop(std::span<const float> pixels, int first_row, int width,
                                     int height, double exposure, int most) const;

  /// What is behind the shape in these pixels, and how opaque they are: 4 numbers a pixel.
  std::vector<float> behind(std::span<const float> pixels, int first_row, int width, int height,
                            double exposure) const;

  /// The luminance of the light that arrives at each sample of the strip that shows the shape.
  std::vector<float> incident(const View& view, const Strip& strip) const;

 private:
  struct Received;
  /// Passes up to the light on receivers.
  Received receive(const View& view, const Strip& strip, bool with_parts) const;

  Device device_;
  int lamps_count_, lights_count_;
  double thin_, bounce_;
  device::Buffer<float> lights_, maps_, scene_, ground_, reflectance_, around_, bounces_;
  device::Kernel normals_, sample_receivers_, ground_receivers_, sky_light_, lamp_light_,
      bounce_light_, radiance_, develop_, behind_, incident_;
};

}  // namespace qjulia::picture

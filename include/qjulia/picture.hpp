#pragma once
/// Pictures of the set itself, ray-marched on the device, and of meshes in the same light.

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "qjulia/device.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/progress.hpp"

namespace qjulia {

/// 8-bit sRGB, row by row from the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;  ///< 3 · width · height
};

/// A pin-hole camera that turns about the shape.
struct Camera {
  double azimuth = 30;        ///< degrees about the up axis
  double elevation = 15;      ///< degrees above the horizon
  double zoom = 1;            ///< 1 frames the whole shape
  double field_of_view = 30;  ///< degrees, vertical
  char up = 'y';              ///< the shape's axis that points up: x, y or z
};

struct PictureOptions {
  int width = 1280;
  int height = 960;
  int iterations = 6;
  /// Radius beyond which orbits end, map units; by default where none returns from.
  std::optional<double> escape = std::nullopt;
  int samples_per_axis = 2;                 ///< anti-aliasing: its square rays a pixel
  Precision precision = Precision::single;  ///< of rays and orbits; double where the device has it
  /// Shape units: only this part of the set is drawn, cut open, and framed. By default all of it.
  std::optional<Box> box;
  Camera camera;
  void validate() const;  ///< @throws InputError
};

/// Pictures of {F_n < L}. Lights stay with the camera's azimuth; the ground lies under the set's
/// lowest point. The same options, map and device give the same bytes. An empty image when a stop
/// was requested.
Image render(const Device& device, const RationalMap& map, const PictureOptions& options,
             const Watch& watch = {});

/// The same view, light and material for a mesh, for comparison.
/// @param framed what the camera frames, in the mesh's coordinates, such as the map's box.
Image render_mesh(const Device& device, const TriangleMesh& mesh, const Box& framed,
                  const PictureOptions& options, const Watch& watch = {});

/// Images side by side in rows of `columns`, `gap` white pixels between them; smaller images stand
/// at the upper left of their cells.
Image contact_sheet(std::span<const Image> images, int columns, int gap = 0);

/// The image with a line of text under it.
Image captioned(const Image& image, const std::string& text);

/// Keywords (1 to 79 Latin-1 characters) and what a file says under them (Latin-1).
using PictureText = std::map<std::string, std::string>;

/// The bytes of a PNG file; `text` as tEXt chunks. @throws InputError without pixels.
std::string png_bytes(const Image& image, const PictureText& text = {});

/// Written under a temporary name and renamed; `text` as tEXt chunks. @throws OutputError
void write_png(const Image& image, const std::filesystem::path& path, const PictureText& text = {});

}  // namespace qjulia

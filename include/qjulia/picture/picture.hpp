#pragma once
/// Pictures of the set itself, ray-marched on the device, and of meshes in the same light.

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "qjulia/base/colors.hpp"
#include "qjulia/base/cut.hpp"
#include "qjulia/base/material_range.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/picture/light.hpp"
#include "qjulia/picture/matter.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia {

/// 8-bit sRGB, row by row from the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;  ///< 3 · width · height
  /// width · height: 0 lets through what is behind, 255 hides it. Empty: nothing is transparent.
  std::vector<std::uint8_t> alpha{};
  /// The same in 16 bits, with the alpha where there is one: 3 or 4 numbers a pixel. Empty: there
  /// are 8 bits alone.
  std::vector<std::uint16_t> deep{};
  std::size_t covered = 0;  ///< pixels that show any of a rendered set or mesh
  LoosePieces loose{};      ///< what is left out of a rendered set, shape units

  /// @throws InputError when there are no pixels, or not width · height of them.
  void validate() const;
};

/// A camera that turns about the shape.
struct Camera {
  double azimuth = 30;    ///< degrees about the up axis
  double elevation = 15;  ///< degrees above the horizon
  double zoom = 1;        ///< 1 shows the whole set, 2 half of it
  /// Degrees, vertical, 1 … 120. 0: rays are parallel, so that nothing is smaller for being farther
  /// away; the picture is as large as one of 30 degrees at the same distance.
  double field_of_view = 30;
  /// How the shape stands. By default as the map says, else `kDefaultUp`; a mesh as `guess_up`
  /// says.
  std::optional<UpAxis> up{};
  /// Shape units: the point in the middle of the picture. By default the middle of `frame`, else
  /// the point that puts the set in the middle.
  std::optional<Eigen::Vector3d> look_at{};
  /// Distance from the eye to that point, shape units. By default, a set in the middle fills 83 %
  /// of the picture's tighter side at zoom 1.
  std::optional<double> distance{};
  /// The box that fills the picture at zoom 1, shape units, seen from the distance that shows the
  /// whole set. By default the whole set fills it.
  std::optional<Box> frame{};
  /// The width of the lens, as a share of its distance to what is in focus, 0 to 1. What lies as
  /// far behind that as the picture is high is blurred to about this share of the picture's height.
  double aperture = 0;
  /// Shape units: what is in focus. By default what is seen in the middle of the picture, or else
  /// nearest to it.
  std::optional<Eigen::Vector3d> focus{};
};

/// What gives the set its colour. Detail that is finer than a pixel is averaged.
enum class Material {
  clay,        ///< one colour
  iterations,  ///< for how many iterates the orbit of a point stays undecided, 0 … 1
  trap,        ///< how close two iterates come to the plane X = 0, seen from the origin, 0 … 1
  groove,      ///< from the bottoms of grooves to the tips of ridges, 0 … 1
  height,      ///< along the up axis, shape units
  /// The nearest factor, by a number of its own: 0 … ½ for a pole and ½ … 1 for a root.
  factor,
};

/// A palette by its name; or of colours as `color_named` has them, one for clay, 2 to kMostStops
/// for other materials. @throws OptionError naming `palette`.
Palette palette_from(std::span<const std::string> words, Material material);

struct PictureOptions {
  int width = 1280;
  int height = 960;
  int iterations = 6;
  /// Radius beyond which orbits end, map units; by default where none returns from.
  std::optional<double> escape = std::nullopt;
  int samples = 2;  ///< anti-aliasing: rays along each side of a pixel
  int bits = 8;     ///< of each number of a pixel, 8 or 16
  Precision precision =
      Precision::single;  ///< arithmetic of rays and orbits; double where the device has it
  /// Shape units: only this part of the set is drawn, cut open, and framed. By default all of it.
  std::optional<Box> box;
  std::vector<Cut> cuts;  ///< for maps; what is framed stays as it was
  Camera camera;
  /// The look that the settings below are from, if it is one: for records alone (`apply_look`).
  std::string look{};
  Lighting light;
  /// Stops: each doubles the light of the picture. By default (nothing) so much that the set gets
  /// as much light as in the studio's rig, whatever it is made of.
  std::optional<double> exposure = 0;
  ToneCurve tone = ToneCurve::neutral;
  Matter matter;
  Material material = Material::clay;  ///< for maps; meshes are always of clay
  Palette palette;
  /// By default the palette is spread over what a picture shows, by `range_over`.
  std::optional<MaterialRange> range;
  Background background;
  bool ground = true;  ///< under the set, with its shadow
  /// Draws pieces of a map's set that hang on nothing and are less than a hundredth as large as the
  /// largest body. Copies in portals are always drawn.
  bool keep_loose = false;
  /// Computes every orbit, instead of looking iterates up where that moves what is seen by no more
  /// than about an eighth of a pixel: up to three times slower for maps of many factors.
  bool exact = false;
  void validate() const;  ///< @throws InputError
};

/// What orbits are looked up in.
struct LookupReport {
  std::size_t nodes = 0;        ///< of the lattice that first iterates come from; 0: no lattice
  double trusted_share = 0;     ///< of its cells: those that serve
  std::size_t table_bytes = 0;  ///< of the table that later iterates come from; 0: no table
  int iterates = 1;             ///< that the lattice composes at most
  friend bool operator==(const LookupReport&, const LookupReport&) = default;
};
/// One line, in words; empty where nothing was looked up.
std::string to_text(const LookupReport& report);

/// Its name above.
const char* to_string(Material material);

/// What one source of light adds to a picture.
struct LightLayer {
  std::string name;          ///< "lamp1" and on, "sky", "bounce", "emission", "background"
  std::vector<float> color;  ///< 3 a pixel
};

/// What each pixel shows, row by row from the top, in the shape's own units and coordinates.
/// Depths, normals, positions and values are what is seen at the middle: where a pixel has several
/// samples, the one nearest to it. All else is the mean over the pixel; colours are linear sRGB
/// with the picture's exposure, before the tone curve, and those of the set are multiplied by how
/// much of the pixel it covers.
struct PictureLayers {
  std::vector<float> depth;     ///< along the ray, from the camera; infinity where nothing is
  std::vector<float> normal;    ///< 3 a pixel: of length 1, towards the camera; 0 where nothing is
  std::vector<float> position;  ///< 3 a pixel; not a number where nothing is
  /// The material's way through the palette, 0 … 1; below 0 where there is none. Empty for clay.
  std::vector<float> value{};
  std::vector<float> beauty{};  ///< 4 a pixel: the picture, and how opaque it is
  std::vector<float> albedo{};  ///< 3 a pixel: the set's colour without any light
  std::vector<float> mask{};    ///< 3 a pixel: shares of the set, of the ground, and of cut faces
  std::vector<LightLayer> light{};  ///< their sum is `beauty`
};

struct LayeredImage {
  Image image;
  PictureLayers layers;
};

/// A map's set, or a mesh, to be drawn from several sides: what no camera changes is computed once.
class Studio {
 public:
  /// @param options hold for every picture; their camera is the first one's, and says what is up.
  /// @param stop ends the work, here and in pictures whose monitors have no other. @throws
  /// InputError naming the option or what is wrong with the map.
  Studio(const Device& device, const Map& map, const PictureOptions& options,
         const std::stop_token& stop = {});
  /// @param framed the camera frames what of the mesh lies in it, in the mesh's coordinates.
  Studio(const Device& device, const TriangleMesh& mesh, const Box& framed,
         const PictureOptions& options);
  /// A studio of drafts, for pictures of some 160 x 120 pixels while something moves: light is as
  /// coarse as it gets, whatever the size, and loose pieces are found less surely.
  static Studio of_drafts(const Device& device, const Map& map, const PictureOptions& options,
                          const std::stop_token& stop = {});
  ~Studio();
  Studio(Studio&&) noexcept;
  Studio& operator=(Studio&&) noexcept;

  /// Pictures have this size from now on, and light as fine as before.
  void resize(int width, int height);

  /// Later pictures have those settings of these options that need nothing new of the set
  /// (`PictureSetting::remade`): light, exposure, tone, matter, palette and its range, background
  /// and ground.
  void set_light(const PictureOptions& options);

  /// The ground of later pictures lies at this height along up, shape units, instead of under what
  /// is drawn: so that it stands still while bodies move. @throws OptionError beyond
  /// 1e9
  void set_ground(double height);

  Image picture(const Camera& camera, const ProgressMonitor& monitor = {});
  /// A picture with the shutter open while the camera moves: rays of a pixel are drawn at different
  /// times, and their light is added before exposure and tone curve.
  /// @param camera in the middle of that time. @param moving the same camera in the middle of equal
  /// parts of that time, with a point to look at and a distance; empty: it stands still.
  Image picture(const Camera& camera, std::span<const Camera> moving,
                const ProgressMonitor& monitor = {});
  /// The same picture, with what its pixels show.
  LayeredImage layered_picture(const Camera& camera, const ProgressMonitor& monitor = {});

  /// Points that reach about as far in every direction as the set or mesh that is framed, shape
  /// units: without what is cut away by `box`, and without pieces that hang on nothing and are less
  /// than a hundredth as large as the largest body.
  std::vector<Eigen::Vector3d> outline();

  /// The cameras of a film. Those without a point to look at, or without a distance, all get the
  /// same one. It puts the set in the middle and shows all of it in every picture, as large as that
  /// allows. Cameras whose fields of view differ get different distances. A single camera gets the
  /// values with which its picture would be drawn.
  /// @param others more points that are to be seen, such as outlines of other studios, shape units.
  std::vector<Camera> aimed(std::span<const Camera> cameras,
                            std::span<const Eigen::Vector3d> others = {});

  /// Values of the material at some points that these cameras see, evenly over their pictures.
  /// Faces of cuts are left out. Empty for clay and meshes.
  std::vector<float> shown(std::span<const Camera> cameras);

  /// The values that the palette of the last picture goes through: those of the options or of
  /// `set_range`, else spread over what that picture shows. 0 to 1 for clay and for meshes, and
  /// before the first picture.
  MaterialRange range() const;

  /// Sets the range of all later pictures, so that colours stay the same through a film. Without a
  /// range, the palette of each picture is spread over what it shows. Clay and meshes are not
  /// affected.
  void set_range(const std::optional<MaterialRange>& range);

  /// Stops of the last picture: those of the options or of `set_exposure`, or else those that were
  /// found for it.
  double exposure() const;
  /// Holds for all later pictures, so that light stays the same through a film.
  void set_exposure(double stops);

  /// What orbits are looked up in: the tables that were made last.
  LookupReport lookups() const;

 private:
  struct Impl;
  explicit Studio(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// The range with which each part of a palette is seen about as much as any other, without the
/// rarest values. The less the values differ, the less they are spread apart, so that noise is not
/// amplified.
/// @param values of the material, as `Studio::shown` gives them. 0 to 1 where there are none.
MaterialRange range_over(std::vector<float> values, Material material);

/// A picture of {F_n < L}. Lamps go with the camera's azimuth unless `lamp_turn` says where they
/// are; the ground lies under the set's
/// lowest point. The same options, map and device give the same bytes.
/// @throws InputError naming the option or what is wrong with the map.
Image render(const Device& device, const Map& map, const PictureOptions& options,
             const ProgressMonitor& monitor = {});
/// The same picture, with what its pixels show.
LayeredImage layered_render(const Device& device, const Map& map, const PictureOptions& options,
                            const ProgressMonitor& monitor = {});

/// The same view, light and material for a mesh, for comparison.
/// @param framed the camera frames what of the mesh lies in it, in the mesh's coordinates.
Image render_mesh(const Device& device, const TriangleMesh& mesh, const Box& framed,
                  const PictureOptions& options, const ProgressMonitor& monitor = {});

/// The names of the files that `write_layers` writes.
std::vector<std::filesystem::path> layer_files(const std::filesystem::path& prefix);

/// The layers of a picture `width` pixels wide as files: PREFIX.depth.npy (float32 [row][column]),
/// PREFIX.normal.npy and PREFIX.position.npy (float32 [row][column][3]), units as in
/// `PictureLayers`; and to look at PREFIX.depth.png (white is nearest, black is nothing) and
/// PREFIX.normal.png (0 … 255 stands for −1 … 1). @return their names. @throws OutputError
std::vector<std::filesystem::path> write_layers(const PictureLayers& layers, int width,
                                                const std::filesystem::path& prefix);

/// The bytes of an OpenEXR file with all layers, named as compositors name them: R, G, B, A; Z; N.X
/// and on; P.X and on; albedo.R and on, mask.R and on (the set, the ground, cut faces); value.Y;
/// and light by its source. Z, P and values are float, all others half. `text` as attributes.
/// @throws InputError where layers are missing.
std::string exr_bytes(const LayeredImage& picture,
                      const std::map<std::string, std::string>& text = {});
/// @throws OutputError
void write_exr(const LayeredImage& picture, const std::filesystem::path& path,
               const std::map<std::string, std::string>& text = {});

/// The mesh, the map's potential (n = 1) and its set in one view; and the distance of what is seen
/// of the set from the mesh as colour, with a scale: percent of the mesh's box diagonal, and units
/// of the mesh. Each is as large as the options say.
Image comparison(const Device& device, const Map& map, const TriangleMesh& mesh,
                 const PictureOptions& options, const ProgressMonitor& monitor = {});

/// Images side by side in rows of `columns`, `gap` white pixels between them; smaller images stand
/// at the upper left of their cells. What is transparent is white.
Image contact_sheet(std::span<const Image> images, int columns, int gap = 0);

/// The image at a whole number of times fewer pixels a side, each the mean of those it stands for,
/// over white where it is transparent.
Image reduced(const Image& image, int times);

/// The image with a line of text under it; white where it is transparent.
Image captioned(const Image& image, const std::string& text);

/// Keywords (1 to 79 Latin-1 characters) and what a file says under them (Latin-1).
using PictureText = std::map<std::string, std::string>;

enum class Packing {
  small,
  quick,  ///< a third of the time, and larger
};

/// The bytes of a PNG file, of 16 bits where the image has them, with an alpha where it has one;
/// `text` as tEXt chunks.
/// @param map as `packed_map` makes it: `read_map` then reads the picture. Empty: none.
/// @throws InputError without pixels.
std::string png_bytes(const Image& image, const PictureText& text = {},
                      Packing packing = Packing::small, const std::string& map = {});

/// The bytes of an animated PNG file, which shows images of one size one after the other, `seconds`
/// each, again and again. @throws InputError when there are no images or their sizes differ;
/// OptionError when `seconds` is not 0.001 to 65.
std::string animated_png_bytes(std::span<const Image> images, double seconds);

/// Written under a temporary name and renamed; `text` and `map` as in `png_bytes`.
/// @throws OutputError
void write_png(const Image& image, const std::filesystem::path& path, const PictureText& text = {},
               const std::string& map = {});

}  // namespace qjulia

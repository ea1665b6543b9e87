#pragma once
/// What can be seen: anything that knows the depths of a view.

#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "picture/view.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia::picture {

/// A ray of a pixel that goes on from its hit. It passes through the piece that it has hit if it
/// comes out of it before the depth `until`.
struct PassingRay {
  int column, row;
  float hit, until;
};

/// A ray of a light's view, from one depth to the point that it may light. x and y are pixel
/// coordinates.
struct LightRay {
  double x, y;
  float from, to;
};

class DepthSource {
 public:
  virtual ~DepthSource() = default;

  /// Depths of `rows` rows of the view from `first_row` on, row by row; QJ_NO_HIT where a ray
  /// meets nothing.
  virtual std::vector<float> depths(const View& view, int first_row, int rows) = 0;

  /// From now on this ends what `depths` and `traits` do.
  virtual void stop_with(const std::stop_token& /*stop*/) {}

  /// Computes what the rays of a perspective view need, before the first of them.
  virtual void prepare(const View& /*view*/) {}

  /// A number from each point's orbit by which it is coloured, 0 … 1; empty where orbits give none.
  /// @param widths of the balls that points stand for: one for all, or one for each.
  virtual std::vector<float> traits(const std::vector<Eigen::Vector3d>& /*points*/,
                                    std::span<const double> /*widths*/) {
    return {};
  }

  /// What was left out of the views so far, in their units.
  virtual LoosePieces loose_pieces() const { return {}; }

  /// The width of the largest pieces that `depths` may show although they hang on nothing; 0 where
  /// all that it shows is to be drawn.
  virtual double largest_speck() const { return 0; }
  /// The same of pieces around which nothing is seen.
  virtual double largest_free_speck() const { return largest_speck(); }

  /// Depths that these rays meet behind what they have hit: QJ_NO_HIT where there is nothing, and
  /// about `until` where they do not come out of it.
  virtual std::vector<float> depths_beyond(const View& /*view*/,
                                           const std::vector<PassingRay>& rays) {
    std::vector<float> depths;
    depths.reserve(rays.size());
    for (const PassingRay& ray : rays) depths.push_back(ray.until);
    return depths;
  }

  /// Whether each of these rays is blocked before the last pixel width (of the camera's view) of
  /// its way. Empty where only depth maps can be used.
  /// @param seen_by the camera's view, in which the ends of the rays are seen.
  virtual std::vector<bool> blocked(const View& /*light*/, const View& /*seen_by*/,
                                    const std::vector<LightRay>& /*rays*/) {
    return {};
  }

  /// What orbits are looked up in: the tables that were made last.
  virtual LookupReport lookups() const { return {}; }

  /// A few points that reach about as far in every direction as what is framed, in the view's
  /// coordinates; empty where nothing is found.
  virtual std::vector<Eigen::Vector3d> outline() = 0;

  /// Lower bounds on how far points lie below the surface of {F₁ < L}, in the view's coordinates;
  /// empty where there is no inside.
  virtual std::vector<float> ways_inside(const std::vector<Eigen::Vector3d>& /*points*/) {
    return {};
  }

  /// A box that holds the shape, in the view's coordinates.
  virtual Box bounds() const = 0;
};

/// A map's set, as far as it is seen.
struct MarchedSet {
  Map map;
  int iterations = 6;
  std::optional<double> escape;  ///< the orbits', map units; by default none returns from it
  std::optional<Box> part;       ///< map units: what lies outside it is cut away
  Precision precision = Precision::single;  ///< arithmetic of rays and orbits
  Material material = Material::clay;       ///< what `traits` are of
  std::stop_token stop{};                   ///< ends the making of a source, and its work
  bool interpolates_images = true;          ///< iterates are looked up where that will do
  int cells = 144;                          ///< along the band, for safe steps and coarse depths
  double rays = 0;                          ///< that the first view will ask for; 0: not known
  bool keeps_loose = true;                  ///< pieces that hang on nothing
  /// Cells along the longest side of the finer grid that shows what pieces hang on: about as many
  /// as a surface has.
  int finest_cells = 256;
  std::optional<Box> framed{};  ///< map units: what the outline is of; by default all
};

/// A map's iterated set, in map coordinates, ray-marched on the device.
std::unique_ptr<DepthSource> march_source(const Device& device, const MarchedSet& set);

/// A mesh, as `to_scene` takes it, rasterised on the host.
/// @param framed the outline is that of the part of the mesh in this box, in the mesh's
/// coordinates; by default of all of it.
std::unique_ptr<DepthSource> mesh_source(TriangleMesh mesh, const ShapeToMap& to_scene = {},
                                         const std::optional<Box>& framed = {});

}  // namespace qjulia::picture

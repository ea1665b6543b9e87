#pragma once
/// A studio's parts: what is seen, from where, and how it is drawn.

#include <memory>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "picture/material_traits.hpp"
#include "picture/shading.hpp"
#include "picture/specks.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/picture/materials.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia {

namespace picture {

/// A picture as large as this has light maps and grids at full fineness; a smaller one has coarser
/// ones, down to kLeastFineness.
inline constexpr double kFullWidth = 1280, kFullHeight = 960, kLeastFineness = 0.2;
/// Rays that sample what a picture shows: its material's values, its light.
inline constexpr double kShownRays = 12000;

}  // namespace picture

struct Studio::Impl {
  static std::unique_ptr<Impl> of_map(const Device& device, const Map& map,
                                      const PictureOptions& options, bool is_draft,
                                      const std::stop_token& stop);
  struct Work;  ///< how far a picture is

  Device device;
  PictureOptions options;
  std::unique_ptr<picture::DepthSource> source;
  Box framed;           ///< in the scene
  ShapeToMap to_scene;  ///< from the shape's coordinates to those of source and frame
  double fineness = 1;
  bool is_draft = false;
  UpAxis known_up = kDefaultUp;  ///< where the camera does not say
  std::stop_token stop{};        ///< ends pictures that have no other
  picture::Coloring coloring{};
  MaterialRange range{};                             ///< the last picture's
  double exposure = 0;                               ///< the last picture's, stops
  std::optional<picture::Surrounded> environment{};  ///< in place of the rig's sky
  Rig rig{};
  std::optional<Box> part{};               ///< what cuts leave, in the scene
  std::vector<Eigen::Vector3d> outline{};  ///< shape units, once it was asked for
  std::optional<UpAxis> up{};              ///< for which sky and ground were made
  std::vector<picture::Light> sky{};
  std::vector<picture::Light> kept_lamps{};  ///< the last picture's
  std::optional<double> own_ground{};        ///< height along up, shape units, if it was given
  double ground = 0;                         ///< height along up, in the scene
  picture::GroundLight ground_light{};

  void turn(const Camera& camera);
  /// The camera with what is up.
  Camera standing(Camera camera) const;
  const std::vector<Eigen::Vector3d>& known_outline();
  std::vector<Camera> aimed(std::span<const Camera> cameras,
                            std::span<const Eigen::Vector3d> others);
  /// @param camera with a place of its own.
  picture::View view_of(const Camera& camera) const;
  bool has_material() const { return options.material != Material::clay; }
  /// About so many of a view's rays, and their depths.
  struct Sampled {
    picture::View few;
    std::vector<float> depths;
  };
  /// The look-up tables for the view's own rays are made first, and serve these rays, too, so that
  /// the picture is the same, bit for bit, where what these rays tell is given.
  Sampled sampled(const picture::View& view, double rays);
  /// Values of the material at about so many points of a view that was prepared.
  std::vector<float> shown(const picture::View& view, double rays);
  /// @param moving as `Studio::picture` has them
  LayeredImage picture(const ProgressMonitor& monitor, bool with_layers,
                       std::span<const Camera> moving);
  /// Depths of the sky's lights, and what they light of the ground.
  void light_sky(Work& work);
  /// The mean of the views, strip by strip; layers are those of the first.
  void draw(std::span<const picture::View> views, std::span<const picture::Light> lamps,
            const picture::Shading& shading, bool with_layers, Work& work,
            LayeredImage& picture) const;
  /// What of a strip a view shows.
  picture::Strip seen_strip(const picture::View& view, picture::SpecklessDepths& depths,
                            std::span<const picture::Light> lamps, int row, int rows) const;
  /// The views whose mean the picture is.
  std::vector<picture::View> views_of(const Camera& camera, std::span<const Camera> moving);
  /// The distance, along the axis, of what is seen nearest to the middle of a view.
  double distance_in_focus(const picture::View& view);
  /// The exposure, in stops, with which what this view shows gets as much light as in the studio.
  double metered(const picture::View& view, const picture::Shading& shading);

 private:
  picture::Scene scene() const {
    return {options,
            direction(*options.camera.up),
            ground,
            framed.center(),
            0.5 * framed.diagonal(),
            rig,
            environment ? &*environment : nullptr,
            environment ? environment->axes(*options.camera.up) : picture::Scene{}.around_axes};
  }
  /// The box whose faces, where they cut the set, have colours of their own; empty for heights and
  /// factors, which continue inside the set.
  std::optional<Box> faces() const {
    return facts_of(options.material).goes_on_inside ? std::nullopt : part;
  }
  /// What colours the strip's samples: a position in the palette, or, if below 0, minus the
  /// lightness of clay. Empty where all is plain clay.
  std::vector<float> traits_of(const picture::View& view, const picture::Strip& strip) const;
  /// What each lamp lights of the set, as lights; none without a bounce.
  std::vector<std::vector<float>> bounces(std::span<const picture::Light> lamps) const;
  void take_depths(picture::Light& light) const {
    light.depths = source->depths(light.view, 0, light.view.rows);
  }
};

}  // namespace qjulia

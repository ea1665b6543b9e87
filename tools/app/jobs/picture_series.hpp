#pragma once
/// Pictures that belong together: of one map or mesh, from several views.

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "describe/view_options.hpp"
#include "jobs/session.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/mesh/moving_mesh.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::tools {

/// What is drawn.
struct Scene {
  std::optional<Map> map;  ///< or else the mesh
  TriangleMesh mesh;
  /// Where it is set, the mesh is drawn though there is a map, from which it was made.
  struct Scattered {
    Box framed;         ///< what the camera frames
    double ground = 0;  ///< its height along up
    UpAxis up = kDefaultUp;
  };
  std::optional<Scattered> scattered{};
};

/// Reads a map or a mesh. @throws InputError
Scene read_scene(const std::string& input, Session& session);

/// Makes scenes whose parts fly. What does not change from one view to the next is made once.
class Scatterer {
 public:
  /// @param scene with a map whose knobs are turned as the view says. @throws InputError where its
  /// set is empty
  Scene at(const Device& device, Scene scene, const View& view, Session& session);

 private:
  nlohmann::json of_;  ///< what the mesh was made of
  MovingMesh moving_;
  Scene::Scattered about_;
};

/// The scene with the map's knobs turned, as the view shows it. @param input the map's file.
Scene turned(const Device& device, Scene scene, const std::string& input, const View& view,
             Session& session);

Studio studio_of(const Device& device, const Scene& scene, const PictureOptions& options,
                 Session& session);

/// The options, with the camera's place, the exposure and the range that the palette was spread
/// over.
PictureOptions as_drawn(PictureOptions options, Studio& studio);

/// The bytes of a map that a picture of the scene holds; empty for meshes.
/// @param options what was turned on the map, and `job` what turned it.
std::string carried_map(const Scene& scene, const MapOptions& options, const Job& job);

/// What the pictures of a series have in common, so that nothing jumps from one to the next.
struct SeriesFrame {
  std::vector<Camera> cameras;         ///< one for each view
  std::optional<MaterialRange> range;  ///< that the palette is spread over
  /// Stops, of views that have none of their own; none: that of the first picture that shows
  /// something.
  std::optional<double> exposure;
};

/// Tells of a picture as a part of all, `done` of which this run has made before it.
ProgressMonitor part_monitor(Session& session, std::size_t done, std::size_t all);

/// What of a picture was there already, from the one before.
enum class Kept {
  nothing,
  set,  ///< grids, lattice and table of the set
  all,  ///< the sky's light, too: only the camera or lamps have changed
};

/// Draws the pictures of a series, one after the other. A studio serves as long as the set does not
/// change, and its sky as long as nothing but the camera, lamps or matter do.
class PictureSeries {
 public:
  /// @param input the file of the map or mesh. @param views one at least; `scene` and `input` are
  /// those of views without a map of their own.
  /// @param job of the whole series.
  PictureSeries(const Device& device, Scene scene, std::string input, std::vector<View> views,
                Job job, Session& session);

  std::size_t size() const { return views_.size(); }
  /// Finds what the pictures have in common, from drafts of some of the views.
  SeriesFrame frame();
  /// The same, with the exposure, which a small picture tells: so that it does not depend on which
  /// pictures are drawn.
  SeriesFrame frame_with_exposure();
  /// Takes it over from an earlier run.
  void use(SeriesFrame frame) { frame_ = std::move(frame); }

  /// The camera of a picture while the shutter is open, as `Studio::picture` takes it.
  /// @param drawn the picture's camera, with its place.
  using Moving = std::function<std::vector<Camera>(std::size_t number, const Camera& drawn)>;
  /// Pictures show their cameras moving. Without this call all stand still.
  void open_shutter(Moving moving) { moving_ = std::move(moving); }

  struct Picture {
    Image image;
    View view;        ///< that it was drawn with
    std::string map;  ///< what the file holds of the map; empty: nothing
    Job job;          ///< of this picture alone
    Kept kept = Kept::nothing;
    std::vector<std::string> changed{};  ///< settings by which it differs from the one before
  };
  /// @param base what holds for all views. @param carries_map whether the file is to hold it.
  Picture picture(std::size_t number, const View& base, bool carries_map,
                  const ProgressMonitor& monitor);

 private:
  bool shows_one_set() const;
  /// The scene of a view, its knobs turned.
  Scene turned_scene(const View& view);
  SeriesFrame frame_of_camera();
  SeriesFrame frame_of_maps();
  /// The studio of a view, which may be the one before.
  Studio& studio(const View& view);
  /// What of the studio serves this view. @param changed becomes what does not.
  Kept kept_for(const nlohmann::json& wanted, std::vector<std::string>& changed) const;

  Device device_;
  Scene scene_;
  std::string input_;
  std::vector<View> views_;
  Job job_;
  Session& session_;
  std::optional<SeriesFrame> frame_;
  Moving moving_{};
  Scene shown_;
  std::optional<Studio> studio_;
  Scatterer scatterer_;
  bool is_lit_ = false;       ///< the studio has drawn a picture
  nlohmann::json of_studio_;  ///< the view that the studio is for, without its camera
};

}  // namespace qjulia::tools

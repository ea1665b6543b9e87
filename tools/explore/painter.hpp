#pragma once
/// Pictures of one map with its knobs turned, and what they have in common kept.

#include <list>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "explore/request.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::explore {

/// For one thread.
class Painter {
 public:
  /// @param mesh what a view of the mesh shows; it must stay.
  /// @param keep_loose for all pictures and for all files that are made of the map.
  Painter(Device device, const TriangleMesh* mesh, bool keep_loose)
      : device_(std::move(device)), mesh_(mesh), keep_loose_(keep_loose) {}

  const Device& device() const { return device_; }
  bool keeps_loose() const { return keep_loose_; }
  const Map& map() const { return map_; }
  /// From now on pictures are of this map.
  void show(Map map);
  /// From now on a view of the mesh shows this one, which must stay.
  void show_mesh(const TriangleMesh* mesh);

  /// The bytes of a PNG file. @throws InputError for what the map does not bear, Interrupted
  std::string picture(const ViewRequest& view, const ProgressMonitor& monitor);
  /// The points of the set that are seen at places of the picture (shares of its sides, from the
  /// upper left), shape units; none where no set is seen. @throws InputError, Interrupted
  std::vector<std::optional<Eigen::Vector3d>> points(const ViewRequest& view,
                                                     const std::vector<Eigen::Vector2d>& places,
                                                     const ProgressMonitor& monitor);
  /// The map with what the brush paints or plants. @throws InputError, also where the brush touches
  /// no set; Interrupted
  Map brushed(const BrushRequest& brush, const ProgressMonitor& monitor);
  /// The map with its knobs turned. @throws InputError
  const Map& turned(const ViewRequest& view);
  /// A map file's JSON of it.
  std::string map_file(const ViewRequest& view);

 private:
  /// A draft's and a whole picture's, of two pages.
  static constexpr std::size_t kMostStudios = 4;
  struct Kept {
    std::string text;  ///< what the requests that it serves have in common
    bool is_of_mesh;
    Studio studio;
  };

  Studio new_studio(const ViewRequest& view, const std::stop_token& stop);
  Studio& studio(const ViewRequest& view, const std::stop_token& stop);

  Device device_;
  const TriangleMesh* mesh_;
  Map map_;
  bool keep_loose_;
  std::string turned_text_ = "none";
  Map turned_;
  std::string range_text_ = "none";  ///< what the last whole picture showed, and its range
  MaterialRange range_;
  std::list<Kept> studios_;  ///< the last one used first
};

}  // namespace qjulia::explore

#pragma once
/// Pictures of one map with its knobs turned, and what they have in common kept.

#include <list>
#include <stop_token>
#include <string>

#include "explore/view_request.hpp"
#include "qjulia/device.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia::explore {

/// For one thread.
class Painter {
 public:
  /// @param mesh what a view of the mesh shows; it must stay.
  /// @param keep_loose of all pictures.
  /// @param end ends all work.
  Painter(Device device, const TriangleMesh* mesh, bool keep_loose, std::stop_token end)
      : device_(std::move(device)), mesh_(mesh), keep_loose_(keep_loose), end_(std::move(end)) {}

  const Device& device() const { return device_; }
  /// From now on pictures are of this map.
  void show(RationalMap map);

  /// The bytes of a PNG file. @throws InputError for what the map does not bear, Interrupted
  std::string picture(const ViewRequest& view, const std::stop_token& stop);
  /// The map with its knobs turned. @throws InputError
  const RationalMap& turned(const ViewRequest& view);
  /// A map file's JSON of it.
  std::string map_file(const ViewRequest& view);

 private:
  /// As many sizes of a picture as a page asks for in turn.
  static constexpr std::size_t kMostStudios = 4;
  struct Kept {
    std::string text;  ///< of the requests that it serves
    bool is_of_mesh;
    Studio studio;
  };

  Studio new_studio(const ViewRequest& view);
  Studio& studio(const ViewRequest& view);

  Device device_;
  const TriangleMesh* mesh_;
  RationalMap map_;
  bool keep_loose_;
  std::stop_token end_;
  std::string turned_text_ = "none";
  RationalMap turned_;
  std::list<Kept> studios_;  ///< the last one used first
};

}  // namespace qjulia::explore

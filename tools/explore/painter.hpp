#pragma once
/// Pictures of one map with its knobs turned, and what they have in common kept.

#include <list>
#include <stop_token>
#include <string>

#include "explore/view_request.hpp"
#include "qjulia/device.hpp"
#include "qjulia/rational_map.hpp"

namespace qjulia::explore {

/// For one thread.
class Painter {
 public:
  /// @param keep_loose of all pictures. @param end ends all work.
  Painter(Device device, RationalMap map, bool keep_loose, std::stop_token end)
      : device_(std::move(device)),
        map_(std::move(map)),
        keep_loose_(keep_loose),
        end_(std::move(end)) {}

  /// The bytes of a PNG file. @throws InputError for what the map does not bear, Interrupted
  std::string picture(const ViewRequest& view, const std::stop_token& stop);
  /// A map file's JSON of the map with its knobs turned.
  std::string map_file(const ViewRequest& view);

 private:
  /// As many sizes of a picture as a page asks for in turn.
  static constexpr std::size_t kMostStudios = 4;
  struct Kept {
    std::string text;  ///< of the requests that it serves
    Studio studio;
  };

  const RationalMap& turned(const ViewRequest& view);
  Studio& studio(const ViewRequest& view);

  Device device_;
  RationalMap map_;
  bool keep_loose_;
  std::stop_token end_;
  std::string turned_text_ = "none";
  RationalMap turned_;
  std::list<Kept> studios_;  ///< the last one used first
};

}  // namespace qjulia::explore

#include "explore/turntable.hpp"

#include <fmt/format.h>

#include <vector>

#include "qjulia/picture/picture.hpp"

namespace qjulia::explore {

std::string turntable(const Device& device, const Map& map, const MakeRequest& request,
                      const ProgressMonitor& monitor) {
  constexpr double kTurnSeconds = 4;  // once around
  const PictureOptions& options = request.view.picture;
  Studio studio(device, map, options, monitor.stop);
  std::vector<Camera> cameras(static_cast<std::size_t>(request.frames), options.camera);
  for (int i = 0; i < request.frames; ++i) {
    cameras[static_cast<std::size_t>(i)].azimuth += 360.0 * i / request.frames;
  }
  cameras = studio.aimed(cameras);
  studio.set_range(range_over(studio.shown(cameras), options.material));
  std::vector<Image> images;
  for (int i = 0; i < request.frames; ++i) {
    ProgressMonitor part = monitor;
    part.on_progress = [&](Progress progress) {
      progress.fraction = (i + progress.fraction) / request.frames;
      monitor.report(progress);
    };
    images.push_back(studio.picture(cameras[static_cast<std::size_t>(i)], part));
  }
  monitor.report({"", 1, 0, fmt::format("{} pictures", request.frames)});
  return animated_png_bytes(images, kTurnSeconds / request.frames);
}

}  // namespace qjulia::explore

#include "explore/maker.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "explore/cut_mesh.hpp"
#include "qjulia/error.hpp"
#include "qjulia/figures.hpp"
#include "qjulia/mesh.hpp"
#include "qjulia/picture.hpp"

namespace qjulia::explore {
namespace {

constexpr double kTurnSeconds = 4;  ///< of a turntable, once around

/// A folder of this process, gone with what is in it.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_((std::filesystem::temp_directory_path() / "qjulia-XXXXXX").string()) {
    if (::mkdtemp(path_.data()) == nullptr) {
      throw OutputError(fmt::format("cannot make a folder for temporary files: {}", path_));
    }
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  std::filesystem::path path() const { return path_; }

 private:
  std::string path_;
};

std::string bytes_of(const TriangleMesh& mesh, const std::string& extension,
                     const std::optional<UpAxis>& up) {
  const TemporaryFolder folder;
  const auto file = folder.path() / ("mesh" + extension);
  write_mesh(mesh, file, "", up);
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(bytes).str();
}

std::string mesh_file(const Device& device, RationalMap map, const MakeRequest& request,
                      const ProgressMonitor& monitor) {
  if (request.millimetres) map = with_longest_side(std::move(map), *request.millimetres);
  // Pictures are drawn on `device` while slabs of the mesh are evaluated on threads of their own.
  TriangleMesh mesh = extract_surface(device.sibling(), map, request.surface, monitor);
  if (mesh.triangles.empty()) throw Error("the set is empty: try less detail, or fewer iterations");
  drop_loose_pieces(mesh);
  for (const Cut& cut : request.view.picture.cuts) {
    if (!map.box) throw InputError("cut: the map keeps no box of its shape");
    const int axis = cut.axis - 'x';
    mesh = cut_away(mesh, axis, std::lerp(map.box->low[axis], map.box->high[axis], cut.at / 100));
  }
  if (mesh.triangles.empty()) throw Error("nothing is left of the set: cut less away");
  const MeshReport report = inspect(mesh);
  monitor.report({"", 1, 0,
                  fmt::format("{} triangles, {}", report.triangles,
                              report.closed()                     ? "closed and manifold"
                              : request.view.picture.cuts.empty() ? "not closed"
                                                                  : "open where it is cut")});
  return bytes_of(mesh, request.extension, map.up);
}

std::string turntable(const Device& device, const RationalMap& map, const MakeRequest& request,
                      const ProgressMonitor& monitor) {
  const PictureOptions& options = request.view.picture;
  Studio studio(device, map, options, monitor.stop);
  std::vector<Image> images;
  for (int i = 0; i < request.frames; ++i) {
    ProgressMonitor part = monitor;
    part.on_progress = [&](Progress progress) {
      progress.fraction = (i + progress.fraction) / request.frames;
      monitor.report(progress);
    };
    Camera camera = options.camera;
    camera.azimuth += 360.0 * i / request.frames;
    images.push_back(studio.picture(camera, part));
  }
  monitor.report({"", 1, 0, fmt::format("{} pictures", request.frames)});
  return animated_png_bytes(images, kTurnSeconds / request.frames);
}

}  // namespace

std::string made_file(const Device& device, const RationalMap& map, const MakeRequest& request,
                      const ProgressMonitor& monitor) {
  if (request.is_turntable) return turntable(device, map, request, monitor);
  return mesh_file(device, map, request, monitor);
}

}  // namespace qjulia::explore

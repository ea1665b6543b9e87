#pragma once
/// What a batch does with an entry: a mesh in, a map, a surface and a picture out.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "batch/batch.hpp"
#include "qjulia/base/progress.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/device/tuning_cache.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::tools {

class FitWorker {
 public:
  explicit FitWorker(CachedTuning kept);

  batch::EntryResult operator()(const batch::BatchEntry& entry, const std::filesystem::path& folder,
                                const batch::EntryMonitor& monitor) const;

 private:
  FitResult fit_resumable(const TriangleMesh& mesh, FitOptions options,
                          const std::filesystem::path& checkpoint,
                          const ProgressMonitor& monitor) const;
  /// Figures at each n that the entry is compared at.
  nlohmann::json comparisons(const batch::BatchEntry& entry, const TriangleMesh& mesh,
                             const Map& map, const ProgressMonitor& monitor) const;

  Device device_;
  std::string tuning_warning_;
};

/// Hashes of the mesh's bytes and of every option the results depend on.
batch::FitKey fit_key(const batch::BatchEntry& entry);

/// For the summary: every option, and the version of the program.
nlohmann::json settings(const batch::BatchEntry& entry);

}  // namespace qjulia::tools

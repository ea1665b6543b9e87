#pragma once
/// Where a map came from, as its file tells.

#include <filesystem>
#include <nlohmann/json.hpp>

#include "qjulia/fit.hpp"

namespace qjulia::tools {

/// Every option of a fit, by its name on the command line. No time limit is null.
nlohmann::json to_json(const FitOptions& options);

/// One stage, as it went.
nlohmann::json to_json(const StageReport& stage);

/// Program, mesh (name and hash), options, device, stages, figures and times. Times differ from run
/// to run; nothing else does.
nlohmann::json provenance(const std::filesystem::path& mesh_path, const FitOptions& options,
                          const DeviceInfo& device, const FitResult& result);

/// Energy and IoU (n = 1, coarse grid) a fit ended with; null where it had no stage.
nlohmann::json final_figures(const FitResult& result);

}  // namespace qjulia::tools

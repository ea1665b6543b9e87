#pragma once
/// A fit on one page: what was fitted, how it went, how well it turned out.

#include <filesystem>
#include <string>
#include <vector>

#include "qjulia/fit/fit.hpp"
#include "qjulia/mesh/mesh.hpp"
#include "qjulia/picture/picture.hpp"
#include "qjulia/surface/compare.hpp"

namespace qjulia::report {

/// A picture and the line under it.
struct CaptionedImage {
  std::string caption;
  Image image;
};

/// Everything the page shows.
struct FitReport {
  std::string title;
  FitResult result;                      ///< with the map's provenance
  std::vector<CaptionedImage> pictures;  ///< in one view
  std::vector<FitMetrics> metrics;       ///< at n = 1 and n = 6
};

/// Draws the mesh, the potential (n = 1) and the set (n = 6), and measures the fit.
FitReport make_report(const Device& device, const TriangleMesh& mesh, const FitResult& result,
                      const std::string& title, const ProgressMonitor& monitor = {});

/// One page that needs nothing else: pictures and curves stand in the text. Well-formed XML too.
std::string report_html(const FitReport& report);

/// `report_html` as a file, under a temporary name that is renamed; its folder is made where it
/// does not exist. @throws OutputError
void write_report(const FitReport& report, const std::filesystem::path& file);

}  // namespace qjulia::report

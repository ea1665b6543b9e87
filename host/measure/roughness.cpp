#include "qjulia/surface/roughness.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "base/range_check.hpp"
#include "measure/outline.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/mesh/shape.hpp"
#include "qjulia/surface/cell_mesh.hpp"
#include "qjulia/surface/surface.hpp"

namespace qjulia {
namespace {

constexpr double kOutlineRadius = 1.0 / 20;  // times the longest side
constexpr int kLeastOutlineCells = 16, kMostOutlineCells = 512;
constexpr int kPorosityCells = 128;
constexpr int kLeastRoughCells = 32, kMostRoughCells = 2048;
constexpr int kMostMeshCells = 1024;
constexpr int kCoarsestCells = 16;
constexpr std::size_t kScales = 4;

/// The finest cells, a half of them and so on, coarsest first.
std::vector<int> halved(int finest) {
  std::vector<int> all;
  for (int cells = finest; cells >= kCoarsestCells && all.size() < kScales; cells /= 2) {
    all.insert(all.begin(), cells);
  }
  return all;
}

/// A scale, with ratios over the figures of what all scales are of.
nlohmann::json scale_json(const SurfaceAtScale& scale, const SurfaceFigures& whole) {
  nlohmann::json one = to_json(scale.figures);
  one["resolution"] = scale.resolution;
  one["area_ratio"] = scale.figures.area / whole.area;
  one["volume_ratio"] = scale.figures.volume / whole.volume;
  return one;
}

/// The slope of ln area over ln cells by least squares.
double slope_of(const std::vector<SurfaceAtScale>& scales) {
  double x_mean = 0, y_mean = 0;
  const auto count = static_cast<double>(scales.size());
  for (const SurfaceAtScale& s : scales) {
    x_mean += std::log(s.resolution) / count;
    y_mean += std::log(s.figures.area) / count;
  }
  double slope = 0, spread = 0;
  for (const SurfaceAtScale& s : scales) {
    const double x = std::log(s.resolution) - x_mean;
    slope += x * (std::log(s.figures.area) - y_mean);
    spread += x * x;
  }
  return slope / spread;
}

/// Of a cell, about, whose centre is so far outside of a surface.
double share_inside(double distance, double step) {
  return std::clamp(0.5 - distance / step, 0.0, 1.0);
}

/// The map's surface without loose pieces.
TriangleMesh surface_of_set(const Device& device, const Map& map, const RoughnessOptions& options,
                            const std::stop_token& stop) {
  const SurfaceOptions surface{.resolution = options.resolution, .iterations = options.iterations};
  TriangleMesh mesh = extract_surface(device, map, surface, {{}, stop});
  if (mesh.triangles.empty()) {
    throw InputError(
        "the set has no surface on this grid; give less detail, or a higher resolution where the "
        "set is thinner than a cell");
  }
  drop_loose_pieces(mesh);
  return mesh;
}

}  // namespace

void RoughnessOptions::validate() const {
  base::expect_between("resolution", resolution, kLeastRoughCells, kMostRoughCells);
  SurfaceOptions{.resolution = resolution, .iterations = iterations}.validate();
}

Porosity porosity(const Device& device, const TriangleMesh& mesh, int resolution,
                  const std::stop_token& stop) {
  base::expect_between("resolution", resolution, kLeastOutlineCells, kMostOutlineCells);
  mesh.validate();
  const SignedDistance distance(device, mesh, Precision::single, stop);
  const Box box = mesh.box();
  const double side = box.size().maxCoeff();
  Porosity result;
  result.radius = kOutlineRadius * side;
  const double step = side / resolution;
  // Balls that touch the body have their centres up to a radius away from it. Points are centres of
  // cells, half a step off the box's faces.
  const surface::Grid grid =
      surface::grid_around(box, step, std::ceil(2 * result.radius / step) - 0.5);
  std::vector<double> radius, filled;  // of a ball, and which share of the cell is in the body
  std::vector<Eigen::Vector3d> slice;
  for (int z = 0; z < grid.points.z(); ++z) {
    slice.clear();
    for (int y = 0; y < grid.points.y(); ++y) {
      for (int x = 0; x < grid.points.x(); ++x) slice.push_back(grid.point({x, y, z}));
    }
    for (const double d : distance.at(slice, stop)) {
      filled.push_back(share_inside(d, step));
      radius.push_back(d >= result.radius ? d : 0);
    }
  }
  const double body = std::reduce(filled.begin(), filled.end());
  if (body < 1) {
    throw InputError("the mesh fills less than a cell; it is open, or thinner than a cell");
  }
  throw_if_stopped(stop);
  const std::vector<double> power = surface::power_of_balls(grid, radius);
  double outline = 0;
  for (std::size_t i = 0; i < power.size(); ++i) {
    // Balls that touch the outline are hardly larger than the least.
    const double beyond =
        std::sqrt(std::max(0.0, power[i] + result.radius * result.radius)) - result.radius;
    outline += std::max(filled[i], share_inside(-beyond, step));
  }
  result.outline_volume = outline * step * step * step;
  result.share = 1 - body / outline;
  return result;
}

SurfaceFigures figures_of_set(const Device& device, const Map& map, const RoughnessOptions& options,
                              const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  return measure(surface_of_set(device, map, options, monitor.stop), monitor.stop);
}

MeshScales mesh_scales(const Device& device, const TriangleMesh& mesh, int resolution,
                       const ProgressMonitor& monitor) {
  base::expect_between("resolution", resolution, kLeastRoughCells, kMostMeshCells);
  MeshScales result;
  result.whole = measure(mesh, monitor.stop);
  double done = 0;
  for (const int cells : halved(resolution)) {
    monitor.report({"measuring roughness", done, -1, ""});
    const TriangleMesh seen = cell_mesh(device, mesh, cells, monitor.stop);
    result.scales.push_back({cells, measure(seen, monitor.stop)});
    done = double(cells) / resolution;
  }
  result.area_slope = slope_of(result.scales);
  return result;
}

Roughness roughness(const Device& device, const Map& map, const RoughnessOptions& options,
                    const ProgressMonitor& monitor) {
  options.validate();
  map.validate();
  const auto report = [&](double done) { monitor.report({"measuring roughness", done, -1, ""}); };
  report(0);
  Roughness result;
  for (const int cells : halved(options.resolution)) {
    const RoughnessOptions scale{cells, options.iterations};
    const TriangleMesh set = surface_of_set(device, map, scale, monitor.stop);
    result.scales.push_back({cells, measure(set, monitor.stop)});
    report(0.5 * cells / options.resolution);
    if (cells == options.resolution) {
      result.porosity = porosity(device, set, std::min(cells, kPorosityCells), monitor.stop);
    }
  }
  report(0.9);
  result.area_slope = slope_of(result.scales);
  result.smooth =
      measure(surface_of_set(device, map, {options.resolution, 1}, monitor.stop), monitor.stop);
  report(1);
  return result;
}

nlohmann::json to_json(const Porosity& porosity) {
  return {{"outline_radius", porosity.radius},
          {"outline_volume", porosity.outline_volume},
          {"share", porosity.share}};
}

nlohmann::json to_json(const MeshScales& scales) {
  nlohmann::json list = nlohmann::json::array();
  for (const SurfaceAtScale& scale : scales.scales) list.push_back(scale_json(scale, scales.whole));
  return {{"scales", list}, {"area_slope", scales.area_slope}};
}

nlohmann::json to_json(const Roughness& roughness) {
  nlohmann::json scales = nlohmann::json::array();
  for (const SurfaceAtScale& scale : roughness.scales) {
    scales.push_back(scale_json(scale, roughness.smooth));
  }
  return {{"scales", scales},
          {"area_slope", roughness.area_slope},
          {"smooth_area", roughness.smooth.area},
          {"smooth_volume", roughness.smooth.volume},
          {"porosity", to_json(roughness.porosity)}};
}

}  // namespace qjulia

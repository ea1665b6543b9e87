#include "volume/volume.hpp"

#include <dlfcn.h>
#include <fmt/format.h>

#include <exception>
#include <functional>
#include <string_view>

#include "base/output_file.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::volume {
namespace {

struct Module {
  const OpenVdb* openvdb = nullptr;
  std::string problem;  ///< without it
};

/// Where the module lies beside an installed program, or one in its build folder.
std::filesystem::path module_path() {
  std::error_code ignored;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
  const auto built = folder / QJULIA_BUILT_MODULE;
  return exists(built, ignored) ? built : folder / QJULIA_INSTALLED_MODULE;
}

Module load_module() {
  const std::filesystem::path path = module_path();
  if (!path.is_absolute()) return {nullptr, "/proc is missing"};
  void* const library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return {nullptr, dlerror()};
  void* const function = dlsym(library, "qjulia_openvdb");
  const auto functions =
      function == nullptr ? nullptr : reinterpret_cast<decltype(&qjulia_openvdb)>(function)();
  if (functions == nullptr || std::string_view(functions->built_with) != QJULIA_MODULE_VERSION) {
    return {nullptr, path.string() + " belongs to another version"};
  }
  return {functions, {}};
}

/// Loaded at the first call.
const Module& module() {
  static const Module loaded = load_module();
  return loaded;
}

/// A file of what `write` puts into a stream.
void write_file(const std::filesystem::path& path,
                const std::function<void(std::ostream&)>& write) {
  base::OutputFile file(path);
  try {
    write(file.stream());
  } catch (const std::exception& failed) {
    throw OutputError(fmt::format("cannot write '{}': {}", path.string(), failed.what()));
  }
  file.commit();
}

}  // namespace

void expect_openvdb(const std::filesystem::path& path) {
  if (module().openvdb != nullptr) return;
  throw InputError(
      fmt::format("cannot write '{}': this qjulia has no OpenVDB ({}); write another format, or "
                  "build qjulia where libopenvdb-dev is installed",
                  path.string(), module().problem));
}

std::string openvdb_version() {
  const OpenVdb* openvdb = module().openvdb;
  return openvdb == nullptr ? "no OpenVDB" : fmt::format("OpenVDB {}", openvdb->version);
}

void write_level_set(const TriangleMesh& mesh, double voxel, const Eigen::Matrix3d& turn,
                     const VolumeNote& about, const std::filesystem::path& path) {
  expect_openvdb(path);
  write_file(path, [&](std::ostream& out) {
    module().openvdb->write_level_set(mesh, voxel, turn, about, out);
  });
}

CellGrid write_grids(const Device& device, const Map& map, const SampleOptions& options,
                     const VolumeNote& about, const std::filesystem::path& path,
                     const ProgressMonitor& monitor) {
  expect_openvdb(path);
  CellGrid cells = sample_grid(device, map, options, monitor.stop);
  const auto& count = cells.cells;
  const auto grids = module().openvdb->field_grids(
      {{count[0], count[1], count[2]}, cells.center(0, 0, 0), cells.cell()},
      map.dynamics.surface_level);
  sample_field(
      device, map, options, cells, CellOrder::z_fastest,
      [&](std::span<const double> values) { grids->take(values); }, monitor);
  write_file(path, [&](std::ostream& out) { grids->write(about, out); });
  return cells;
}

}  // namespace qjulia::volume

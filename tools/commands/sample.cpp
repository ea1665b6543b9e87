/// qjulia sample: a map in, its field on a grid out.

#include "qjulia/map/sample.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

#include "base/file_types.hpp"
#include "base/setting_json.hpp"
#include "commands/commands.hpp"
#include "describe/files.hpp"
#include "describe/map_options.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "qjulia/map/sample_settings.hpp"
#include "volume/volume.hpp"

namespace qjulia::tools {
namespace {

struct SampleArguments {
  std::string map;
  OutputName output;
  TrustedDevice device;
  MapOptions map_options;
  SampleOptions options;
};

/// Arrays, and volumes.
std::vector<std::string> field_types() {
  auto types = base::extensions(base::FileContent::field, base::FileUse::write);
  std::ranges::copy(base::extensions(base::FileContent::volume, base::FileUse::write),
                    std::back_inserter(types));
  return types;
}

bool makes_volume(const SampleArguments& arguments) {
  return base::has_type(arguments.output.path, base::FileContent::volume, base::FileUse::write);
}

Plan plan_sample(const SampleArguments& arguments) {
  arguments.map_options.knobs.validate();
  arguments.options.validate();
  return {{arguments.map}, {output_named("--output", arguments.output, field_types())}};
}

int run_sample(const SampleArguments& arguments, const Plan& /*plan*/, Session& session) {
  const SampleOptions& options = arguments.options;
  if (makes_volume(arguments)) volume::expect_openvdb(arguments.output.path);
  const Map read = session.read_map(arguments.map);
  const Device device = session.open_device(arguments.device);
  const Map map = with_knobs(device, read, arguments.map_options, arguments.map);
  const nlohmann::json how = made_with(session.job());
  const CellGrid grid = makes_volume(arguments)
                            ? volume::write_grids(device, map, options,
                                                  {named_after(arguments.map, ""), one_line(how)},
                                                  arguments.output.path, session.monitor())
                            : write_field(device, map, options, arguments.output.path,
                                          one_line(how), session.monitor());
  session.report_kernels(device);
  const double seconds = session.seconds();
  session.console.summary(fmt::format("{} x {} x {} cells, {} precision, {:.1f} s\nfield: {}",
                                      grid.cells[0], grid.cells[1], grid.cells[2],
                                      to_string(options.precision), seconds, arguments.output.path),
                          {{"field", arguments.output.path},
                           {"cells", grid.cells},
                           {"box", base::value_json(grid.box)},
                           {"surface_level", map.dynamics.surface_level},
                           {"made_with", how},
                           {"seconds", seconds}});
  return kDone;
}

void describe_sample(Command command, SampleArguments& a) {
  command.input("MAP", a.map, "Map file of 'qjulia fit' or 'qjulia shape'")
      .offers_files(readable({base::FileContent::map}));
  command
      .output(
          "-o,--output", a.output, [&a] { return named_after(a.map, ".npy"); }, "FIELD",
          "Field to write: " +
              base::extension_list(base::FileContent::field, base::FileUse::write) +
              ", or .vdb for OpenVDB." + named_text("map", ".npy"))
      .offers_files(field_types());
  const auto& resolution = setting_named(sample_settings(), "resolution", "samples");
  add_setting(command, resolution, resolution.place(a.options));
  add_map_options(command, a.map_options, sample_settings(), "samples", a.options);
  add_device_to_use(command, a.device);
}

}  // namespace

void add_sample(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen, {"sample", "Write a map's field on a grid", std::string(R"(Examples:
  qjulia sample bunny.qjulia.json -o bunny.npy --resolution 256
  qjulia sample bunny.qjulia.json -o bunny.vdb --resolution 128
  qjulia sample bunny.qjulia.json -o ear.vti --box 0 0.1 -0.1 0.2 0.3 0.1
Values are F_n at cell centres: the logarithm of the last iterate's norm, where iteration
ends at --escape or after --iterations. A point is inside where F_n is below the map's
surface level ('qjulia info' and --json print it). In .npy the array is [x][y][z]; ParaView
opens .vti, and a contour of F at the level is the set's surface. A .vdb has the grid "F"
and "density", for smoke: the level less F_n, from 0 to 1, in single precision.
)") + kMapOptionsHelp},
              describe_sample, plan_sample, run_sample);
}

}  // namespace qjulia::tools

#include "describe/options.hpp"

#include <fmt/format.h>

#include "qjulia/base/error.hpp"

namespace qjulia::tools {

void add_verbosity(Command command, Verbosity& verbosity) {
  const Option quiet =
      command.flag("-q,--quiet", verbosity.quiet, "Say nothing but results, warnings and errors")
          .not_in_job();
  command.flag("-v,--verbose", verbosity.verbose, "Say more, such as where the device's time went")
      .not_in_job()
      .excludes({quiet});
  command
      .flag("--json", verbosity.json,
            "Print the result as one JSON object on standard output; everything else goes to "
            "standard error")
      .not_in_job();
}

Option add_box(Command command, const std::string& name, std::optional<Box>& box,
               const std::string& description) {
  const auto take = [&box](const std::vector<double>& b) {
    box = Box{{b[0], b[1], b[2]}, {b[3], b[4], b[5]}};
    if (!(box->size().array() > 0).all()) {
      throw InputError("give X0 Y0 Z0 X1 Y1 Z1 with X0 < X1, Y0 < Y1 and Z0 < Z1");
    }
  };
  return command.numbers(name, "X0 Y0 Z0 X1 Y1 Z1", take, description);
}

Option add_vector(Command command, const std::string& name, std::optional<Eigen::Vector3d>& vector,
                  const std::string& description) {
  const auto take = [&vector](const std::vector<double>& v) {
    vector = Eigen::Vector3d(v[0], v[1], v[2]);
  };
  return command.numbers(name, "X Y Z", take, description);
}

void add_device(Command command, DeviceChoice& device) {
  command
      .add("--device", &device.name, "DEVICE",
           "Where to compute: gpu, cpu, P:D (platform and device number of 'qjulia devices') or "
           "part of a name. Default: $QJULIA_DEVICE, else what ranks first in 'qjulia devices'")
      .not_in_job()
      .offers({"gpu", "cpu"});
  const auto set_layout = [&device](const std::string& layout) {
    if (layout != "auto" && layout != "cpu" && layout != "gpu") {
      throw InputError(fmt::format("'{}' is no layout; give auto, cpu or gpu", layout));
    }
    device.layout = layout;
  };
  command
      .word("--layout", "LAYOUT", set_layout,
            "How kernels are cut into work-items: cpu (wide lanes), gpu (groups of work-items that "
            "share local memory) or auto, what suits the device. Default: $QJULIA_LAYOUT, else "
            "auto")
      .not_in_job()
      .offers({"auto", "cpu", "gpu"});
}

void add_device_to_use(Command command, TrustedDevice& device) {
  add_device(command, device);
  command
      .flag("--trust-device", device.is_trusted,
            "Use a GPU without the self-test that precedes its first use, which takes about a "
            "second once for each driver and version. Programs whose build has crashed are still "
            "left out")
      .not_in_job();
}

void add_trace(Command command, std::string& file) {
  command
      .file("--trace", file, "FILE",
            "Write what ran when, stages of the host and kernels of the device, as a trace-event "
            "JSON for ui.perfetto.dev or chrome://tracing")
      .not_in_job()
      .offers_files({".json"});
}

void add_command_profile(Command command, std::string& file) {
  command
      .file("--profile", file, "FILE.json",
            "Write every kernel that ran, with its launches and their sizes, seconds, share, work, "
            "the share of the device's limits that it reached and what limits it, and the host's "
            "stages beside them; the limits are measured before and afterwards, in one to two "
            "seconds")
      .not_in_job()
      .offers_files({".json"});
}

std::string named_text(const std::string& input, const std::string& extension) {
  return fmt::format(
      " Default: the {}'s name with {} in this folder, where a file that exists is not replaced",
      input, extension);
}

std::string left_out_text(const LoosePieces& loose, const std::string& before) {
  if (loose.count == 0) return {};
  return fmt::format("{}{} loose piece{} left out, {:.2g} % of the volume; --keep-loose keeps {}",
                     before, loose.count, loose.count == 1 ? "" : "s", 100 * loose.share,
                     loose.count == 1 ? "it" : "them");
}

}  // namespace qjulia::tools

#include "options.hpp"

#include <fmt/format.h>

#include "qjulia/error.hpp"
#include "qjulia/orbit_settings.hpp"
#include "setting_option.hpp"

namespace qjulia::tools {

void refuse(const std::vector<Option>& options, const char* why) {
  std::string names;
  for (const Option& option : options) {
    if (option.given()) names += (names.empty() ? "" : ", ") + option.name();
  }
  if (!names.empty()) throw InputError(fmt::format("{}; leave out {}", why, names));
}

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

Option add_precision(Command command, Precision& precision, const std::string& description) {
  return add_setting(command, with_help(precision_setting(), description), WordPlace(precision));
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

std::vector<Option> add_device(Command command, DeviceChoice& device) {
  const Option name = command.add(
      "--device", &device.name, "DEVICE",
      "Where to compute: gpu, cpu, P:D (platform and device number of 'qjulia devices') or "
      "part of a name. Default: $QJULIA_DEVICE, else what ranks first in 'qjulia devices'");
  name.not_in_job().offers({"gpu", "cpu"});
  const auto set_layout = [&device](const std::string& layout) {
    if (layout != "auto" && layout != "cpu" && layout != "gpu") {
      throw InputError(fmt::format("'{}' is no layout; give auto, cpu or gpu", layout));
    }
    device.layout = layout;
  };
  const Option layout = command.word(
      "--layout", "LAYOUT", set_layout,
      "How kernels are cut into work-items: cpu (wide lanes), gpu (groups of work-items that "
      "share local memory) or auto, what suits the device. Default: $QJULIA_LAYOUT, else auto");
  layout.not_in_job().offers({"auto", "cpu", "gpu"});
  return {name, layout};
}

std::vector<Option> add_device_to_use(Command command, TrustedDevice& device) {
  std::vector<Option> options = add_device(command, device);
  options.push_back(
      command
          .flag("--trust-device", device.is_trusted,
                "Use a GPU without the self-test that precedes its first use, which takes about a "
                "second once for each driver and version. Programs whose build has crashed are "
                "still left out")
          .not_in_job());
  return options;
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
            "Write every kernel that ran, with its launches, seconds, share, work and the share of "
            "the device's limits that it reached, and the host's stages beside them; the limits "
            "are measured before and afterwards, in one to two seconds")
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

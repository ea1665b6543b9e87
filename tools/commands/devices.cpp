/// qjulia devices: what can compute here, and what would be used.

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "commands/commands.hpp"
#include "console/device_obstacles.hpp"

namespace qjulia::tools {
namespace {

std::string kind_text(const DeviceInfo& d) {
  if (d.kind != DeviceKind::gpu) return to_string(d.kind);
  return d.shares_memory ? "gpu that shares the host's memory" : "gpu with memory of its own";
}

/// Why this device and no other.
std::string reason(const DeviceChoice& wanted, std::size_t devices) {
  if (!wanted.name.empty()) return fmt::format("--device asks for '{}'", wanted.name);
  if (const char* const name = std::getenv("QJULIA_DEVICE"); name != nullptr && *name != '\0') {
    return fmt::format("QJULIA_DEVICE asks for '{}'", name);
  }
  if (devices == 1) return "it is the only one";
  return "it ranks first: GPUs with memory of their own come before those that share the host's, "
         "other accelerators and CPUs, and within a kind the one with the highest estimated speed, "
         "which is compute units times clock times multiply-adds per clock of a unit, comes first";
}

std::string to_text(const DeviceInfo& d, bool chosen, bool verbose) {
  constexpr double kGiB = 1024.0 * 1024.0 * 1024.0;
  std::string text =
      fmt::format("{} {}\n      {}, {} compute units at {} MHz, {:.1f} GiB, {}\n",
                  chosen ? "*" : " ", describe(d), d.platform_name, d.compute_units, d.clock_mhz,
                  static_cast<double>(d.global_memory) / kGiB,
                  d.has_double ? "single and double precision" : "single precision only");
  text += fmt::format("      rank {}: {}, about {:.0f} billion multiply-adds a second at most\n",
                      d.rank, kind_text(d), d.estimated_speed);
  if (!d.same_as.empty()) {
    text += fmt::format(
        "      the same GPU as {}, which is used because its platform is preferred; --device {}:{} "
        "chooses this one\n",
        d.same_as, d.platform, d.index);
  }
  if (verbose) {
    text += fmt::format(
        "      {}, driver {}, {}\n"
        "      {} float lanes, buffers up to {:.1f} GiB, {} KiB local memory, work-groups of up to "
        "{}\n",
        d.vendor, d.driver_version, d.opencl_version, d.native_float_lanes,
        static_cast<double>(d.largest_allocation) / kGiB, d.local_memory / 1024,
        d.largest_work_group);
  }
  return text;
}

int run_devices(const DeviceChoice& wanted, Session& session) {
  expect_room_for_drivers();
  const DeviceInfo chosen = Device::choose(wanted).info();
  std::string text;
  nlohmann::json list = nlohmann::json::array();
  const auto devices = list_devices();
  for (const DeviceInfo& d : devices) {
    text += to_text(d, d.platform == chosen.platform && d.index == chosen.index,
                    session.console.verbose());
    list.push_back(to_json(d));
  }
  const std::string why = reason(wanted, devices.size());
  text += fmt::format(
      "* is what commands use: {}. Choose another with --device or QJULIA_DEVICE.\n"
      "'qjulia doctor' checks that it computes what it should.",
      why);
  session.console.result(text, {{"devices", list},
                                {"chosen", fmt::format("{}:{}", chosen.platform, chosen.index)},
                                {"why", why}});
  return kDone;
}

}  // namespace

void add_devices(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"devices", "List the OpenCL devices that can compute", R"(Examples:
  qjulia devices                  every device; the one commands use has a star
  qjulia devices --device cpu     would this choose the right one?
'qjulia doctor' checks a device; docs/guide/devices.md says what is known of each platform.
Exit code 3 means that there is no device, or none of that name. On a machine without a
GPU, 'apt-get install pocl-opencl-icd' makes the CPU one.)",
               /*can_trace=*/false},
              add_device, run_devices);
}

}  // namespace qjulia::tools

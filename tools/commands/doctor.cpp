/// qjulia doctor: does a device compute what it should?

#include <fmt/format.h>

#include "base/output_file.hpp"
#include "commands/doctor_commands.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "jobs/machine_findings.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

/// Versions, and what in the environment changes what a driver does.
std::string about_driver(const DriverFacts& facts) {
  std::string text = fmt::format("versions: {}\n", facts.platform_version);
  if (!facts.extra_build_flags.empty()) {
    text +=
        fmt::format("flags:    PoCL adds {} to those of every program\n", facts.extra_build_flags);
  }
  for (const auto& [name, value] : facts.environment) {
    text += fmt::format("variable: {}={}\n", name, value);
  }
  return text;
}

std::string about_device(const Device& device) {
  const DeviceInfo& info = device.info();
  std::string text = fmt::format(
      "{}\n"
      "device:   {} by {}\n"
      "platform: {}, driver {}, {}\n"
      "limits:   {} compute units, groups of up to {}, {} KiB local memory, buffers up to {} MiB, "
      "{}\n",
      program_name(), describe(info), info.vendor, info.platform_name, info.driver_version,
      info.opencl_version, info.compute_units, info.largest_work_group, info.local_memory / 1024,
      info.largest_allocation >> 20,
      info.has_double ? "single and double precision" : "single precision only");
  for (const Precision precision : kPrecisions) {
    if (precision == Precision::dbl && !info.has_double) continue;
    const Tuning& tuning = device.tuning(precision);
    text += fmt::format("layout:   {}, {}: lane width {}, groups of {} sum together{}\n",
                        to_string(device.layout()), to_string(precision), tuning.lane_width,
                        tuning.orbit_group, device.is_tuned(precision) ? " (tuned)" : "");
  }
  return text;
}

/// What can be said where there is no device to check. The error itself is for standard error.
void tell_without_device(const NoDeviceError& error, Session& session) {
  const auto findings = machine_findings();
  session.console.result(program_name() + "\nno device can be checked\n" + findings_text(findings),
                         {{"program", program_name()},
                          {"device", nullptr},
                          {"passed", false},
                          {"problem", message_of(error)},
                          {"findings", to_json(findings)}});
}

}  // namespace

void add_checks(Command command, DoctorArguments& arguments) {
  command.word(
      "--programs", "NAMES", [&arguments](const std::string& text) { arguments.programs = text; },
      "Only programs of these names, with * and ?, several with commas: 'energy.cl,gradient*'");
  command
      .file("--junit", arguments.junit, "FILE.xml",
            "Also write the results as JUnit's XML, which CI services show")
      .offers_files({".xml"});
  command
      .add("--seconds-per-check", &arguments.most_seconds, "S",
           "For tests of a compiler that hangs")
      .range(1, 86400)
      .group("");
  add_device(command, arguments.device);
}

Device device_to_check(const DoctorArguments& arguments, Session& session) {
  std::vector<base::Output> outputs;
  if (!arguments.junit.empty()) outputs.push_back({"--junit", arguments.junit, {".xml"}});
  session.check_outputs({{}, outputs});  // there may be a trace
  try {
    return session.open_device({arguments.device, true});
  } catch (const NoDeviceError& error) {
    tell_without_device(error, session);
    throw;
  }
}

std::string about(const Device& device, const DriverFacts& facts) {
  return about_device(device) + about_driver(facts);
}

void write_junit(const std::string& file, const std::vector<CheckSuite>& suites) {
  if (!file.empty()) base::write_file(file, junit_text(suites));
}

void add_doctor(CommandLine& program, ChosenCommand& chosen) {
  program.add_group({"doctor",
                     "Check that a device computes what it should",
                     R"(Examples:
  qjulia doctor                              the device that commands would use
  qjulia doctor --device gpu                 the GPU that ranks first
  qjulia doctor matrix                       PoCL's settings in turns
  qjulia doctor compare old.json new.json    two drivers' reports
Without the name of a command, 'qjulia doctor' is 'qjulia doctor check'.)",
                     "check",
                     {{"--matrix", "matrix"}}});
  for (const auto add : {add_doctor_check, add_doctor_matrix, add_doctor_compare}) {
    add(program, chosen);
  }
}

}  // namespace qjulia::tools

#pragma once
/// The commands of `qjulia doctor`, and what those that check a device share.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "commands/commands.hpp"
#include "commands/doctor_reports.hpp"
#include "qjulia/device/driver_facts.hpp"

namespace qjulia::tools {

void add_doctor_check(CommandLine& program, ChosenCommand& chosen);
void add_doctor_matrix(CommandLine& program, ChosenCommand& chosen);
void add_doctor_compare(CommandLine& program, ChosenCommand& chosen);

struct DoctorArguments {
  DeviceChoice device;
  int most_seconds = 600;  ///< for one check, whose compiler may hang
  std::string programs;    ///< patterns with commas between them; empty: all
  std::string junit;       ///< file; empty: none
};

/// The options of what checks a device.
void add_checks(Command command, DoctorArguments& arguments);

/// @throws NoDeviceError, after the machine's findings are shown
Device device_to_check(const DoctorArguments& arguments, Session& session);

/// The device, its driver and its settings, as text.
std::string about(const Device& device, const DriverFacts& facts);

/// Writes the results as JUnit's XML where a file is named.
void write_junit(const std::string& file, const std::vector<CheckSuite>& suites);

}  // namespace qjulia::tools

#include "console/failure.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/text.hpp"
#include "console/console.hpp"
#include "console/device_obstacles.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

/// The option that sets a field of an options struct: "max_evaluations" is "--max-evaluations".
std::string option_name(std::string field) {
  constexpr std::array<std::pair<const char*, const char*>, 2> kOthers{
      {{"balls", "--ball"}, {"blocks", "--block"}}};
  for (const auto& [name, option] : kOthers) {
    if (field == name) return option;
  }
  std::ranges::replace(field, '_', '-');
  return "--" + field;
}

}  // namespace

std::span<const ExitStatus> exit_statuses() {
  static constexpr std::array kStatuses = {
      ExitStatus{kDone, "done", "Everything was written."},
      ExitStatus{kFailed, "failed",
                 "An output could not be written, the device failed, or a check found something: "
                 "'doctor' a wrong result, 'profile' a slower kernel, 'batch' an entry that is not "
                 "done."},
      ExitStatus{kBadInput, "bad usage or input",
                 "An option, its value or an input file cannot be used; nothing was computed."},
      ExitStatus{kNoDevice, "no usable device", "There is no OpenCL device, or none of that name."},
      ExitStatus{kUndecided, "undecided",
                 "'profile compare' or 'profile against' found no kernel slower and could not "
                 "decide all of them, because the machine was busy or runs differ too much."},
      ExitStatus{kInterrupted, "interrupted",
                 "SIGINT, SIGTERM or SIGHUP came; a fit then saves what it reached."}};
  return kStatuses;
}

int exit_code_of(const std::exception& error) {
  if (dynamic_cast<const InputError*>(&error) != nullptr) return kBadInput;
  if (dynamic_cast<const NoDeviceError*>(&error) != nullptr) return kNoDevice;
  if (dynamic_cast<const Interrupted*>(&error) != nullptr) return kInterrupted;
  return kFailed;
}

std::string message_of(const std::exception& error) {
  if (const auto* option = dynamic_cast<const OptionError*>(&error)) {
    return option_name(option->field()) + ": " + option->problem();
  }
  if (dynamic_cast<const NoDeviceError*>(&error) != nullptr && limit_obstacle() == error.what()) {
    return "no OpenCL device can be used: " + base::message_of(error);
  }
  return base::message_of(error);
}

void say(const std::exception& error) { print_error("qjulia: " + message_of(error) + '\n'); }

}  // namespace qjulia::tools

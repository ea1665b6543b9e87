#pragma once
/// Options that several commands share.

#include <optional>
#include <string>
#include <vector>

#include "console/console.hpp"
#include "describe/command_line.hpp"
#include "qjulia/base/box.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/surface/figures.hpp"

namespace qjulia::tools {

/// --quiet, --verbose, --json.
void add_verbosity(Command command, Verbosity& verbosity);

/// Six numbers: a box's low corner and its high one, which is above it.
Option add_box(Command command, const std::string& name, std::optional<Box>& box,
               const std::string& description);

/// A vector or a point.
Option add_vector(Command command, const std::string& name, std::optional<Eigen::Vector3d>& vector,
                  const std::string& description);

/// A device, and whether it is to be used without a first self-test.
struct TrustedDevice : DeviceChoice {
  bool is_trusted = false;
};

/// --device and --layout.
void add_device(Command command, DeviceChoice& device);
/// The same, and --trust-device, for commands that compute.
void add_device_to_use(Command command, TrustedDevice& device);

/// --trace.
void add_trace(Command command, std::string& file);

/// --profile.
void add_command_profile(Command command, std::string& file);

/// What the help of -o says of a command that names its output after an input.
std::string named_text(const std::string& input, const std::string& extension);

/// "3 loose pieces left out, ..." after what comes before it; empty where none is.
std::string left_out_text(const LoosePieces& loose, const std::string& before = {});

}  // namespace qjulia::tools

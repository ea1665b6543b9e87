#pragma once
/// What `qjulia doctor` says of a machine besides its programs' results.

#include <nlohmann/json.hpp>
#include <vector>

#include "base/surroundings.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/device/driver_facts.hpp"

namespace qjulia::tools {

/// All that applies: base::surroundings, obstacles of device_obstacles.hpp, GPUs that two platforms
/// show.
std::vector<base::Finding> machine_findings();

/// A driver that keeps a core busy while the device is waited for; none where it does not.
std::vector<base::Finding> waiting_findings(const DeviceInfo& device, const WaitTime& waited);

/// What is known of the device's driver, where it matters in its layout.
std::vector<base::Finding> driver_findings(const Device& device, const DriverFacts& facts);

/// An array of objects with "kind", "path" and "text".
nlohmann::json to_json(const std::vector<base::Finding>& findings);

/// A line for each, as people read it.
std::string findings_text(const std::vector<base::Finding>& findings);

}  // namespace qjulia::tools

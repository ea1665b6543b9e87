#pragma once
/// Tuned settings, kept from one run to the next: one file for each device, driver and program.

#include <filesystem>
#include <string>

#include "qjulia/device.hpp"

namespace qjulia {

/// $XDG_CACHE_HOME/qjulia/tuning-KEY.json, with ~/.cache where the variable is not set to a
/// full path. KEY stands for the device, its driver, the program's version and its kernels: what is
/// kept for others is never used.
/// @throws Error when neither XDG_CACHE_HOME nor HOME says where.
std::filesystem::path tuning_file(const DeviceInfo& info);

struct CachedTuning {
  Device device;        ///< with the settings kept for it, if any
  std::string warning;  ///< why the settings kept for it are not used; empty where nothing is wrong
};

/// Looks for settings kept for the device. The environment's QJULIA_TUNING=off says not to look; a
/// layout other than the device's own keeps its defaults.
/// @throws InputError when QJULIA_TUNING is not "on", "off" or empty.
CachedTuning with_cached_tuning(const Device& device);

/// Keeps the device's settings of this precision, and those of the other as they were.
/// @throws OutputError when they cannot be written.
void save_tuning(const Device& device, Precision precision);

}  // namespace qjulia

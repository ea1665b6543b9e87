#pragma once
/// Tuned settings, kept from one run to the next: one file for each device, driver and program.

#include <filesystem>
#include <string>

#include "qjulia/device/device.hpp"

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

/// Settings as a file that other machines can use: the device, its driver and compute units, and
/// the settings of both precisions. @throws OutputError
void export_tuning(const Device& device, const std::filesystem::path& path);

/// Keeps the settings of such a file for this device. @return the device with them.
/// @throws InputError when it is no such file, or one of another device.
Device import_tuning(const Device& device, const std::filesystem::path& path);

/// The settings that the table of known devices has for this one, of each precision: the device's
/// own settings where it has none. A device that nobody has tuned here starts from them
/// (`with_cached_tuning`).
Device with_known_tuning(const Device& device);

/// Keeps the device's settings of this precision, and those of the other as they were.
/// @throws OutputError when they cannot be written.
void save_tuning(const Device& device, Precision precision);

}  // namespace qjulia

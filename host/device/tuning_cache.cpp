#include "qjulia/device/tuning_cache.hpp"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "base/text.hpp"
#include "device/cache_folder.hpp"
#include "device/known_devices.hpp"
#include "device/program_source.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"

namespace qjulia {
namespace {

using nlohmann::json;

constexpr const char* kTuningFormat = "qjulia-tuning";
constexpr const char* kSharedFormat = "qjulia-shared-tuning";
constexpr int kVersion = 1;

/// What the settings are good for.
json owner(const DeviceInfo& info) {
  return {{"device", info.name},           {"platform", info.platform_name},
          {"driver", info.driver_version}, {"compute_units", info.compute_units},
          {"program", version()},          {"kernels", device::kernels_hash()}};
}

std::string text_of(const json& value, int indent) {
  return value.dump(indent, ' ', true, json::error_handler_t::replace);
}

/// What the environment's QJULIA_TUNING says. @throws InputError
bool is_wanted() {
  return device::environment_word("QJULIA_TUNING", {"on", "off"},
                                  "on, to use the settings that were tuned, or off") == "on";
}

/// The settings in a file. @throws InputError saying what is wrong with it.
std::map<Precision, Tuning> read_tunings(const std::filesystem::path& path,
                                         const DeviceInfo& info) {
  constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 20;
  const json kept = json::parse(base::read_text_file(path, "tuning", kLargestFile), nullptr, false);
  if (!kept.is_object() || kept.value("format", json()) != kTuningFormat ||
      kept.value("version", json()) != kVersion) {
    throw InputError("it is not a file of tuned settings");
  }
  if (kept.value("owner", json()) != owner(info)) {
    throw InputError("it is of another device, driver or program");
  }
  std::map<Precision, Tuning> tunings;
  for (const Precision precision : kPrecisions) {
    const auto found = kept.find(to_string(precision));
    if (found != kept.end()) tunings[precision] = tuning_from(*found);
  }
  return tunings;
}

/// Whether an entry of the table, or an exported file, is of this device: its name, platform and
/// number of compute units. Drivers change more often than what is fastest.
bool is_of(const json& entry, const DeviceInfo& info) {
  return entry.is_object() && entry.value("device", json()) == info.name &&
         entry.value("platform", json()) == info.platform_name &&
         entry.value("compute_units", json()) == info.compute_units;
}

}  // namespace

std::filesystem::path tuning_file(const DeviceInfo& info) {
  base::FnvHash hash;
  hash.add(text_of(owner(info), -1));
  return device::cache_folder() / fmt::format("tuning-{}.json", hash.text());
}

CachedTuning with_cached_tuning(const Device& device) {
  CachedTuning kept{device, {}};
  if (!is_wanted()) return kept;
  // What is kept goes with the device's own layout; another is asked for with its defaults.
  if (!device.has_own_layout()) return kept;
  std::filesystem::path path;
  try {
    path = tuning_file(device.info());
  } catch (const Error&) {
    // There is no place where anything could have been kept.
    return {with_known_tuning(device), {}};
  }
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return {with_known_tuning(device), {}};
  try {
    for (const auto& [precision, tuning] : read_tunings(path, device.info())) {
      kept.device = kept.device.with_tuning(precision, tuning);
    }
  } catch (const InputError& error) {
    kept = {device, fmt::format("the tuned settings in '{}' are not used: {}; tune this device "
                                "again, or remove the file",
                                path.string(), error.what())};
  }
  return kept;
}

void export_tuning(const Device& device, const std::filesystem::path& path) {
  const DeviceInfo& info = device.info();
  json file{{"format", kSharedFormat},       {"version", kVersion},
            {"device", info.name},           {"platform", info.platform_name},
            {"driver", info.driver_version}, {"compute_units", info.compute_units},
            {"program", version()}};
  for (const Precision precision : kPrecisions) {
    file[to_string(precision)] = to_json(device.tuning(precision));
  }
  base::write_file(path, text_of(file, 2) + "\n");
}

Device import_tuning(const Device& device, const std::filesystem::path& path) {
  constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 20;
  const json file = json::parse(base::read_text_file(path, "tuning", kLargestFile), nullptr, false);
  if (!file.is_object() || file.value("format", json()) != kSharedFormat ||
      file.value("version", json()) != kVersion) {
    throw InputError(fmt::format("'{}' is not a file of exported settings", path.string()));
  }
  if (!is_of(file, device.info())) {
    throw InputError(fmt::format("'{}' has settings of {}, not of '{}'", path.string(),
                                 file.value("device", json()).dump(), device.info().name));
  }
  Device tuned = device;
  std::vector<Precision> imported;
  for (const Precision precision : kPrecisions) {
    const auto found = file.find(to_string(precision));
    if (found == file.end()) continue;
    tuned = tuned.with_tuning(precision, tuning_from(*found));
    imported.push_back(precision);
  }
  if (imported.empty()) {
    throw InputError(fmt::format("'{}' has no settings", path.string()));
  }
  for (const Precision precision : imported) save_tuning(tuned, precision);
  return tuned;
}

Device device::with_table(const Device& device, std::string_view table) {
  Device known = device;
  for (const json& entry : json::parse(table)) {
    if (!is_of(entry, device.info())) continue;
    for (const Precision precision : kPrecisions) {
      const auto found = entry.find(to_string(precision));
      if (found != entry.end()) known = known.with_tuning(precision, tuning_from(*found));
    }
  }
  return known;
}

Device with_known_tuning(const Device& device) {
  if (!device.has_own_layout()) return device;
  Device known = device;
  for (const auto& [path, text] : device::known_devices()) known = device::with_table(known, text);
  return known;
}

void save_tuning(const Device& device, Precision precision) {
  const std::filesystem::path path = tuning_file(device.info());
  std::error_code failed;
  std::filesystem::create_directories(path.parent_path(), failed);
  std::map<Precision, Tuning> tunings;
  try {
    tunings = read_tunings(path, device.info());
  } catch (const InputError&) {
    // Nothing there, or nothing of use: it is replaced.
  }
  tunings[precision] = device.tuning(precision);
  json file{{"format", kTuningFormat}, {"version", kVersion}, {"owner", owner(device.info())}};
  for (const auto& [kept, tuning] : tunings) file[to_string(kept)] = to_json(tuning);
  base::write_file(path, text_of(file, 2) + "\n");
}

}  // namespace qjulia

#include "qjulia/tuning_cache.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "base/fnv_hash.hpp"
#include "base/input_file.hpp"
#include "base/output_file.hpp"
#include "device/program_source.hpp"
#include "qjulia/error.hpp"
#include "qjulia/version.hpp"

namespace qjulia {
namespace {

using nlohmann::json;

constexpr const char* kFormat = "qjulia-tuning";
constexpr int kVersion = 1;

std::string kernels_hash() {
  base::FnvHash hash;
  for (const auto& [path, text] : device::embedded_kernels()) {
    hash.add(path);
    hash.add(text);
  }
  return hash.text();
}

/// What the settings are good for.
json owner(const DeviceInfo& info) {
  return {{"device", info.name},           {"platform", info.platform_name},
          {"driver", info.driver_version}, {"compute_units", info.compute_units},
          {"program", version()},          {"kernels", kernels_hash()}};
}

std::string owner_hash(const DeviceInfo& info) {
  base::FnvHash hash;
  hash.add(owner(info).dump(-1, ' ', true, json::error_handler_t::replace));
  return hash.text();
}

std::filesystem::path cache_folder() {
  // A relative path is to be ignored: XDG Base Directory Specification 0.8.
  if (const char* cache = std::getenv("XDG_CACHE_HOME");
      cache != nullptr && std::filesystem::path(cache).is_absolute()) {
    return cache;
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return std::filesystem::path(home) / ".cache";
  }
  throw Error("neither XDG_CACHE_HOME nor HOME says where tuned settings are kept; set one");
}

/// The settings in a file, by entry. @throws InputError saying what is wrong with it.
json read_entries(const std::filesystem::path& path, const DeviceInfo& info) {
  constexpr std::uint64_t kLargestFile = std::uint64_t{1} << 20;
  const json kept = json::parse(base::read_text_file(path, "tuning", kLargestFile), nullptr, false);
  if (!kept.is_object() || kept.value("format", json()) != kFormat ||
      kept.value("version", json()) != kVersion) {
    throw InputError("it is not a file of tuned settings");
  }
  if (kept.value("owner", json()) != owner(info)) {
    throw InputError("it is of another device, driver or program");
  }
  json entries = json::object();
  for (const Precision precision : kPrecisions) {
    const char* const name = to_string(precision);
    if (const auto found = kept.find(name); found != kept.end()) {
      entries[name] = to_json(tuning_from(*found));
    }
  }
  return entries;
}

}  // namespace

std::filesystem::path tuning_file(const DeviceInfo& info) {
  return cache_folder() / "qjulia" / fmt::format("tuning-{}.json", owner_hash(info));
}

CachedTuning with_cached_tuning(const Device& device) {
  CachedTuning kept{device, {}};
  const char* wanted = std::getenv("QJULIA_TUNING");
  if (wanted != nullptr && std::string(wanted) == "off") return kept;
  // What is kept goes with the device's own layout; another is asked for with its defaults.
  if (!device.has_own_layout()) return kept;
  std::filesystem::path path;
  try {
    path = tuning_file(device.info());
  } catch (const Error&) {
    return kept;  // there is no place where anything could have been kept
  }
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return kept;
  try {
    const json entries = read_entries(path, device.info());
    for (const Precision precision : kPrecisions) {
      if (const char* const name = to_string(precision); entries.contains(name)) {
        kept.device = kept.device.with_tuning(precision, tuning_from(entries[name]));
      }
    }
  } catch (const InputError& error) {
    kept = {device, fmt::format("the tuned settings in '{}' are not used: {}; tune this device "
                                "again, or remove the file",
                                path.string(), error.what())};
  }
  return kept;
}

void save_tuning(const Device& device, Precision precision) {
  const std::filesystem::path path = tuning_file(device.info());
  std::error_code failed;
  std::filesystem::create_directories(path.parent_path(), failed);
  json file = json::object();
  try {
    file = read_entries(path, device.info());
  } catch (const InputError&) {
    // Nothing there, or nothing of use: it is replaced.
    file = json::object();
  }
  file["format"] = kFormat;
  file["version"] = kVersion;
  file["owner"] = owner(device.info());
  file[to_string(precision)] = to_json(device.tuning(precision));
  base::write_file(path, file.dump(2, ' ', true, json::error_handler_t::replace) + "\n");
}

}  // namespace qjulia

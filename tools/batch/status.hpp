#pragma once
/// The files in which a batch's folder tells where it stands.

#include <filesystem>
#include <optional>
#include <string>

#include "batch/batch.hpp"

namespace qjulia::batch {

std::filesystem::path status_path(const std::filesystem::path& folder, const std::string& name);

/// Nothing when there is none, or none that can be read.
std::optional<EntryStatus> read_status(const std::filesystem::path& folder,
                                       const std::string& name);

/// On a full disk an entry's last status overwrites its first. @throws OutputError
void write_status(const std::filesystem::path& folder, const EntryStatus& status);

/// batch.json: which entries there are, and their settings. @throws OutputError
void write_index(const Manifest& manifest, const BatchOptions& options);

/// What `EntryStatus::settings` holds for an entry. @throws what `options.settings` throws
nlohmann::json settings_of(const BatchEntry& entry, const BatchOptions& options);

/// File names need not be UTF-8. @throws OutputError
void write_json(const std::filesystem::path& file, const nlohmann::json& object);

/// Now, in UTC, as ISO 8601.
std::string time_stamp();

}  // namespace qjulia::batch

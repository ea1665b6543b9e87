#pragma once
/// The commands of `qjulia batch`, and what several of them do.

#include <filesystem>
#include <stop_token>
#include <string>

#include "batch/batch.hpp"
#include "commands/commands.hpp"

namespace qjulia::tools {

void add_batch_run(CommandLine& program, ChosenCommand& chosen);
void add_batch_status(CommandLine& program, ChosenCommand& chosen);
void add_batch_merge(CommandLine& program, ChosenCommand& chosen);
void add_batch_check(CommandLine& program, ChosenCommand& chosen);

/// MANIFEST.
void add_manifest(Command command, std::string& file);

/// The job that makes a file of an entry's map. @throws InputError where it names another map
Job entry_job(const batch::EntryJob& job, const std::filesystem::path& map);

/// @param may_miss_meshes meshes of entries that are done need not be there any more.
/// @throws InputError
batch::Manifest read_manifest(const std::string& file, bool may_miss_meshes,
                              const std::stop_token& stop);

}  // namespace qjulia::tools

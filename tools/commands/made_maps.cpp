#include "commands/made_maps.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string_view>
#include <thread>
#include <utility>

#include "base/output_file.hpp"
#include "batch/folder_lock.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/map_file.hpp"

namespace qjulia::tools {
namespace {

constexpr std::array<std::string_view, 5> kMakeOne{"convert", "fit", "paint", "portals", "shape"};
constexpr std::array<std::string_view, 1> kMakeSeveral{"morph"};

constexpr const char* kMapExtension = ".qjulia.json";

/// @throws InputError
void expect_maker(const std::string& command, MadeCount count) {
  const auto check = [&](const auto& known) {
    if (std::ranges::find(known, command) != known.end()) return;
    throw InputError(fmt::format("'{}' makes no {}; give {}", command,
                                 count == MadeCount::one ? "map" : "folder of maps",
                                 fmt::join(known, ", ")));
  };
  if (count == MadeCount::one) {
    check(kMakeOne);
  } else {
    check(kMakeSeveral);
  }
}

nlohmann::json value_in(const toml::node& node) {
  std::ostringstream json;
  json << toml::json_formatter(toml::table{{"value", node}});
  return nlohmann::json::parse(json.str())["value"];
}

/// What names a job's map: its command, options, files and the program's version.
/// @param made options whose files have such names themselves.
std::string key_of_made(const Job& job, const std::string& output,
                        const std::vector<std::string>& made) {
  Job kept = JobRun(job, output).kept();
  for (const std::string& name : made) kept.inputs.erase(name);
  kept.hash_inputs();
  return text_hash(to_json(kept).dump());
}

/// Held while maps are made in the folder. Waits for another process that has it.
batch::FolderLock locked_folder(const std::filesystem::path& folder, Session& session) {
  constexpr std::chrono::milliseconds kBetweenLooks{200};
  if (batch::is_locked(folder)) {
    session.console.note(
        fmt::format("another process makes maps in '{}'; waiting for it", folder.string()));
  }
  while (true) {
    while (batch::is_locked(folder)) {
      throw_if_stopped(session.stop());
      std::this_thread::sleep_for(kBetweenLooks);
    }
    try {
      return batch::FolderLock(folder);
    } catch (const Error&) {
      if (!batch::is_locked(folder)) throw;  // else another one that waited has it now
    }
  }
}

constexpr const char* kUnfinished = "unfinished-";

/// Of commands that were stopped, with their checkpoints.
void remove_unfinished(const std::filesystem::path& folder) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (!entry.path().filename().string().starts_with(kUnfinished)) continue;
    std::filesystem::remove_all(entry.path(), ignored);
  }
}

void make_map(const MadeMap& made, const Device& device, Session& session) {
  const std::filesystem::path unfinished =
      made.output.parent_path() / (kUnfinished + made.output.filename().string());
  session.console.note(
      fmt::format("making {} by 'qjulia {}'", made.output.string(), made.job.command));
  const Said said =
      run_job(made.job, unfinished.string(), {.device = device, .monitor = session.monitor()});
  for (const std::string& warning : said.warnings) session.console.warn(warning);
  if (std::filesystem::is_regular_file(unfinished)) {
    // The same bytes whenever it is made, so that pictures of it are this film's.
    Map map = read_map(unfinished);
    map.provenance = without_times(map.provenance.json());
    write_map(map, unfinished);
  }
  std::filesystem::rename(unfinished, made.output);
}

}  // namespace

bool MadeMap::exists() const {
  std::error_code ignored;
  return std::filesystem::exists(output, ignored);
}

MadeMapReader::MadeMapReader(const std::filesystem::path& script, std::filesystem::path folder,
                             std::vector<std::string>& problems)
    : script_(script), folder_(std::move(folder)), problems_(problems) {}

void MadeMapReader::tell(const toml::node& where, const std::string& name,
                         const std::string& problem) {
  problems_.push_back(
      fmt::format("{}:{}: {}: {}", script_.string(), where.source().begin.line, name, problem));
}

std::optional<std::filesystem::path> MadeMapReader::read(const toml::table& table,
                                                         const std::string& name, MadeCount count) {
  const std::size_t before = problems_.size();
  const auto attempt = [&](const toml::node& where, const std::string& key, const auto& call) {
    try {
      call();
    } catch (const InputError& error) {
      tell(where, key, error.what());
    }
  };
  MadeMap made;
  made.job.command = table["command"].value_or(std::string());
  attempt(table, name, [&] {
    if (made.job.command.empty()) {
      throw InputError(
          "give the name of a map's file, or a table with the `command` that makes it");
    }
    expect_maker(made.job.command, count);
  });
  if (problems_.size() > before) return std::nullopt;
  const CommandUsage usage = command_usage(made.job.command);
  std::vector<std::string> own;  // options whose maps are made, too
  for (auto&& [key, node] : table) {
    const std::string option(key.str());
    if (option == "command") continue;
    const std::string path = fmt::format("{}.{}", name, option);
    if (const auto* const nested = node.as_table()) {
      if (const auto file = read(*nested, path, MadeCount::one)) {
        made.job.options[option] = file->string();
        own.push_back(option);
      }
      continue;
    }
    attempt(node, path, [&, &value = node] {
      nlohmann::json given{{option, value_in(value)}};
      if (option_named(usage, option).is_output) {
        throw InputError("the film names what is made; leave it out");
      }
      find_files(given, usage, script_.parent_path());
      made.job.options.update(given);
    });
  }
  if (problems_.size() > before) return std::nullopt;
  attempt(table, name, [&] {
    const bool is_one = count == MadeCount::one;
    const std::string any = is_one ? fmt::format("map{}", kMapExtension) : "maps";
    const JobRun run(made.job, any);
    static_cast<void>(run.plan());
    for (const auto& [option, input] : run.kept().inputs) {
      if (std::ranges::find(own, option) == own.end()) {
        made.read[fmt::format("{}.{}", name, option)] = input.path;
      }
    }
    made.output =
        folder_ / fmt::format("{}-{}{}", made.job.command, key_of_made(made.job, any, own),
                              is_one ? kMapExtension : "");
  });
  if (problems_.size() > before) return std::nullopt;
  maps_.push_back(std::move(made));
  return maps_.back().output;
}

void make_maps(const std::vector<MadeMap>& maps, const Device& device, Session& session) {
  if (std::ranges::all_of(maps, &MadeMap::exists)) return;
  const std::filesystem::path folder = maps.front().output.parent_path();
  base::make_folder(folder);
  const batch::FolderLock lock = locked_folder(folder, session);
  remove_unfinished(folder);
  for (const MadeMap& made : maps) {
    if (!made.exists()) make_map(made, device, session);
  }
}

}  // namespace qjulia::tools

#pragma once
/// A command as data. What a command writes holds its job, from which `qjulia run` makes it again.

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "describe/usage.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::tools {

struct Job {
  /// A file that a command reads.
  struct Input {
    std::filesystem::path path;  ///< where it lies; empty: it is yet to be found
    std::string hash;            ///< of its bytes, as `file_hash` gives it; empty: not known
  };

  std::string command;  ///< "render"
  /// What was given, by name, such as "look_at": a number, a text, true, an array of them, or an
  /// array of arrays where an option was given several times. An option of one word may be an array
  /// as well: commas stand between its parts on the command line. Files are called by their names,
  /// without folders.
  nlohmann::json options = nlohmann::json::object();
  std::map<std::string, Input> inputs{};  ///< by the option's name
  std::string version{};                  ///< of the program; empty: this one's
  nlohmann::json device{};                ///< that computed; null: none did

  /// Computes the hashes of inputs that are there and have none.
  void hash_inputs();
};

/// The name of an option in jobs: "look_at" of "--look-at", "map" of "MAP".
std::string job_name(const std::string& option);

/// Makes absolute paths of the files that options name, which are looked for in `folder`.
/// @throws InputError for one that is not there
void find_files(nlohmann::json& options, const CommandUsage& usage,
                const std::filesystem::path& folder);

/// Gives a job's options the values by which `is` differs from `was`, both as tables of settings
/// give them. A null removes the option; a changed boolean becomes its flag, `name` or `no_name`.
void set_changes(nlohmann::json& options, const nlohmann::json& was, const nlohmann::json& is);

/// What a user gave for an option. A word becomes a number if `are_numbers`, or if JSON writes that
/// number exactly as the word ("5", not "05"); otherwise it stays a string.
nlohmann::json job_value(const std::vector<std::string>& words, bool are_numbers);

nlohmann::json to_json(const Job& job);
/// @param source what messages call it, such as the file's name. @throws InputError naming the
/// member that is missing, not known or of the wrong type.
Job job_from_json(const nlohmann::json& json, const std::string& source);

/// What names the file that the command makes; null where nothing does.
const OptionUsage* output_of(const CommandUsage& usage);

/// The arguments of the command line that runs the job, its own name first.
/// @param output the file to make; empty: the command names it.
/// @throws InputError naming an option that the command does not have.
std::vector<std::string> words_of(const Job& job, const CommandUsage& usage,
                                  const std::string& output = {});

/// The command as a user types it, in one line; empty where a name would do something to a
/// terminal.
std::string command_text(const Job& job, const CommandUsage& usage);

/// The option of this name in jobs. @throws InputError that lists the names.
const OptionUsage& option_named(const CommandUsage& usage, const std::string& name);

/// Adds the job to those that have made the map, the last of which is the one to run again.
void add_job(Map& map, const Job& job);
/// The last job that has made the map. @throws InputError where it does not say.
nlohmann::json last_job(const Map& map, const std::string& file);

}  // namespace qjulia::tools

#pragma once
/// Maps that a film's script has made before anything is drawn.

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/toml.hpp"
#include "jobs/job_run.hpp"

namespace qjulia::tools {

struct MadeMap {
  Job job;                                              ///< its files by absolute paths
  std::filesystem::path output;                         ///< the map, or the folder of maps
  std::map<std::string, std::filesystem::path> read{};  ///< files, by names such as "maps.to.mesh"

  bool exists() const;
};

/// How many maps a table of a script makes.
enum class MadeCount { one, several };

/// What a script's table makes: `command` and its options. A table in place of a map's file makes
/// that map first.
class MadeMapReader {
 public:
  /// @param folder that holds the maps; their names hold the key of their job, so that a map that
  /// is there is the one that is wanted. @param problems gets what is wrong, each with its line
  MadeMapReader(const std::filesystem::path& script, std::filesystem::path folder,
                std::vector<std::string>& problems);

  /// @param name of the table, such as "maps". @return where the maps will be; none where something
  /// is wrong
  std::optional<std::filesystem::path> read(const toml::table& table, const std::string& name,
                                            MadeCount count);
  /// In the order in which they can be made.
  const std::vector<MadeMap>& maps() const { return maps_; }

 private:
  void tell(const toml::node& where, const std::string& name, const std::string& problem);

  std::filesystem::path script_, folder_;
  std::vector<std::string>& problems_;
  std::vector<MadeMap> maps_;
};

/// Makes what is not there yet, into names that hold no half-made map. Commands that make maps into
/// one folder wait for each other.
void make_maps(const std::vector<MadeMap>& maps, const Device& device, Session& session);

}  // namespace qjulia::tools

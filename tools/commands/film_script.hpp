#pragma once
/// What happens in a film: options that hold, and keys of settings that move.

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "commands/made_maps.hpp"
#include "describe/view_options.hpp"
#include "film/dive.hpp"
#include "film/track.hpp"
#include "jobs/command.hpp"

namespace qjulia::tools {

/// Where a script is, and what a command asks of it.
struct ScriptPlace {
  std::filesystem::path file;
  double seconds = 0;  ///< the film's length, to which all keys are stretched; 0: the script's
  std::filesystem::path made{};  ///< the folder for maps that the script has made first
};

struct FilmScript {
  ScriptPlace place;
  std::string input;              ///< the file of the map or mesh; of several maps, the first
  std::vector<std::string> maps;  ///< that the film shows one after the other; empty: `input` alone
  std::vector<MadeMap> made;      ///< maps that are to be made first, in this order
  std::string keys;               ///< the table of keys; empty: there is none
  double width = 0;               ///< about what a zoom of 1 shows, shape units; 0: no key needs it
  double seconds = 0;
  double rate = 25;                                   ///< pictures a second
  nlohmann::json options = nlohmann::json::object();  ///< of `render`, for the whole film
  std::map<std::string, film::Track> tracks;          ///< by the names of moving settings
  /// How far along `maps` the film is, 0 at the first and 1 at the last; none: as far as in time.
  std::optional<film::Track> along_maps;
  std::optional<film::Dive> dive;  ///< moves the camera, once in the film
  double shutter =
      0;           ///< share of a picture's time in which the camera is seen moving; 0: it is not
  int copies = 1;  ///< how often a film shows its pictures: so many copies deep it dives

  /// Whether all maps are there. If not, `maps` and `dive` are yet empty.
  bool has_maps() const;
  std::size_t pictures() const;
  /// Seconds: where picture number i is in its middle, and how long its shutter is open.
  double middle_of(std::size_t i) const { return (static_cast<double>(i) + 0.5 * shutter) / rate; }
  /// Which of `maps` a picture shows.
  std::size_t map_of(std::size_t picture) const;
  /// The files that the script names, by what a job calls them.
  std::map<std::string, std::filesystem::path> files() const;
  /// What holds for all pictures. @throws InputError naming the option
  View base() const;
  /// The view of each picture; and of a dive the view at its end, which looks like the first.
  /// @throws InputError naming each setting that goes wrong, the key that it goes on from, and when
  std::vector<View> views(const View& base) const;
  /// The camera of a picture while the shutter is open, as `Studio::picture` takes it; empty where
  /// it does not move. `views` has the middle of that time.
  /// @param drawn the camera's place in the middle, where the script does not say it.
  std::vector<Camera> moving(const View& base, std::size_t picture, const Camera& drawn) const;
};

/// Reads a script (docs/guide/films.md). Files are looked for in its folder.
/// @throws InputError naming file, line and what to do
FilmScript read_film_script(const ScriptPlace& place);

/// The script with its maps, made by this call where they are not there.
FilmScript with_maps(const FilmScript& script, const Device& device, Session& session);

/// The script of a command that writes one file of it.
struct ScriptPlan : Plan {
  FilmScript script;
};
ScriptPlan script_plan(const std::string& file, double seconds, base::Output output);

/// The folder for a script's maps, beside a command's output.
std::filesystem::path made_folder(const std::filesystem::path& script,
                                  const std::filesystem::path& output);

}  // namespace qjulia::tools

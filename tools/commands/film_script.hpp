#pragma once
/// What happens in a film: options that hold, and keys of settings that move.

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "describe/view_options.hpp"
#include "film/dive.hpp"
#include "film/track.hpp"
#include "jobs/command.hpp"

namespace qjulia::tools {

struct FilmScript {
  std::string input;              ///< the file of the map or mesh; of several maps, the first
  std::vector<std::string> maps;  ///< that the film shows one after the other; empty: `input` alone
  std::string keys;               ///< the table of keys; empty: there is none
  double width = 0;               ///< about what a zoom of 1 shows, shape units; 0: no key needs it
  double seconds = 0;
  double rate = 25;                                   ///< pictures a second
  nlohmann::json options = nlohmann::json::object();  ///< of `render`, for the whole film
  std::map<std::string, film::Track> tracks;          ///< by the names of moving settings
  std::optional<film::Dive> dive;                     ///< moves the camera, once in the film
  double shutter =
      0;           ///< share of a picture's time in which the camera is seen moving; 0: it is not
  int copies = 1;  ///< how often a film shows its pictures: so many copies deep it dives

  std::size_t pictures() const;
  /// Seconds: where picture number i is in its middle, and how long its shutter is open.
  double middle_of(std::size_t i) const { return (static_cast<double>(i) + 0.5 * shutter) / rate; }
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
/// @param seconds the film's length in place of the script's, to which all keys are stretched; 0:
///   the script's. @throws InputError naming file, line and what to do
FilmScript read_film_script(const std::filesystem::path& file, double seconds);

/// The script of a command that writes one file of it.
struct ScriptPlan : Plan {
  FilmScript script;
};
ScriptPlan script_plan(const std::string& file, double seconds, base::Output output);

}  // namespace qjulia::tools

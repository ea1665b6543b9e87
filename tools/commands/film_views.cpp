/// What a film shows at which time.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/film_script.hpp"
#include "describe/moving_settings.hpp"
#include "describe/provenance.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::tools {

bool FilmScript::has_maps() const { return std::ranges::all_of(made, &MadeMap::exists); }

std::size_t FilmScript::pictures() const {
  return static_cast<std::size_t>(std::max(1.0, std::round(seconds * rate)));
}

std::map<std::string, std::filesystem::path> FilmScript::files() const {
  std::map<std::string, std::filesystem::path> all;
  if (made.empty()) all["map"] = input;
  for (const MadeMap& map : made) all.insert(map.read.begin(), map.read.end());
  if (!keys.empty()) all["keys"] = keys;
  return all;
}

View FilmScript::base() const {
  CommandLine program(kProgramDescription, "qjulia");
  const Command command = program.add_command("render", "");
  ViewArguments arguments;
  add_view(command, arguments);
  const Job job{.command = "render", .options = options};
  program.parse(words_of(job, program.usage().commands.front()));
  return checked_view(arguments, input);
}

namespace {

/// The view at that time. @param problems gets those of settings by their names, the first of each.
View view_at(const FilmScript& script, const View& base, double time,
             std::map<std::string, std::string>& problems) {
  const auto& tracks = script.tracks;
  const auto zoom = tracks.find("zoom"), look_at = tracks.find("look-at");
  std::optional<film::Gaze> gaze;
  if (script.width > 0 && zoom != tracks.end() && look_at != tracks.end()) {
    gaze = film::Track::gaze(time, look_at->second, zoom->second, script.width);
  }
  const auto value_of = [&](const std::string& name, const film::Track& track) {
    if (gaze && name == "zoom") return std::vector{gaze->zoom};
    if (gaze && name == "look-at") return gaze->look_at;
    const bool zooms = name == "look-at" && zoom != tracks.end();
    return zooms ? track.at(time, zoom->second) : track.at(time);
  };
  View view = base;
  for (const auto& [name, track] : tracks) {
    const View before = view;
    try {
      moving_settings().at(name).set(value_of(name, track), view);
      view.map_options.knobs.validate();
      view.picture.validate();
    } catch (const InputError& error) {
      problems.emplace(name, fmt::format("{}: {} at {:.4g} seconds: {}", track.place(time), name,
                                         time, error.what()));
      view = before;
    }
  }
  if (script.dive) {
    PictureOptions& picture = view.picture;
    const double aspect = static_cast<double>(picture.width) / picture.height;
    // Keys of zoom and field of view show more or less from the same place.
    Camera placed = picture.camera;
    placed.zoom = base.picture.camera.zoom;
    placed.field_of_view = base.picture.camera.field_of_view;
    placed = script.dive->placed(placed, aspect);
    placed.zoom = picture.camera.zoom;
    placed.field_of_view = picture.camera.field_of_view;
    // The whole way in whole pictures, however long the film is to be.
    picture.camera =
        script.dive->moved(placed, time * script.rate / static_cast<double>(script.pictures()));
  }
  return view;
}

/// What of a view the set depends on, by the names of keys.
nlohmann::json set_of(const View& view) {
  nlohmann::json set = to_json(view.map_options);
  set["iterations"] = view.picture.iterations;
  return set;
}

/// Parts of one set are not those of another: where they fly while a knob moves, they would jump.
/// Nor is a mesh of parts cut.
/// @param problems gets what moves, by its name
void expect_still_set(const FilmScript& script, const std::vector<View>& views,
                      std::map<std::string, std::string>& problems) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (!views[i].scatter.field) continue;
    if (!views[i].picture.cuts.empty()) {
      for (const auto& [name, track] : script.tracks) {
        if (!name.starts_with("cut-")) continue;
        const double time = script.middle_of(i);
        problems.emplace(name, fmt::format("{}: {} cuts parts that fly; leave it or scatter out",
                                           track.place(time), name));
      }
    }
    if (i == 0 || views[i - 1].scatter.time == 0) continue;
    const nlohmann::json before = set_of(views[i - 1]);
    for (const auto& [name, track] : script.tracks) {
      const auto knob = before.find(job_name(moving_settings().at(name).of));
      if (knob == before.end() || *knob == set_of(views[i]).at(knob.key())) continue;
      const double time = script.middle_of(i);
      problems.emplace(
          name, fmt::format("{}: {} moves at {:.4g} seconds, while parts fly, and they would jump; "
                            "let it stand still where scatter-time is above 0",
                            track.place(time), name, time));
    }
  }
}

}  // namespace

std::size_t FilmScript::map_of(std::size_t picture) const {
  if (!along_maps) return picture * maps.size() / pictures();
  const double share = std::clamp(along_maps->at(middle_of(picture)).front(), 0.0, 1.0);
  return static_cast<std::size_t>(std::lround(share * static_cast<double>(maps.size() - 1)));
}

std::vector<View> FilmScript::views(const View& base) const {
  std::vector<View> all;
  std::map<std::string, std::string> problems;
  const std::size_t count = pictures() + (dive ? 1 : 0);
  for (std::size_t i = 0; i < count; ++i) {
    all.push_back(view_at(*this, base, middle_of(i), problems));
    if (!maps.empty()) all.back().map = maps[map_of(i)];
  }
  // Lamps stand where they are in the first picture, unless they are keyed. In a dive they go with
  // the camera.
  const double turn = all.front().picture.camera.azimuth;
  for (View& view : all) {
    std::optional<double>& own = view.picture.light.lamp_turn;
    own = own.value_or(turn) + (dive ? view.picture.camera.azimuth - turn : 0);
  }
  if (problems.empty()) expect_still_set(*this, all, problems);
  if (problems.empty()) return all;
  std::vector<std::string> told;
  told.reserve(problems.size());
  for (const auto& [name, problem] : problems) told.push_back(problem);
  throw InputError(fmt::format("{}", fmt::join(told, "\n")));
}

std::vector<Camera> FilmScript::moving(const View& base, std::size_t picture,
                                       const Camera& drawn) const {
  constexpr int kMoments = 64;
  if (shutter == 0) return {};
  std::vector<Camera> cameras;
  nlohmann::json first;
  bool moves = false;
  std::map<std::string, std::string> problems;  // `views` has told them
  for (int i = 0; i < kMoments; ++i) {
    const double way = (i + 0.5) / kMoments - 0.5;
    const View view = view_at(*this, base, middle_of(picture) + way * shutter / rate, problems);
    Camera& camera = cameras.emplace_back(view.picture.camera);
    if (!camera.look_at) camera.look_at = drawn.look_at;
    if (!camera.distance) camera.distance = drawn.distance;
    PictureOptions from_there;
    from_there.camera = camera;
    const nlohmann::json seen = to_json(from_there);
    moves = moves || (i > 0 && seen != first);
    if (i == 0) first = seen;
  }
  return moves ? cameras : std::vector<Camera>{};
}

}  // namespace qjulia::tools

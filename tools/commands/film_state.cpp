#include "commands/film_state.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <utility>

#include "describe/files.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/material_range.hpp"

namespace qjulia::tools {

nlohmann::json state_json(const FilmState& state, const std::string& key) {
  const SeriesFrame& frame = state.frame;
  nlohmann::json cameras = nlohmann::json::array();
  for (const Camera& camera : frame.cameras) {
    const Eigen::Vector3d& at = *camera.look_at;
    cameras.push_back({at.x(), at.y(), at.z(), *camera.distance});
  }
  nlohmann::json json{{"key", key}, {"cameras", cameras}};
  if (frame.range) json["range"] = frame.range->values();
  if (frame.exposure) json["exposure"] = *frame.exposure;
  if (state.seam) json["seam"] = *state.seam;
  return json;
}

std::optional<FilmState> state_from(const nlohmann::json& json, const std::string& key,
                                    const std::vector<View>& views) {
  try {
    if (json.at("key") != key || json.at("cameras").size() != views.size()) return std::nullopt;
    FilmState state;
    SeriesFrame& frame = state.frame;
    for (std::size_t i = 0; i < views.size(); ++i) {
      const auto v = json.at("cameras").at(i).get<std::vector<double>>();
      Camera& camera = frame.cameras.emplace_back(views[i].picture.camera);
      camera.look_at = Eigen::Vector3d(v.at(0), v.at(1), v.at(2));
      camera.distance = v.at(3);
    }
    if (json.contains("range")) {
      std::vector<std::string> words;
      for (const nlohmann::json& number : json["range"]) words.push_back(number.dump());
      frame.range = range_from(fmt::format("{}", fmt::join(words, ",")));
    }
    if (json.contains("exposure")) frame.exposure = json["exposure"].get<double>();
    if (json.contains("seam")) state.seam = json["seam"].get<double>();
    return state;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  } catch (const InputError&) {
    return std::nullopt;
  }
}

std::optional<FilmState> kept_state(const std::filesystem::path& file, const std::string& key,
                                    const std::vector<View>& views) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    return state_from(read_report(file.string(), "the film's state"), key, views);
  } catch (const InputError&) {
    return std::nullopt;
  }
}

void expect_same_film(const std::filesystem::path& state, const std::string& key) {
  std::error_code ignored;
  if (!std::filesystem::exists(state, ignored)) return;
  const nlohmann::json json = read_report(state.string(), "the film's state");
  if (json.is_object() && json.contains("key") && json["key"] == key) return;
  throw InputError(fmt::format(
      "--frames: '{}' has pictures of another script or device, or of an earlier version of this "
      "script, its map or the program; give another folder, or remove that one",
      state.parent_path().string()));
}

}  // namespace qjulia::tools

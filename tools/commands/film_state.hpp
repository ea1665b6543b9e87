#pragma once
/// What all pictures of a film have in common, found before the first one is drawn and kept beside
/// them.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "jobs/picture_series.hpp"

namespace qjulia::tools {

struct FilmState {
  SeriesFrame frame;
  std::optional<double> seam;  ///< of a dive, once it was measured
};

nlohmann::json state_json(const FilmState& state, const std::string& key);
/// None where it is another film's. @param views of the film
std::optional<FilmState> state_from(const nlohmann::json& json, const std::string& key,
                                    const std::vector<View>& views);
/// What an earlier run has found; none where that was of another film.
std::optional<FilmState> kept_state(const std::filesystem::path& file, const std::string& key,
                                    const std::vector<View>& views);

/// Of several commands that draw parts of a film into its folder, each is to draw the same film.
/// @throws InputError where the folder's state is another film's, or cannot be read
void expect_same_film(const std::filesystem::path& state, const std::string& key);

}  // namespace qjulia::tools

#pragma once
/// Draws a film's pictures, each of which is the same whoever draws it.

#include <array>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "commands/film_script.hpp"
#include "commands/film_state.hpp"
#include "jobs/picture_series.hpp"
#include "qjulia/fit/ranks.hpp"

namespace qjulia::tools {

/// The pictures of a film, and which of them a command draws.
struct FilmPictures {
  FilmScript script;
  View base;                        ///< what holds for all pictures
  std::vector<View> views;          ///< of each picture, and of the end of a dive
  std::filesystem::path folder;     ///< of the pictures
  std::size_t count = 0;            ///< of the whole film
  std::size_t first = 0, last = 0;  ///< pictures to draw; last is the one after
  bool is_shared = false;           ///< other commands may draw parts of the film, too

  std::filesystem::path state() const { return folder / "film.json"; }
  bool are_all() const { return last - first == count; }
};

/// How often pictures needed what, for people and programs.
class KeptCounter {
 public:
  void add(std::size_t number, double seconds, const PictureSeries::Picture& made,
           Session& session);
  /// Adds what the other ranks have counted. To be called by all.
  void add_ranks(Ranks& ranks);
  std::size_t count() const;
  /// "112 drawn anew; 1.2 s a picture"; empty where there are none.
  std::string text() const;
  nlohmann::json json() const;

 private:
  std::mutex counting_;
  std::array<std::size_t, 3> counts_{};  ///< by `Kept`
  double seconds_ = 0;                   ///< of all pictures
};

/// A film's pictures while they are drawn.
class FilmDrawing {
 public:
  /// Finds the key of the film.
  FilmDrawing(const FilmPictures& pictures, const Device& device, Session& session);
  FilmDrawing(const FilmDrawing&) = delete;
  FilmDrawing& operator=(const FilmDrawing&) = delete;

  /// Finds which pictures are missing and what all have in common, unless an earlier run has. Of
  /// several ranks the first one's work.
  void look();
  /// The other ranks take over what the first one has found. To be called by all.
  /// @throws InputError where their devices are not of one kind
  void share(Ranks& ranks);
  /// Draws this rank's part of what is missing, `jobs` pictures at a time.
  void draw(int jobs, const Ranks& ranks, KeptCounter& kept);

  std::optional<double> seam() const { return state_ ? state_->seam : std::nullopt; }

 private:
  PictureSeries& add_series(const Device& device);
  void measure_seam(PictureSeries& series);
  void warn_of_longer_film();
  void draw(PictureSeries& series, std::size_t number, KeptCounter& kept,
            const ProgressMonitor& monitor);
  bool is_drawn(std::size_t number) const;

  const FilmPictures& pictures_;
  Device device_;
  Session& session_;
  Job job_;  ///< of one picture, before it is known what all have in common
  std::string key_;
  std::vector<std::size_t> missing_;
  std::optional<FilmState> state_;
  std::optional<Scene> scene_;
  std::vector<std::unique_ptr<PictureSeries>> series_;
};

/// Removes the film's own files, and the folder where nothing else is in it.
void remove_pictures(const FilmPictures& pictures);

}  // namespace qjulia::tools

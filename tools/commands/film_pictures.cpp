#include "commands/film_pictures.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <functional>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>
#include <thread>
#include <utility>

#include "base/output_file.hpp"
#include "describe/files.hpp"
#include "describe/notes.hpp"
#include "describe/provenance.hpp"
#include "film/encoder.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"

namespace qjulia::tools {
namespace {

/// What all pictures of a film depend on: a picture that another run has drawn is this film's where
/// the key is equal.
std::string key_of(const FilmPictures& pictures, const Job& job) {
  nlohmann::json views = nlohmann::json::array();
  for (const View& view : pictures.views) {
    views.push_back({to_json(view.map_options), to_json(view.picture), to_json(view.scatter)});
    if (!view.map.empty()) views.push_back(file_hash(view.map));
  }
  return text_hash(fmt::format("{}{}{}{}", to_json(job).dump(), views.dump(),
                               pictures.script.shutter, version()));
}

/// What a picture's note says of its film.
std::string film_note(const std::string& key, std::size_t number) {
  return fmt::format("{} {}", key, number);
}

/// The job of one picture, before it is known what all have in common.
Job picture_job(const FilmScript& script) {
  Job job{.command = "render", .options = script.options};
  job.options["map"] = script.input;
  // Jobs call files by their names. Those of the options have absolute paths (`find_files`).
  for (auto& [name, value] : job.options.items()) {
    if (!value.is_string()) continue;
    const std::filesystem::path path = value.get<std::string>();
    if (name != "map" && !path.is_absolute()) continue;
    value = name_of(path);
    job.inputs[name].path = path;
  }
  job.hash_inputs();
  return job;
}

const char* word(Kept kept) {
  return kept == Kept::all   ? "drawn with the set and the sky of the one before"
         : kept == Kept::set ? "drawn with the set of the one before"
                             : "drawn anew";
}

void warn_of_seam(double seam, Session& session) {
  constexpr double kSeen = 2;  // of 255
  if (seam < kSeen) return;
  session.console.warn(fmt::format(
      "the first and the last picture differ by {:.2f} of 255, and the dive will show a seam. "
      "Leave out the ground; end all keys as they begin; come nearer with a smaller 'distance', or "
      "look up from below, so that nothing is seen behind the copies",
      seam));
}

/// Calls `draw` with each series in a thread of its own. @throws what the first thread throws
void in_threads(std::size_t count, const std::function<void(std::size_t)>& draw) {
  std::vector<std::exception_ptr> errors(count);
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < count; ++i) {
      threads.emplace_back([&draw, i, &error = errors[i]] {
        try {
          draw(i);
        } catch (...) {
          error = std::current_exception();
        }
      });
    }
  }
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
}

}  // namespace

void KeptCounter::add(std::size_t number, double seconds, const PictureSeries::Picture& made,
                      Session& session) {
  const std::lock_guard lock(counting_);
  ++counts_.at(static_cast<std::size_t>(made.kept));
  seconds_ += seconds;
  const std::string changed =
      made.changed.empty() ? "" : fmt::format(": {}", fmt::join(made.changed, ", "));
  session.console.detail(
      fmt::format("picture {}: {:.2f} s, {}{}", number, seconds, word(made.kept), changed));
}

void KeptCounter::add_ranks(Ranks& ranks) {
  Ranks::Numbers mine(counts_.begin(), counts_.end());
  mine.push_back(seconds_);
  const auto all = ranks.all_gather(mine);
  counts_ = {};
  seconds_ = 0;
  for (const Ranks::Numbers& numbers : all) {
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      counts_.at(i) += static_cast<std::size_t>(numbers.at(i));
    }
    seconds_ += numbers.back();
  }
}

std::size_t KeptCounter::count() const {
  return std::reduce(counts_.begin(), counts_.end(), std::size_t{0});
}

std::string KeptCounter::text() const {
  std::vector<std::string> parts;
  for (const Kept kept : {Kept::nothing, Kept::set, Kept::all}) {
    const std::size_t some = counts_.at(static_cast<std::size_t>(kept));
    if (some > 0) parts.push_back(fmt::format("{} {}", some, word(kept)));
  }
  if (parts.empty()) return "";
  return fmt::format("{}; {:.2f} s a picture", fmt::join(parts, ", "),
                     seconds_ / static_cast<double>(count()));
}

nlohmann::json KeptCounter::json() const {
  const auto some = [this](Kept kept) { return counts_.at(static_cast<std::size_t>(kept)); };
  return {{"all", some(Kept::all)}, {"set", some(Kept::set)}, {"nothing", some(Kept::nothing)}};
}

FilmDrawing::FilmDrawing(const FilmPictures& pictures, const Device& device, Session& session)
    : pictures_(pictures), device_(device), session_(session), job_(picture_job(pictures.script)) {
  job_.device = device_json(device.info());
  key_ = key_of(pictures_, job_);
}

bool FilmDrawing::is_drawn(std::size_t number) const {
  const std::filesystem::path file = pictures_.folder / film::frame_name(number);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return false;
  try {
    const nlohmann::json note = embedded_note(file, session_.stop());
    return note.at("made_with").value("film", "") == film_note(key_, number);
  } catch (const InputError&) {
    return false;
  } catch (const nlohmann::json::exception&) {  // a note of another program's
    return false;
  }
}

PictureSeries& FilmDrawing::add_series(const Device& device) {
  const FilmScript& script = pictures_.script;
  if (!scene_) scene_ = read_scene(script.input, session_);
  PictureSeries& added = *series_.emplace_back(std::make_unique<PictureSeries>(
      device, *scene_, script.input, pictures_.views, job_, session_));
  added.open_shutter([this](std::size_t number, const Camera& drawn) {
    return pictures_.script.moving(pictures_.base, number, drawn);
  });
  if (state_) added.use(state_->frame);
  return added;
}

void FilmDrawing::look() {
  const std::filesystem::path file = pictures_.state();
  if (pictures_.is_shared) expect_same_film(file, key_);
  for (std::size_t i = pictures_.first; i < pictures_.last; ++i) {
    if (!is_drawn(i + 1)) missing_.push_back(i);
  }
  const std::size_t all = pictures_.last - pictures_.first;
  session_.written_so_far = fmt::format("{} of {} pictures are in '{}'; the same command goes on",
                                        all - missing_.size(), all, pictures_.folder.string());
  if (pictures_.are_all()) warn_of_longer_film();
  state_ = kept_state(file, key_, pictures_.views);
  const bool needs_seam = pictures_.are_all() && pictures_.script.dive && !(state_ && state_->seam);
  if (!needs_seam && (state_ || missing_.empty())) return;
  PictureSeries& series = add_series(device_);
  if (!state_) state_.emplace(FilmState{series.frame_with_exposure(), {}});
  if (needs_seam) measure_seam(series);
  base::write_file(file, state_json(*state_, key_).dump() + "\n");
}

/// How the pictures at both ends of a dive differ: the mean over pixels and colours, of 255.
void FilmDrawing::measure_seam(PictureSeries& series) {
  const ProgressMonitor monitor = session_.monitor();
  const Image first = series.picture(0, pictures_.base, false, monitor).image;
  const Image last = series.picture(pictures_.count, pictures_.base, false, monitor).image;
  const double sum =
      std::transform_reduce(first.pixels.begin(), first.pixels.end(), last.pixels.begin(), 0.0,
                            std::plus{}, [](int one, int other) { return std::abs(one - other); });
  state_->seam = sum / static_cast<double>(first.pixels.size());
  warn_of_seam(*state_->seam, session_);
}

void FilmDrawing::share(Ranks& ranks) {
  const bool is_first = ranks.rank() == 0;
  nlohmann::json mine{{"key", key_}};
  if (is_first) {
    mine["missing"] = missing_;
    if (state_) mine["state"] = state_json(*state_, key_);
  }
  const auto all = ranks.all_gather(Ranks::numbers_of(mine.dump()));
  const auto said = nlohmann::json::parse(Ranks::bytes_of(all.front()));
  for (const Ranks::Numbers& numbers : all) {
    if (nlohmann::json::parse(Ranks::bytes_of(numbers)).at("key") == said.at("key")) continue;
    throw InputError(
        "the ranks have devices of several kinds, which draw different bytes; give a --device that "
        "all of them have");
  }
  if (is_first) return;
  missing_ = said.at("missing").get<std::vector<std::size_t>>();
  if (said.contains("state")) state_ = state_from(said["state"], key_, pictures_.views);
}

/// Says which pictures of a longer film are in the folder: they would become part of a film that is
/// made of it by hand. Nothing removes them, since somebody may still want that film.
void FilmDrawing::warn_of_longer_film() {
  std::set<std::string> own, further;
  for (std::size_t number = 1; number <= pictures_.count; ++number) {
    own.insert(film::frame_name(number));
  }
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(pictures_.folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!film::is_frame_name(name) || own.contains(name) || !entry.is_regular_file(ignored))
      continue;
    try {
      if (embedded_note(entry.path(), session_.stop()).at("made_with").contains("film")) {
        further.insert(name);
      }
    } catch (const InputError&) {  // somebody else's
    } catch (const nlohmann::json::exception&) {
    }
  }
  if (further.empty()) return;
  session_.console.warn(fmt::format(
      "'{}' has {} pictures that this film has not, from '{}' on: they are of a longer one",
      pictures_.folder.string(), further.size(), *further.begin()));
}

void FilmDrawing::draw(int jobs, const Ranks& ranks, KeptCounter& kept) {
  std::vector<std::size_t> own;
  const auto step = static_cast<std::size_t>(ranks.size());
  for (auto i = static_cast<std::size_t>(ranks.rank()); i < missing_.size(); i += step) {
    own.push_back(missing_[i]);
  }
  const std::size_t threads = std::min(static_cast<std::size_t>(jobs), own.size());
  while (series_.size() < threads) add_series(series_.empty() ? device_ : device_.sibling());
  std::atomic<std::size_t> next = 0, done = 0;
  std::atomic<bool> has_failed = false;
  std::mutex telling;
  in_threads(threads, [&](std::size_t thread) {
    while (!has_failed) {
      const std::size_t place = next++;
      if (place >= own.size()) return;
      try {
        // Of several pictures at once, each tells of all that are done.
        draw(*series_[thread], own[place], kept, part_monitor(session_, done, own.size()));
      } catch (...) {
        has_failed = true;
        throw;
      }
      const std::lock_guard lock(telling);
      ++done;
      const std::size_t here = pictures_.last - pictures_.first - missing_.size() + done;
      session_.written_so_far =
          fmt::format("{} of {} pictures are in '{}'{}; the same command goes on", here,
                      pictures_.last - pictures_.first, pictures_.folder.string(),
                      ranks.size() > 1 ? ", and those of other ranks" : "");
    }
  });
}

void FilmDrawing::draw(PictureSeries& series, std::size_t number, KeptCounter& kept,
                       const ProgressMonitor& monitor) {
  const auto start = std::chrono::steady_clock::now();
  // Another command may have begun at the same time.
  if (pictures_.is_shared) expect_same_film(pictures_.state(), key_);
  const auto made = series.picture(number, pictures_.base, false, monitor);
  nlohmann::json how = made_with(made.job);
  how["picture"] = to_json(made.view.picture);
  if (made.view.scatter.field) how["scatter"] = to_json(made.view.scatter);
  how["film"] = film_note(key_, number + 1);
  write_picture(made.image, pictures_.folder / film::frame_name(number + 1), how);
  const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
  kept.add(number + 1, taken.count(), made, session_);
}

void remove_pictures(const FilmPictures& pictures) {
  std::error_code ignored;
  for (std::size_t i = 1; i <= pictures.count; ++i) {
    std::filesystem::remove(pictures.folder / film::frame_name(i), ignored);
  }
  for (const auto& file : {pictures.state(), pictures.folder / ".lock"}) {
    std::filesystem::remove(file, ignored);
  }
  std::filesystem::remove(pictures.folder, ignored);
}

}  // namespace qjulia::tools

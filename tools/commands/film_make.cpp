/// qjulia film make: a script in, a film out.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <thread>
#include <vector>

#include "base/output_file.hpp"
#include "base/setting_json.hpp"
#include "base/text.hpp"
#include "batch/folder_lock.hpp"
#include "commands/film_commands.hpp"
#include "commands/film_script.hpp"
#include "console/child_output.hpp"
#include "describe/files.hpp"
#include "describe/notes.hpp"
#include "describe/provenance.hpp"
#include "film/encoder.hpp"
#include "jobs/picture_series.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/base/version.hpp"

namespace qjulia::tools {
namespace {

struct FilmArguments {
  std::string script;
  std::string output;
  TrustedDevice device;
  double seconds = 0;
  std::optional<std::string> frames;  ///< "10:20"; none: all
  bool keeps_frames = false;
  int jobs = 1;
};

struct FilmPlan : Plan {
  FilmScript script;
  View base;                        ///< what holds for all pictures
  std::vector<View> views;          ///< of each picture, and of the end of a dive
  std::filesystem::path folder;     ///< of the pictures
  std::size_t pictures = 0;         ///< of the whole film
  bool is_folder = false;           ///< no film is made of them
  std::size_t first = 0, last = 0;  ///< pictures to draw; last is the one after
  bool is_shared = false;           ///< other commands may draw parts of the film, too

  std::filesystem::path state() const { return folder / "film.json"; }
};

bool is_transparent(const FilmPlan& plan) {
  return plan.base.picture.background.kind == Backdrop::transparent;
}

/// "10:20" of 40: 9 and 20.
std::pair<std::size_t, std::size_t> pictures_in(const std::string& text, std::size_t count) {
  const auto words = base::split(text, ':');
  const auto first = base::number_in<std::size_t>(words.front());
  const auto last = base::number_in<std::size_t>(words.back());
  if (words.size() == 2 && first && last && *first >= 1 && *last >= *first && *last <= count) {
    return {*first - 1, *last};
  }
  throw InputError(
      fmt::format("--frames: '{}' is not FIRST:LAST of the film's pictures, 1 to {}", text, count));
}

/// @throws InputError where something that is no folder has its name
void expect_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  const auto status = std::filesystem::status(folder, ignored);
  if (!std::filesystem::exists(status) || std::filesystem::is_directory(status)) return;
  throw InputError(
      fmt::format("--output: '{}' is to be a folder of pictures, and is none; give "
                  "another name, or one that ends in {}",
                  folder.string(), fmt::join(film::film_types(), ", ")));
}

FilmPlan plan_film(const FilmArguments& arguments) {
  FilmPlan plan;
  plan.script = read_film_script(arguments.script, arguments.seconds);
  plan.base = plan.script.base();
  plan.views = plan.script.views(plan.base);
  plan.last = plan.pictures = plan.script.pictures();
  plan.is_shared = arguments.frames.has_value();
  if (arguments.frames) std::tie(plan.first, plan.last) = pictures_in(*arguments.frames, plan.last);
  plan.inputs = {arguments.script, plan.script.input};
  plan.inputs.insert(plan.inputs.end(), plan.script.maps.begin(), plan.script.maps.end());
  plan.further_inputs = plan.script.files();
  const std::filesystem::path output = arguments.output;
  plan.is_folder = base::extension_of(output).empty();
  if (plan.is_folder) {
    plan.folder = output;
  } else {
    const PictureOptions& picture = plan.base.picture;
    plan.folder = output.parent_path() / (output.stem().string() + ".frames");
    plan.outputs = {{"--output", output, film::film_types()}};
    film::expect_size(output, picture.width, picture.height, is_transparent(plan));
  }
  expect_folder(plan.folder);
  return plan;
}

/// What all pictures of a film depend on: a picture that another run has drawn is this film's where
/// the key is equal.
std::string key_of(const FilmPlan& plan, const Job& job) {
  nlohmann::json views = nlohmann::json::array();
  for (const View& view : plan.views) {
    views.push_back({to_json(view.map_options), to_json(view.picture)});
    if (!view.map.empty()) views.push_back(file_hash(view.map));
  }
  return text_hash(
      fmt::format("{}{}{}{}", to_json(job).dump(), views.dump(), plan.script.shutter, version()));
}

/// What a picture's note says of its film.
std::string film_note(const std::string& key, std::size_t number) {
  return fmt::format("{} {}", key, number);
}

/// Whether the file holds the picture with that note.
bool is_drawn(const std::filesystem::path& file, const std::string& note,
              const std::stop_token& stop) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return false;
  try {
    return embedded_note(file, stop).at("made_with").value("film", "") == note;
  } catch (const InputError&) {
    return false;
  }
}

/// What is found before the first picture.
struct FilmState {
  SeriesFrame frame;
  std::optional<double> seam;  ///< of a dive, once it was measured
};

nlohmann::json state_json(const FilmState& state) {
  const SeriesFrame& frame = state.frame;
  nlohmann::json cameras = nlohmann::json::array();
  for (const Camera& camera : frame.cameras) {
    const Eigen::Vector3d& at = *camera.look_at;
    cameras.push_back({at.x(), at.y(), at.z(), *camera.distance});
  }
  nlohmann::json json{{"cameras", cameras}};
  if (frame.range) json["range"] = frame.range->values();
  if (frame.exposure) json["exposure"] = *frame.exposure;
  if (state.seam) json["seam"] = *state.seam;
  return json;
}

/// What an earlier run has found; none where that was of another film.
std::optional<FilmState> kept_state(const std::filesystem::path& file, const std::string& key,
                                    const std::vector<View>& views) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    const nlohmann::json json = read_report(file.string(), "the film's state");
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

/// Of several commands that draw parts of a film into its folder, each is to draw the same film.
/// @throws InputError where the folder's state is another film's, or cannot be read
void expect_same_film(const std::filesystem::path& state, const std::string& key) {
  std::error_code ignored;
  if (!std::filesystem::exists(state, ignored)) return;
  const nlohmann::json json = read_report(state.string(), "the film's state");
  if (json.is_object() && json.value("key", "") == key) return;
  throw InputError(fmt::format(
      "--frames: '{}' has pictures of another script or device, or of this one before it, its map "
      "or the program was changed; give another folder, or remove that one",
      state.parent_path().string()));
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

/// Says which pictures of a longer film are in the folder: they would become part of a film that is
/// made of it by hand. Nothing removes them, since somebody may still want that film.
void warn_of_longer_film(const FilmPlan& plan, Session& session) {
  std::set<std::string> own, further;
  for (std::size_t number = 1; number <= plan.pictures; ++number) {
    own.insert(film::frame_name(number));
  }
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(plan.folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!film::is_frame_name(name) || own.contains(name) || !entry.is_regular_file(ignored))
      continue;
    try {
      if (embedded_note(entry.path(), session.stop()).at("made_with").contains("film")) {
        further.insert(name);
      }
    } catch (const InputError&) {  // somebody else's
    }
  }
  if (further.empty()) return;
  session.console.warn(fmt::format(
      "'{}' has {} pictures that this film has not, from '{}' on: they are of a longer one",
      plan.folder.string(), further.size(), *further.begin()));
}

/// How often pictures needed what, for people and programs.
class KeptCounter {
 public:
  void add(std::size_t number, double seconds, const PictureSeries::Picture& made,
           Session& session) {
    const std::lock_guard lock(counting_);
    ++counts_[made.kept];
    seconds_ += seconds;
    const std::string changed =
        made.changed.empty() ? "" : fmt::format(": {}", fmt::join(made.changed, ", "));
    session.console.detail(
        fmt::format("picture {}: {:.2f} s, {}{}", number, seconds, word(made.kept), changed));
  }
  /// "112 kept all, 13 nothing; 1.2 s a picture"
  std::string text() const {
    std::vector<std::string> parts;
    std::size_t all = 0;
    for (const auto& [kept, count] : counts_) {
      parts.push_back(fmt::format("{} {}", count, word(kept)));
      all += count;
    }
    if (all == 0) return "";
    return fmt::format("{}; {:.2f} s a picture", fmt::join(parts, ", "),
                       seconds_ / static_cast<double>(all));
  }
  nlohmann::json json() const {
    const auto count = [this](Kept kept) {
      const auto found = counts_.find(kept);
      return found == counts_.end() ? 0 : found->second;
    };
    return {
        {"all", count(Kept::all)}, {"set", count(Kept::set)}, {"nothing", count(Kept::nothing)}};
  }

 private:
  static const char* word(Kept kept) {
    return kept == Kept::all   ? "drawn with the set and the sky of the one before"
           : kept == Kept::set ? "drawn with the set of the one before"
                               : "drawn anew";
  }

  std::mutex counting_;
  std::map<Kept, std::size_t> counts_;
  double seconds_ = 0;  ///< of all pictures
};

/// What an interrupted command says.
void tell_drawn(const FilmPlan& plan, std::size_t missing, Session& session) {
  const std::size_t all = plan.last - plan.first;
  session.written_so_far = fmt::format("{} of {} pictures are in '{}'; the same command goes on",
                                       all - missing, all, plan.folder.string());
}

/// Pictures that are to be drawn, handed out one by one to threads.
class FilmDrawing {
 public:
  FilmDrawing(const FilmPlan& plan, const std::string& key, std::vector<std::size_t> missing,
              Session& session, KeptCounter& kept)
      : plan_(plan), key_(key), missing_(std::move(missing)), session_(session), kept_(kept) {}

  /// Draws until none is left, or another thread has failed.
  void draw(PictureSeries& series) {
    while (!has_failed_) {
      const std::size_t place = next_++;
      if (place >= missing_.size()) return;
      try {
        draw(series, missing_[place]);
      } catch (...) {
        has_failed_ = true;
        throw;
      }
    }
  }

 private:
  void draw(PictureSeries& series, std::size_t i) {
    const auto start = std::chrono::steady_clock::now();
    // Another command may have begun at the same time.
    if (plan_.is_shared) expect_same_film(plan_.state(), key_);
    // Of several pictures at once, each tells of all that are done.
    const auto made =
        series.picture(i, plan_.base, false, part_monitor(session_, done_, missing_.size()));
    nlohmann::json how = made_with(made.job);
    how["picture"] = to_json(made.view.picture);
    how["film"] = film_note(key_, i + 1);
    write_picture(made.image, plan_.folder / film::frame_name(i + 1), how);
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
    kept_.add(i + 1, taken.count(), made, session_);
    const std::lock_guard lock(telling_);
    tell_drawn(plan_, missing_.size() - ++done_, session_);
  }

  const FilmPlan& plan_;
  const std::string& key_;
  std::vector<std::size_t> missing_;
  Session& session_;
  KeptCounter& kept_;
  std::atomic<std::size_t> next_{0}, done_{0};
  std::atomic<bool> has_failed_{false};
  std::mutex telling_;
};

/// Draws the pictures with several threads, each with a queue of the device. @throws what the first
/// thread throws
void draw_with_threads(FilmDrawing& drawing, std::vector<std::unique_ptr<PictureSeries>>& series) {
  std::vector<std::exception_ptr> errors(series.size());
  {
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < series.size(); ++i) {
      threads.emplace_back([&drawing, &own = *series[i], &error = errors[i]] {
        try {
          drawing.draw(own);
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

/// How the pictures at both ends of a dive differ: the mean over pixels and colours, of 255.
double measured_seam(const FilmPlan& plan, PictureSeries& series, Session& session) {
  const ProgressMonitor monitor = session.monitor();
  const Image first = series.picture(0, plan.base, false, monitor).image;
  const Image last = series.picture(plan.pictures, plan.base, false, monitor).image;
  const double sum =
      std::transform_reduce(first.pixels.begin(), first.pixels.end(), last.pixels.begin(), 0.0,
                            std::plus{}, [](int one, int other) { return std::abs(one - other); });
  return sum / static_cast<double>(first.pixels.size());
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

struct Drawn {
  std::size_t count = 0;
  std::optional<double> seam;
};

/// Draws the pictures that are not there yet.
Drawn draw_pictures(const FilmPlan& plan, int jobs, const Scene& scene, const Device& device,
                    Session& session, KeptCounter& kept) {
  const FilmScript& script = plan.script;
  Job job = picture_job(script);
  job.device = device_json(device.info());
  const std::string key = key_of(plan, job);
  const std::filesystem::path state = plan.state();
  if (plan.is_shared) expect_same_film(state, key);
  std::vector<std::size_t> missing;
  for (std::size_t i = plan.first; i < plan.last; ++i) {
    const std::filesystem::path file = plan.folder / film::frame_name(i + 1);
    if (!is_drawn(file, film_note(key, i + 1), session.stop())) missing.push_back(i);
  }
  tell_drawn(plan, missing.size(), session);
  const bool draws_all = plan.last - plan.first == plan.pictures;
  if (draws_all) warn_of_longer_film(plan, session);
  std::optional<FilmState> found = kept_state(state, key, plan.views);
  const bool needs_seam = draws_all && plan.script.dive && !(found && found->seam);
  if (missing.empty() && !needs_seam) return {0, found ? found->seam : std::nullopt};
  std::vector<std::unique_ptr<PictureSeries>> series;
  const auto add_series = [&](const Device& own) {
    series.push_back(
        std::make_unique<PictureSeries>(own, scene, script.input, plan.views, job, session));
    series.back()->open_shutter([&](std::size_t number, const Camera& drawn) {
      return script.moving(plan.base, number, drawn);
    });
  };
  add_series(device);
  const bool is_new = !found;
  if (found) {
    series.front()->use(found->frame);
  } else {
    found.emplace(FilmState{series.front()->frame_with_exposure(), {}});
  }
  if (needs_seam) {
    found->seam = measured_seam(plan, *series.front(), session);
    warn_of_seam(*found->seam, session);
  }
  if (is_new || needs_seam) {
    nlohmann::json json = state_json(*found);
    json["key"] = key;
    base::write_file(state, json.dump() + "\n");
  }
  while (series.size() < std::min(static_cast<std::size_t>(jobs), missing.size())) {
    add_series(device.sibling());
    series.back()->use(found->frame);
  }
  const std::size_t count = missing.size();
  FilmDrawing drawing(plan, key, std::move(missing), session, kept);
  draw_with_threads(drawing, series);
  return {count, found->seam};
}

/// FFmpeg repeats all numbered pictures of the folder, beyond this film's too.
/// @throws InputError where a longer film's picture follows the last one
void expect_no_further_picture(const FilmPlan& plan) {
  const std::filesystem::path next = plan.folder / film::frame_name(plan.pictures + 1);
  std::error_code ignored;
  if (plan.script.copies == 1 || !std::filesystem::exists(next, ignored)) return;
  throw InputError(
      fmt::format("'{}' is of a longer film and would be repeated with this one's pictures; remove "
                  "it and those "
                  "after it, or give another --output",
                  next.string()));
}

/// Puts the file's bytes to where a user wants them: through links, and into pipes.
void deliver(const std::filesystem::path& from, const std::filesystem::path& to) {
  std::ifstream in(from, std::ios::binary);
  base::OutputFile file(to);
  if (in.peek() != std::char_traits<char>::eof()) file.stream() << in.rdbuf();
  if (!in || in.bad()) throw OutputError(fmt::format("cannot read '{}'", from.string()));
  file.commit();
}

/// Has FFmpeg make the film. @throws OutputError that shows the command to run
void encode(const FilmArguments& arguments, const FilmPlan& plan, Session& session) {
  const std::filesystem::path output = arguments.output;
  const auto unfinished = plan.folder / ("film.unfinished" + base::extension_of(output));
  film::Encoding encoding{plan.folder,
                          unfinished,
                          plan.script.rate,
                          plan.pictures,
                          plan.script.copies,
                          is_transparent(plan),
                          one_line(made_with(session.job()))};
  session.monitor().report({"encoding", 0, -1, ""});
  ChildOutput said;
  std::error_code ignored;
  try {
    said = child_output(film::encoder_words(encoding), session.stop());
    if (said.exit_code == 0) deliver(unfinished, output);
  } catch (const InputError& error) {
    said = {.exit_code = kFailed, .err = fmt::format("{}; install FFmpeg", error.what())};
  } catch (const OutputError& error) {
    said = {.exit_code = kFailed, .err = error.what()};
  } catch (const Interrupted&) {
    std::filesystem::remove(unfinished, ignored);
    throw;
  }
  std::filesystem::remove(unfinished, ignored);
  if (said.exit_code == 0) return;
  while (said.err.ends_with('\n')) said.err.pop_back();
  if (said.signal > 0) {
    said.err += fmt::format("{}signal {} ended it", said.err.empty() ? "" : "; ", said.signal);
  } else if (said.err.empty()) {
    said.err = fmt::format("FFmpeg ended with code {} and said nothing", said.exit_code);
  }
  encoding.output = output;
  encoding.note.clear();
  throw OutputError(
      fmt::format("the film could not be made of its pictures, which are kept in "
                  "'{}': {}\nthe command was: {}",
                  plan.folder.string(), said.err, shell_words(film::encoder_words(encoding))));
}

/// Removes the film's own files, and the folder where nothing else is in it.
void remove_pictures(const FilmPlan& plan) {
  std::error_code ignored;
  for (std::size_t i = 1; i <= plan.pictures; ++i) {
    std::filesystem::remove(plan.folder / film::frame_name(i), ignored);
  }
  for (const auto& file : {plan.state(), plan.folder / ".lock"}) {
    std::filesystem::remove(file, ignored);
  }
  std::filesystem::remove(plan.folder, ignored);
}

int run_film(const FilmArguments& arguments, const FilmPlan& plan, Session& session) {
  const Scene scene = read_scene(plan.script.input, session);
  const Device device = session.open_device(arguments.device);
  const bool makes_film = !plan.is_folder && !plan.is_shared;
  if (makes_film && !film::has_encoder()) {
    session.console.warn(
        "FFmpeg is not installed: the pictures will be drawn, but no film will be made");
  }
  base::make_folder(plan.folder);
  // Machines that draw parts of one film share its folder.
  const batch::FolderLock lock(
      plan.folder, plan.is_shared ? batch::FolderLock::Kind::shared : batch::FolderLock::Kind::own);
  base::remove_all_leftovers(plan.folder);
  if (makes_film) expect_no_further_picture(plan);
  KeptCounter kept;
  const Drawn drawn = draw_pictures(plan, arguments.jobs, scene, device, session, kept);
  session.report_kernels(device);
  if (makes_film) {
    encode(arguments, plan, session);
    if (!arguments.keeps_frames) remove_pictures(plan);
  }
  const std::string made = makes_film ? fmt::format("film: {}", arguments.output)
                                      : fmt::format("pictures: {}", plan.folder.string());
  std::string how = drawn.count > 0 ? fmt::format("{}\n", kept.text()) : "";
  if (drawn.seam) {
    how += fmt::format(
        "loop: {:.4g} times as large; its first and last picture differ by {:.2f} of 255\n",
        plan.script.dive->scale(), *drawn.seam);
  }
  session.console.summary(
      fmt::format("{} pictures, of which {} were drawn now, {:.1f} s\n{}{}", plan.last - plan.first,
                  drawn.count, session.seconds(), how, made),
      {{"film", makes_film ? nlohmann::json(arguments.output) : nlohmann::json()},
       {"pictures", plan.last - plan.first},
       {"drawn", drawn.count},
       {"seam", drawn.seam ? nlohmann::json(*drawn.seam) : nlohmann::json()},
       {"kept", kept.json()},
       {"folder", plan.folder.string()},
       {"seconds", session.seconds()}});
  return kDone;
}

void describe_film(Command command, FilmArguments& a) {
  add_script(command, a.script);
  command
      .output(a.output, "FILM",
              fmt::format("Film to write: {}; or, without an extension, a folder of numbered "
                          "pictures",
                          fmt::join(film::film_types(), ", ")))
      .offers_files(film::film_types());
  add_seconds(command, a.seconds);
  command
      .word(
          "--frames", "FIRST:LAST", [&a](const std::string& text) { a.frames = text; },
          "Draw these pictures alone, counted from 1, and make no film: for several machines")
      .not_in_job();
  command
      .flag("--keep-frames", a.keeps_frames,
            "Keep the folder of pictures, FILM.frames, once the film is made")
      .not_in_job();
  command
      .add("--jobs", &a.jobs, "N",
           "Pictures that are drawn at the same time; each has its own grids and tables in memory")
      .range(1, 64)
      .not_in_job();
  add_device_to_use(command, a.device);
}

}  // namespace

void add_film_make(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"film make", "Make a film of a script", R"(Examples:
  qjulia film make dive.toml -o dive.mp4
  qjulia film make dive.toml -o dive.webm --seconds 20
  qjulia film make dive.toml -o dive --frames 1:100
All pictures have the same light, colours and framing, so that nothing flickers. They are drawn into
the folder FILM.frames; a command that was stopped goes on where it was. FFmpeg makes the film of
them: H.264 in .mp4, AV1 in .webm (VP9 where the background is transparent).)",
               /*can_trace=*/true,
               /*can_profile=*/true},
              describe_film, plan_film, run_film);
}

}  // namespace qjulia::tools

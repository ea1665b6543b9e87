/// qjulia film make: a script in, a film out.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "base/output_file.hpp"
#include "base/setting_json.hpp"
#include "base/text.hpp"
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
};

struct FilmPlan : Plan {
  FilmScript script;
  View base;                        ///< what holds for all pictures
  std::vector<View> views;          ///< of each picture
  std::filesystem::path folder;     ///< of the pictures
  bool is_folder = false;           ///< no film is made of them
  std::size_t first = 0, last = 0;  ///< pictures to draw; last is the one after
};

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

FilmPlan plan_film(const FilmArguments& arguments) {
  FilmPlan plan;
  plan.script = read_film_script(arguments.script, arguments.seconds);
  plan.base = plan.script.base();
  plan.views = plan.script.views(plan.base);
  plan.last = plan.views.size();
  if (arguments.frames) std::tie(plan.first, plan.last) = pictures_in(*arguments.frames, plan.last);
  plan.inputs = {arguments.script, plan.script.input};
  const std::filesystem::path output = arguments.output;
  plan.is_folder = base::extension_of(output).empty();
  if (plan.is_folder) {
    plan.folder = output;
    return plan;
  }
  plan.folder = output.parent_path() / (output.stem().string() + ".frames");
  plan.outputs = {{"--output", output, film::film_types()}};
  return plan;
}

/// What all pictures of a film depend on: a picture that another run has drawn is this film's where
/// the key is equal.
std::string key_of(const FilmPlan& plan, const Job& job) {
  nlohmann::json views = nlohmann::json::array();
  for (const View& view : plan.views) {
    views.push_back({to_json(view.map_options), to_json(view.picture)});
  }
  return text_hash(to_json(job).dump() + views.dump() + version());
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

nlohmann::json state_json(const SeriesFrame& frame) {
  nlohmann::json cameras = nlohmann::json::array();
  for (const Camera& camera : frame.cameras) {
    const Eigen::Vector3d& at = *camera.look_at;
    cameras.push_back({at.x(), at.y(), at.z(), *camera.distance});
  }
  nlohmann::json json{{"cameras", cameras}};
  if (frame.range) json["range"] = frame.range->values();
  if (frame.exposure) json["exposure"] = *frame.exposure;
  return json;
}

/// What an earlier run has found; none where that was of another film.
std::optional<SeriesFrame> kept_frame(const std::filesystem::path& file, const std::string& key,
                                      const std::vector<View>& views) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) return std::nullopt;
  try {
    const nlohmann::json json = read_report(file.string(), "the film's state");
    if (json.at("key") != key || json.at("cameras").size() != views.size()) return std::nullopt;
    SeriesFrame frame;
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
    return frame;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;
  } catch (const InputError&) {
    return std::nullopt;
  }
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

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (std::filesystem::is_directory(folder, error)) return;
  throw OutputError(fmt::format("cannot make the folder '{}'", folder.string()));
}

/// Draws the pictures that are not there yet. @return how many it drew.
std::size_t draw_pictures(const FilmPlan& plan, Scene scene, const Device& device,
                          Session& session) {
  const FilmScript& script = plan.script;
  Job job = picture_job(script);
  job.device = device_json(device.info());
  const std::string key = key_of(plan, job);
  const std::filesystem::path state = plan.folder / "film.json";
  make_folder(plan.folder);
  PictureSeries series(device, std::move(scene), script.input, plan.views, job, session);
  if (auto kept = kept_frame(state, key, plan.views)) {
    series.use(std::move(*kept));
  } else {
    nlohmann::json found = state_json(series.frame_with_exposure());
    found["key"] = key;
    base::write_file(state, found.dump() + "\n");
  }
  std::size_t drawn = 0;
  const std::size_t count = plan.last - plan.first;
  for (std::size_t i = plan.first; i < plan.last; ++i) {
    const std::filesystem::path file = plan.folder / film::frame_name(i + 1);
    if (is_drawn(file, film_note(key, i + 1), session.stop())) continue;
    const auto made =
        series.picture(i, plan.base, false, part_monitor(session, i - plan.first, count));
    nlohmann::json how = made_with(made.job);
    how["picture"] = to_json(made.view.picture);
    how["film"] = film_note(key, i + 1);
    write_picture(made.image, file, how);
    ++drawn;
    session.written_so_far = fmt::format("{} of {} pictures are in '{}'; the same command goes on",
                                         i + 1, plan.views.size(), plan.folder.string());
  }
  return drawn;
}

/// What a user types to make the film by hand.
std::string typed(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) {
    const std::size_t dashes = std::min(word.find_first_not_of('-'), word.size());
    text += (text.empty() ? "" : " ") + word.substr(0, dashes) + shell_word(word.substr(dashes));
  }
  return text;
}

/// Has FFmpeg make the film. @throws OutputError that shows the command to run
void encode(const FilmArguments& arguments, const FilmPlan& plan, Session& session) {
  const std::filesystem::path output = arguments.output;
  const auto unfinished = output.parent_path() / ("." + output.stem().string() + ".unfinished" +
                                                  base::extension_of(output));
  film::Encoding encoding{plan.folder,
                          unfinished,
                          plan.script.rate,
                          plan.views.size(),
                          plan.base.picture.background.kind == Backdrop::transparent,
                          one_line(made_with(session.job()))};
  session.monitor().report({"encoding", 0, -1, ""});
  ChildOutput said;
  try {
    said = child_output(film::encoder_words(encoding), session.stop());
  } catch (const InputError& error) {
    said = {kFailed, {}, fmt::format("{}; install FFmpeg", error.what())};
  } catch (const Interrupted&) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw;
  }
  std::error_code error;
  if (said.exit_code == 0) {
    std::filesystem::rename(unfinished, output, error);
    if (!error) return;
    said.err = error.message();
  }
  std::filesystem::remove(unfinished, error);
  encoding.output = output;
  encoding.note.clear();
  throw OutputError(
      fmt::format("the film could not be made of its pictures, which are kept in "
                  "'{}': {}\nthe command was: {}",
                  plan.folder.string(), said.err, typed(film::encoder_words(encoding))));
}

/// Removes the film's own files, and the folder where nothing else is in it.
void remove_pictures(const FilmPlan& plan) {
  std::error_code ignored;
  for (std::size_t i = 1; i <= plan.views.size(); ++i) {
    std::filesystem::remove(plan.folder / film::frame_name(i), ignored);
  }
  std::filesystem::remove(plan.folder / "film.json", ignored);
  std::filesystem::remove(plan.folder, ignored);
}

int run_film(const FilmArguments& arguments, const FilmPlan& plan, Session& session) {
  Scene scene = read_scene(plan.script.input, session);
  const Device device = session.open_device(arguments.device);
  const std::size_t drawn = draw_pictures(plan, std::move(scene), device, session);
  session.report_kernels(device);
  const bool makes_film = !plan.is_folder && !arguments.frames;
  if (makes_film) {
    encode(arguments, plan, session);
    if (!arguments.keeps_frames) remove_pictures(plan);
  }
  const std::string made = makes_film ? fmt::format("film: {}", arguments.output)
                                      : fmt::format("pictures: {}", plan.folder.string());
  session.console.summary(
      fmt::format("{} pictures, of which {} were drawn now, {:.1f} s\n{}", plan.last - plan.first,
                  drawn, session.seconds(), made),
      {{"film", makes_film ? nlohmann::json(arguments.output) : nlohmann::json()},
       {"pictures", plan.last - plan.first},
       {"drawn", drawn},
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

/// qjulia film make: a script in, a film out.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "base/output_file.hpp"
#include "base/text.hpp"
#include "batch/folder_lock.hpp"
#include "commands/film_commands.hpp"
#include "commands/film_pictures.hpp"
#include "commands/launched_ranks.hpp"
#include "console/child_output.hpp"
#include "describe/files.hpp"
#include "describe/provenance.hpp"
#include "film/encoder.hpp"
#include "qjulia/base/error.hpp"

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
  FilmPictures pictures;
  bool is_folder = false;  ///< no film is made of them

  bool makes_film() const { return !is_folder && !pictures.is_shared; }
};

bool is_transparent(const FilmPlan& plan) {
  return plan.pictures.base.picture.background.kind == Backdrop::transparent;
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
  FilmPictures& pictures = plan.pictures;
  const std::filesystem::path output = arguments.output;
  pictures.script = read_film_script(
      {arguments.script, arguments.seconds, made_folder(arguments.script, output)});
  const FilmScript& script = pictures.script;
  pictures.base = script.base();
  pictures.views = script.views(pictures.base);
  pictures.last = pictures.count = script.pictures();
  pictures.is_shared = arguments.frames.has_value();
  if (arguments.frames) {
    std::tie(pictures.first, pictures.last) = pictures_in(*arguments.frames, pictures.count);
  }
  plan.further_inputs = script.files();
  plan.inputs = {arguments.script};
  for (const auto& [name, path] : plan.further_inputs) plan.inputs.push_back(path);
  plan.inputs.insert(plan.inputs.end(), script.maps.begin(), script.maps.end());
  plan.is_folder = base::extension_of(output).empty();
  if (plan.is_folder) {
    pictures.folder = output;
  } else {
    const PictureOptions& picture = pictures.base.picture;
    pictures.folder = output.parent_path() / (output.stem().string() + ".frames");
    plan.outputs = {{"--output", output, film::film_types()}};
    film::expect_size(output, picture.width, picture.height, is_transparent(plan));
  }
  expect_folder(pictures.folder);
  return plan;
}

/// FFmpeg repeats all numbered pictures of the folder, beyond this film's too.
/// @throws InputError where a longer film's picture follows the last one
void expect_no_further_picture(const FilmPictures& pictures) {
  const std::filesystem::path next = pictures.folder / film::frame_name(pictures.count + 1);
  std::error_code ignored;
  if (pictures.script.copies == 1 || !std::filesystem::exists(next, ignored)) return;
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
  const auto unfinished = plan.pictures.folder / ("film.unfinished" + base::extension_of(output));
  const FilmPictures& pictures = plan.pictures;
  film::Encoding encoding{pictures.folder,
                          unfinished,
                          pictures.script.rate,
                          pictures.count,
                          pictures.script.copies,
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
  throw OutputError(fmt::format(
      "the film could not be made of its pictures, which are kept in "
      "'{}': {}\nthe command was: {}",
      plan.pictures.folder.string(), said.err, shell_words(film::encoder_words(encoding))));
}

/// One run of the command, on each of its ranks. All ranks take each step, or none does: a rank
/// that fails alone would leave the others waiting.
class FilmRun {
 public:
  FilmRun(const FilmArguments& arguments, LaunchedRanks& ranks, Session& session)
      : arguments_(arguments), ranks_(ranks), session_(session) {}

  int run() {
    const auto step = [this](void (FilmRun::*call)()) -> int {
      if (ranks_.size() == 1) {
        (this->*call)();
        return kDone;
      }
      return together(ranks_, [&]() -> int {
        try {
          (this->*call)();
          return kDone;
        } catch (const Interrupted&) {
          if (is_first()) session_.console.note("interrupted; " + session_.written_so_far);
          return kInterrupted;
        }
      });
    };
    for (const auto call : {&FilmRun::begin, &FilmRun::make_maps, &FilmRun::look}) {
      if (const int code = step(call); code != kDone) return code;
    }
    if (const int code = step(&FilmRun::draw); code != kDone) return code;
    kept_.add_ranks(ranks_);
    return step(&FilmRun::finish);
  }

 private:
  bool is_first() const { return ranks_.rank() == 0; }
  const FilmPictures& pictures() const { return plan_.pictures; }

  void begin() {
    plan_ = plan_film(arguments_);
    if (!is_first()) return;
    session_.check_outputs(plan_);
    if (plan_.makes_film() && !film::has_encoder()) {
      session_.console.warn(
          "FFmpeg is not installed: the pictures will be drawn, but no film will be made");
    }
  }

  void make_maps() {
    device_ = open_rank_device(ranks_, arguments_.device, session_);
    if (is_first()) static_cast<void>(with_maps(pictures().script, *device_, session_));
  }

  void look() {
    if (!pictures().script.made.empty()) plan_ = plan_film(arguments_);
    if (is_first()) {
      const std::filesystem::path& folder = pictures().folder;
      base::make_folder(folder);
      using LockKind = batch::FolderLock::Kind;
      // Machines that draw parts of one film share its folder.
      lock_.emplace(folder, pictures().is_shared ? LockKind::shared : LockKind::own);
      base::remove_all_leftovers(folder);
      if (plan_.makes_film()) expect_no_further_picture(pictures());
    }
    drawing_.emplace(pictures(), *device_, session_);
    if (is_first()) drawing_->look();
  }

  void draw() {
    drawing_->share(ranks_);
    drawing_->draw(arguments_.jobs, ranks_, kept_);
    session_.report_kernels(*device_);
  }

  void finish() {
    if (!is_first()) return;
    if (plan_.makes_film()) {
      encode(arguments_, plan_, session_);
      if (!arguments_.keeps_frames) remove_pictures(pictures());
    }
    const std::string made = plan_.makes_film()
                                 ? fmt::format("film: {}", arguments_.output)
                                 : fmt::format("pictures: {}", pictures().folder.string());
    std::string how = kept_.count() > 0 ? fmt::format("{}\n", kept_.text()) : "";
    const std::optional<double> seam = drawing_->seam();
    if (seam) {
      how += fmt::format(
          "loop: {:.4g} times as large; its first and last picture differ by {:.2f} of 255\n",
          pictures().script.dive->scale(), *seam);
    }
    const std::size_t wanted = pictures().last - pictures().first;
    session_.console.summary(
        fmt::format("{} pictures, of which {} were drawn now, {:.1f} s\n{}{}", wanted,
                    kept_.count(), session_.seconds(), how, made),
        {{"film", plan_.makes_film() ? nlohmann::json(arguments_.output) : nlohmann::json()},
         {"pictures", wanted},
         {"drawn", kept_.count()},
         {"seam", seam ? nlohmann::json(*seam) : nlohmann::json()},
         {"kept", kept_.json()},
         {"folder", pictures().folder.string()},
         {"seconds", session_.seconds()}});
  }

  const FilmArguments& arguments_;
  LaunchedRanks& ranks_;
  Session& session_;
  FilmPlan plan_;
  std::optional<Device> device_;
  std::optional<batch::FolderLock> lock_;  ///< the first rank's
  std::optional<FilmDrawing> drawing_;
  KeptCounter kept_;
};

int run_film(const FilmArguments& arguments, Session& session) {
  LaunchedRanks ranks;
  if (ranks.rank() > 0) session.leave_trace();  // rank 0 writes it
  return FilmRun(arguments, ranks, session).run();
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
              describe_film, run_film);
}

}  // namespace qjulia::tools

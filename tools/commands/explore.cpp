/// qjulia explore: a page on which a map is played with, drawn by a device of this machine.

#include <fmt/format.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "base/file_types.hpp"
#include "base/text.hpp"
#include "commands/commands.hpp"
#include "commands/made_file.hpp"
#include "describe/files.hpp"
#include "describe/fit_options.hpp"
#include "describe/notes.hpp"
#include "describe/picture_note.hpp"
#include "describe/provenance.hpp"
#include "describe/setting_option.hpp"
#include "explore/server.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/fit/fit_settings.hpp"
#include "qjulia/map/map_file.hpp"
#include "report/html.hpp"

namespace qjulia::tools {
namespace {

struct ExploreArguments {
  std::string input;
  std::string output;  ///< where a fit's map goes; empty: nowhere
  TrustedDevice device;
  FitOptions fit;
  bool opens = false;
  explore::ServerOptions options;
};

/// A fit of the mesh that pages watch. What it says goes to the console from the server's thread,
/// while this one waits.
explore::FitTask fit_task(const ExploreArguments& arguments, const Device& device,
                          Session& session) {
  const FitOptions& options = arguments.fit;
  options.validate();
  const FitOrigin origin = origin_of(options, fit_job(arguments.input, options));
  explore::FitTask task{session.read_mesh(arguments.input), options};
  task.on_progress = session.monitor().on_progress;
  task.on_end = [&arguments, &session, device, origin](FitResult& result) {
    result.map.provenance = provenance(origin, device, result);
    for (const std::string& warning : result.warnings) session.console.warn(warning);
    session.console.note(brief_summary(result));
    if (arguments.output.empty()) return;
    try {
      write_map(result.map, arguments.output);
      session.console.note("map: " + arguments.output);
    } catch (const OutputError& error) {
      if (session.stop().stop_requested()) throw;
      // The page still has the map.
      session.console.warn(error.what());
    }
  };
  return task;
}

explore::ServerOptions options_for(const ExploreArguments& arguments, const NamedMap& source) {
  explore::ServerOptions options = arguments.options;
  options.make_file = [source](const Device& device, const explore::ShownMap& shown,
                               const explore::MakeRequest& wanted, const ProgressMonitor& monitor) {
    return made_file(shown.is_first ? source : NamedMap{shown.file}, device, shown.map, wanted,
                     monitor);
  };
  return options;
}

std::unique_ptr<explore::Server> server_of(const ExploreArguments& arguments, const Device& device,
                                           Session& session) {
  if (!is_mesh_file(arguments.input)) {
    Map map = read_map(arguments.input, session.stop());
    NamedMap source{name_of(arguments.input)};
    // What came through a pipe is gone.
    std::error_code ignored;
    if (std::filesystem::is_regular_file(arguments.input, ignored)) {
      source.hash = file_hash(arguments.input);
    }
    return std::make_unique<explore::Server>(device, map, source.name,
                                             options_for(arguments, source));
  }
  const std::filesystem::path map =
      arguments.output.empty()
          ? std::filesystem::path(arguments.input).stem().string() + ".qjulia.json"
          : arguments.output;
  return std::make_unique<explore::Server>(device, fit_task(arguments, device, session),
                                           name_of(map), options_for(arguments, {name_of(map)}));
}

/// @throws InputError for options of a fit without a mesh.
void check_input(const ExploreArguments& arguments, Session& session) {
  if (is_mesh_file(arguments.input)) {
    if (arguments.output.empty()) return;
    check_map_name(arguments.output);
    return session.check_outputs({{arguments.input}, {{"--output", arguments.output}}});
  }
  if (arguments.output.empty() && !arguments.fit.factors && !arguments.fit.time_limit) return;
  throw InputError(fmt::format(
      "--output, --factors and --time-limit belong to a fit, which needs a mesh, but '{}' is a map",
      arguments.input));
}

/// A file for this user alone that leads a browser to an address. The words of a process are seen
/// by all users of the machine, and the address has a token.
class LeadingFile {
 public:
  /// @throws OutputError, std::filesystem::filesystem_error
  explicit LeadingFile(const std::string& address)
      : path_((std::filesystem::temp_directory_path() / "qjulia-XXXXXX.html").string()) {
    const int file = ::mkstemps(path_.data(), 5);  // the length of ".html"
    if (file < 0) throw OutputError(fmt::format("cannot make a temporary file: {}", path_));
    ::close(file);
    std::ofstream page(path_);
    page << fmt::format(
        "<!DOCTYPE html>\n<meta charset=\"utf-8\">\n<meta http-equiv=\"refresh\" content=\"0; "
        "url={}\">\n",
        html::escaped(address));
    page.close();
    if (page) return;
    remove();
    throw OutputError(fmt::format("cannot write '{}'", path_));
  }
  ~LeadingFile() { remove(); }
  LeadingFile(const LeadingFile&) = delete;
  LeadingFile& operator=(const LeadingFile&) = delete;

  const std::string& path() const { return path_; }

 private:
  void remove() const {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

  std::string path_;
};

/// Has the desktop open a file; where there is none, nothing happens.
void open_on_desktop(std::string path) {
  std::string program = "xdg-open";
  std::array<char*, 3> words{program.data(), path.data(), nullptr};
  // Signals that this program waits for are blocked in it, others ignored, and would stay so in the
  // browser.
  sigset_t none, ignored;
  ::sigemptyset(&none);
  ::sigemptyset(&ignored);
  ::sigaddset(&ignored, SIGPIPE);
  ::sigaddset(&ignored, SIGXFSZ);
  posix_spawnattr_t attributes;
  if (::posix_spawnattr_init(&attributes) != 0) return;
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setsigdefault(&attributes, &ignored);
  ::posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t child = 0;
  const int code =
      ::posix_spawnp(&child, program.c_str(), nullptr, &attributes, words.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  if (code == 0) std::thread([child] { ::waitpid(child, nullptr, 0); }).detach();
}

/// @return what must stay until the page has no more use.
std::unique_ptr<LeadingFile> open_page(const std::string& address, Session& session) {
  try {
    auto file = std::make_unique<LeadingFile>(address);
    open_on_desktop(file->path());
    return file;
  } catch (const std::exception& error) {
    session.console.warn(
        fmt::format("--open: {}; open the address yourself", base::message_of(error)));
    return nullptr;
  }
}

/// The view of a picture that is opened, as the end of the page's address.
std::string view_of(const std::string& input, const std::stop_token& stop) {
  std::error_code ignored;
  if (base::extension_of(input) != ".png" || !std::filesystem::is_regular_file(input, ignored))
    return {};
  try {
    const std::string state = page_state(embedded_note(input, stop).at("made_with"));
    return state.empty() ? state : fmt::format("#{}", state);
  } catch (const InputError&) {
    return {};  // it holds a map, and no note
  }
}

int run_explore(const ExploreArguments& arguments, Session& session) {
  arguments.options.validate();
  check_input(arguments, session);
  const Device device = session.open_device(arguments.device);
  const auto server = server_of(arguments, device, session);
  const std::string& host = arguments.options.host;
  if (!host.starts_with("127.") && host != "localhost" && host != "::1") {
    session.console.warn(
        "others on the network can reach this page, and whoever knows its address can use this "
        "device; nothing is encrypted");
  }
  const std::string address = server->address() + view_of(arguments.input, session.stop());
  session.console.result(address, {{"address", address}});
  session.console.note("open this address in a browser; Ctrl-C ends");
  const auto opened = arguments.opens ? open_page(address, session) : nullptr;
  const bool is_cut_short = server->run(session.stop());
  session.report_kernels(device);
  if (is_cut_short && arguments.output.empty()) throw Interrupted();
  return is_cut_short ? kInterrupted : kDone;
}

void describe_explore(Command command, ExploreArguments& a) {
  command
      .input("MAP|MESH", a.input,
             "Map file; a page, picture (.png) or scene (.glb) that holds one; or a mesh (" +
                 base::extension_list(base::FileContent::mesh, base::FileUse::read) +
                 "), which is fitted first, on the page")
      .offers_files(readable({base::FileContent::map, base::FileContent::mesh}));
  command
      .file("-o,--output", a.output, "MAP",
            "Map file to write when a mesh is fitted. Default: none")
      .offers_files({".json"});
  for (const char* name : {"factors", "time_limit"}) {
    const FitSetting& setting = fit_setting_named(name);
    add_setting(command, setting, setting.place(a.fit));
  }
  command.flag("--open", a.opens, "Open the page in the desktop's browser");
  command.add("--port", &a.options.port, "N", "Port of the page; 0: any that is free")
      .range(0, 65535);
  command.add("--host", &a.options.host, "ADDRESS",
              "Address of this machine to listen on. Any but 127.0.0.1, localhost and ::1 can be "
              "reached by whoever is on the network");
  command.flag("--keep-loose", a.options.keep_loose,
               "Draw all connected parts of the set, as 'qjulia render' does with it");
  add_device_to_use(command, a.device);
}

}  // namespace

void add_explore(CommandLine& program, ChosenCommand& chosen) {
  add_command(program, chosen,
              {"explore", "Play with a map in a browser", R"(Examples:
  qjulia explore bunny.qjulia.json --open
  qjulia explore bunny.obj --open          shows the fit as it runs
  qjulia explore bunny.png --open          opens the view of a picture that 'render' made
Prints the address of a page with a slider for every option of the map; this machine's device
draws. The page is for this machine alone, and its address has a token that nobody can guess.
'qjulia share' makes a page for others. See docs/guide/explore.md.)",
               /*can_trace=*/false},
              describe_explore, run_explore);
}

}  // namespace qjulia::tools

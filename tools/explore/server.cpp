#include "explore/server.hpp"

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <exception>
#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <random>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/text.hpp"
#include "explore/bounded_server.hpp"
#include "explore/page.hpp"
#include "explore/painter.hpp"
#include "explore/request.hpp"
#include "explore/turntable.hpp"
#include "explore/uploaded.hpp"
#include "explore/worker.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/morph/versor_transfer.hpp"

namespace qjulia::explore {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds kLastAnswers(1000);  ///< when the server ends
constexpr std::chrono::minutes kPictureLimit(5), kLongLimit(60);
constexpr std::size_t kLongestName = 64;  ///< a client's
constexpr const char* kTokenHeader = "X-Qjulia-Token";
constexpr const char* kStop = "/stop";        ///< what ends a fit
constexpr const char* kShape = "/shape";      ///< a mesh comes, whose exact map is shown
constexpr const char* kGrooves = "/grooves";  ///< a map comes, whose versor is taken
constexpr const char* kFirst = "/first";      ///< the server's own map is shown again
constexpr const char* kBrush = "/brush";      ///< the shown map is painted, or a copy planted on it
constexpr const char* kTakeBack = "/takeback";  ///< the last of these is undone
constexpr const char* kRefit = "/refit";        ///< a map is fitted to the mesh that came last
constexpr const char* kOwn = "";                ///< the client that no page can be

/// 32 hexadecimal digits that nobody can guess.
std::string random_token() {
  std::random_device bits;  // from the system
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", bits());
  return token;
}

/// In a time that does not tell where they differ.
bool are_equal(const std::string& a, const std::string& b) {
  return a.size() == b.size() && std::inner_product(a.begin(), a.end(), b.begin(), 0,
                                                    std::bit_or<>(), std::bit_xor<>()) == 0;
}

void refuse(httplib::Response& response, int status, const std::string& text) {
  response.status = status;
  response.set_content(text + "\n", "text/plain; charset=utf-8");
}

bool brings_file(const std::string& path) { return path == kShape || path == kGrooves; }

/// The time in which no other file is taken; it ends once, with `end` or with this object.
class Turn {
 public:
  explicit Turn(std::atomic<bool>& is_taking) : is_taking_(is_taking) {}
  ~Turn() { end(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  void end() {
    if (!has_ended_.exchange(true)) is_taking_ = false;
  }

 private:
  std::atomic<bool>& is_taking_;
  std::atomic<bool> has_ended_{false};
};

/// A socket's address.
struct Address {
  sockaddr_storage bytes{};
  socklen_t size = sizeof(bytes);

  sockaddr* get() { return reinterpret_cast<sockaddr*>(&bytes); }
};

/// With "_grooved", bunny.qjulia.json becomes bunny_grooved.qjulia.json; a name that has the mark
/// stays as it is.
std::string marked_name(const std::string& file, std::string_view mark) {
  const std::string name = file.substr(0, std::min(file.rfind(".qjulia"), file.rfind('.')));
  return fmt::format("{}{}.qjulia.json", name, name.find(mark) == std::string::npos ? mark : "");
}

/// The host as browsers name it: addresses in their shortest form, names in lower case.
std::string usual_form(const std::string& host) {
  addrinfo hints{};
  hints.ai_flags = AI_NUMERICHOST;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, &hints, &found) != 0) return base::lower_case(host);
  std::array<char, NI_MAXHOST> text{};
  const int code = ::getnameinfo(found->ai_addr, found->ai_addrlen, text.data(), text.size(),
                                 nullptr, 0, NI_NUMERICHOST);
  ::freeaddrinfo(found);
  return code == 0 ? text.data() : host;
}

/// Where to listen. A machine without /etc/hosts, such as a bare root file system, may not be able
/// to look up localhost.
std::string address_to_listen_on(const std::string& host) {
  if (host != "localhost") return host;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, nullptr, &found) != 0) return "127.0.0.1";
  ::freeaddrinfo(found);
  return host;
}

/// Ends all connections to a port of this process. The library waits for whoever still sends a
/// request, byte by byte.
void hang_up(int port) {
  std::error_code ignored;
  std::filesystem::directory_iterator entry("/proc/self/fd", ignored);
  for (; entry != std::filesystem::directory_iterator(); entry.increment(ignored)) {
    const auto file = base::number_in<int>(entry->path().filename().string());
    Address own, other;
    if (!file || ::getsockname(*file, own.get(), &own.size) != 0) continue;
    if (::getpeername(*file, other.get(), &other.size) != 0) continue;
    std::array<char, NI_MAXSERV> text{};
    const int code =
        ::getnameinfo(own.get(), own.size, nullptr, 0, text.data(), text.size(), NI_NUMERICSERV);
    if (code == 0 && text.data() == std::to_string(port)) ::shutdown(*file, SHUT_RDWR);
  }
}

}  // namespace

void ServerOptions::validate() const {
  if (port < 0 || port > 65535) throw OptionError("port", "give 0 to 65535");
  if (host.empty()) throw OptionError("host", "give an address of this machine, such as 127.0.0.1");
  if (const std::string usual = usual_form(host); usual == "0.0.0.0" || usual == "::") {
    throw OptionError("host", fmt::format("'{}' stands for all addresses of this machine; give the "
                                          "one that browsers will use",
                                          host));
  }
}

struct Server::Impl {
  using Work = Job::Work;

  /// What was shown before the brush changed it.
  struct Stroke {
    Layers layers;
    Provenance provenance;
    std::string file;
    bool was_first;
    std::vector<Eigen::Vector3d> outline;
  };
  static constexpr std::size_t kMostStrokes = 64;

  Impl(const Device& device, std::optional<FitTask> fit_task, const std::string& named,
       const ServerOptions& options)
      : host(usual_form(options.host)),
        name(host.find(':') == std::string::npos ? host : "[" + host + "]"),
        task(std::move(fit_task)),
        make_file(options.make_file),
        file(named),
        painter(device, task ? &task->mesh : nullptr, options.keep_loose) {
    route();
    const std::string address = address_to_listen_on(host);
    port = http.open(address, options.port);
    if (port > 0) return;
    if (httplib::Server().bind_to_any_port(address) > 0) {
      throw OptionError("port", fmt::format("{} of {} is in use{}; give another one, or 0 for any "
                                            "that is free",
                                            options.port, name,
                                            options.port < 1024 ? ", or kept for the system" : ""));
    }
    throw OptionError(
        "host",
        fmt::format("'{}' is no address of this machine; give one, such as 127.0.0.1", host));
  }

  std::vector<Eigen::Vector3d> outline_of(const Map& map) const {
    try {
      return page_outline(painter.device(), map);
    } catch (const Error&) {
      return box_outline(map);  // the page's first picture says what is wrong
    }
  }

  /// From now on the page is the map's. @param named the name of its file. @param mesh that a page
  /// has brought, if the map is of one. @param known the page's outline; empty: it is found.
  void show(const Map& map, const std::string& named,
            std::shared_ptr<const TriangleMesh> mesh = nullptr, bool is_the_first = false,
            std::vector<Eigen::Vector3d> known = {}) {
    painter.show(map);
    outline = known.empty() ? outline_of(map) : std::move(known);
    strokes.clear();
    const std::lock_guard lock(mutex);
    file = named;
    brought = std::move(mesh);
    is_first = is_the_first;
    page = served_page(map, file, outline);
    turned = [map, outline = outline](const Rotation& rotation) {
      return outline_json(turned_outline(map, outline, rotation));
    };
  }

  /// The fit with which the server begins, and with which it ends where that fails.
  void begin_fit() {
    page = fitting_page(file);
    awaits_fit = fit_runs = true;
    fit_job = worker.ask(kOwn, Job::Length::long_job, [this](Job& /*job*/) {
      try {
        first = {run_fit(), current_file()};
        const std::lock_guard lock(mutex);
        awaits_fit = false;
      } catch (...) {
        const std::lock_guard lock(mutex);
        failed = std::current_exception();
        changed.notify_all();
      }
      return std::string();
    });
  }

  /// A fit that a page asks for. Where it fails, pages show what they showed before.
  /// @return what is wrong; empty: it begins.
  std::string begin_refit() {
    const std::lock_guard lock(mutex);
    if (fit_runs) return "a fit runs already";
    if (is_taking) return "another file is being read; try again when its map is shown";
    if (is_brushing) return "the brush is at work; try again when its stroke is shown";
    if (!brought) return "there is no mesh to fit to: drop one on the page first";
    const auto job = worker.ask(kOwn, Job::Length::long_job,
                                [this, before = page, mesh = brought](Job& /*job*/) {
                                  refit(*mesh, before);
                                  return std::string();
                                });
    if (!job) return "too many pages are waiting, or the server is shutting down";
    fit_job = job;
    page = fitting_page(file);
    fit_runs = true;
    is_fitted = false;
    fit_problem.clear();
    fit_progress = {};
    stages = nlohmann::json::array();
    energies = {{}};
    fit_stop = {};
    return {};
  }

  /// The worker's work. @param before the page.
  void refit(const TriangleMesh& mesh, const std::string& before) {
    painter.show_mesh(nullptr);
    task = FitTask{mesh};
    painter.show_mesh(&task->mesh);
    const Map shown = painter.map();
    try {
      run_fit();
    } catch (const std::exception& error) {
      painter.show(shown);
      const std::lock_guard lock(mutex);
      page = before;
      fit_problem = error.what();
      fit_runs = false;
    }
  }

  void stop_fit() {
    const std::lock_guard lock(mutex);
    fit_stop.request_stop();
  }

  /// The worker's work, in which pictures come between. @return the map.
  Map run_fit() {
    const auto keep = [this](const auto& change) {
      {
        const std::lock_guard lock(mutex);
        change();
      }
      worker.draw_waiting();
    };
    ProgressMonitor monitor;
    monitor.stop = [&] {
      const std::lock_guard lock(mutex);
      return fit_stop.get_token();
    }();
    monitor.on_progress = [&](const Progress& progress) {
      if (task->on_progress) task->on_progress(progress);
      keep([&] { fit_progress = progress; });
    };
    FitOptions options = task->options;
    options.observer.on_evaluation = [&](double energy) {
      keep([&] {
        std::vector<double>& stage = energies.back();
        stage.push_back(stage.empty() ? energy : std::fmin(stage.back(), energy));
      });
    };
    options.observer.on_stage = [&](const StageReport& stage, const Map& map) {
      painter.show(map);
      keep([&] {
        stages.push_back({{"name", stage.name}, {"iou", stage.iou}});
        energies.emplace_back();
      });
    };
    FitResult result = fit(painter.device(), task->mesh, options, monitor);
    if (task->on_end) task->on_end(result);
    show(result.map, current_file());
    const std::lock_guard lock(mutex);
    is_fitted = true;
    fit_runs = false;
    return result.map;
  }

  /// How the fit stands, for its page.
  std::string fit_json() {
    const std::lock_guard lock(mutex);
    const bool has_failed = !fit_problem.empty();
    return nlohmann::json{{"state", is_fitted    ? "done"
                                    : has_failed ? "failed"
                                    : fit_runs   ? "runs"
                                                 : "none"},
                          {"problem", fit_problem},
                          {"activity", fit_progress.activity},
                          {"detail", fit_progress.detail},
                          {"fraction", fit_progress.fraction},
                          {"seconds_left", fit_progress.seconds_left},
                          {"stages", stages},
                          {"energies", energies}}
        .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  }

  /// Ends the fit with what it has reached, and draws no more pictures.
  void end_work() {
    worker.end();
    stop_fit();
    const auto last_fit = [&] {
      const std::lock_guard lock(mutex);
      return fit_job;
    }();
    while (last_fit && last_fit->wait(1s) == Job::End::waits) continue;
  }

  /// Whether a request's Host means this server; browsers leave out the usual port.
  bool is_own(const std::string& named) const {
    const auto is = [&](const std::string& own) {
      return named == fmt::format("{}:{}", own, port) || (port == 80 && named == own);
    };
    const bool is_loopback = host == "127.0.0.1" || host == "::1";
    return is(name) || (is_loopback && is("localhost"));
  }

  /// Whether the request may be answered; if not, it is refused.
  bool admits(const httplib::Request& request, httplib::Response& response) const {
    response.set_header("Cache-Control", "no-store");
    response.set_header("X-Content-Type-Options", "nosniff");
    response.set_header("Referrer-Policy", "no-referrer");
    response.set_header("Cross-Origin-Resource-Policy", "same-origin");
    response.set_header("X-Frame-Options", "DENY");
    const auto refused = [&](int status, const char* text) {
      refuse(response, status, text);
      return false;
    };
    const std::string named = base::lower_case(request.get_header_value("Host"));
    if (!is_own(named) || request.get_header_value_count("Host") != 1) {
      return refused(403, "this server has another name");
    }
    if (request.has_header("Origin") && request.get_header_value("Origin") != "http://" + named) {
      return refused(403, "requests of other sites are refused");
    }
    constexpr std::array<std::string_view, 7> kPosted{kStop,     kFirst, kRefit,  kBrush,
                                                      kTakeBack, kShape, kGrooves};
    const bool is_posted = std::ranges::count(kPosted, request.path) > 0;
    if (request.method != (is_posted ? "POST" : "GET")) {
      return refused(405, is_posted ? "use POST" : "use GET");
    }
    // A request may name a thousand ranges, and each would be answered with the whole page.
    if (!request.ranges.empty()) return refused(416, "answers are whole; ask without a range");
    if (has_body(request) && !brings_file(request.path)) {
      return refused(413, "this request has no body");
    }
    if (brings_file(request.path) && !has_short_body(request)) {
      return refused(413, "send one file of at most 64 MiB as it is");
    }
    if (!has_token(request)) {
      return refused(403, "open the address that 'qjulia explore' printed: it has the token");
    }
    return true;
  }

  static bool has_short_body(const httplib::Request& request) {
    const auto length = plain_body_length(request);
    return length && *length > 0 && *length <= Upload::kMostBytes;
  }

  bool takes_body(const httplib::Request& request) const {
    return request.method == "POST" && brings_file(request.path) && has_short_body(request) &&
           has_token(request);
  }

  bool has_token(const httplib::Request& request) const {
    return are_equal(token, request.path == "/" ? request.get_param_value("token")
                                                : request.get_header_value(kTokenHeader));
  }

  /// Has the worker do what a request asks for, and sends what comes of it: lines of how far it is
  /// ('~', a share, a text), then the bytes ('='), nothing because another request came ('-'), or
  /// what went wrong ('!').
  void answer(const httplib::Request& request, httplib::Response& response, Job::Length length,
              const std::function<Work(const Query&)>& read) {
    const std::string client = request.get_header_value("X-Qjulia-Client");
    if (client.empty() || client.size() > kLongestName) {
      return refuse(response, 400, "a request must say which page it comes from");
    }
    Work work;
    try {
      work = read(request.params);
    } catch (const InputError& error) {
      return refuse(response, 400, error.what());
    }
    // A map that is saved and the picture that is drawn do not end each other.
    const auto job = worker.ask(client + request.path, length, std::move(work));
    if (!job)
      return refuse(response, 503, "too many pages are waiting, or the server is shutting down");
    const auto until = std::chrono::steady_clock::now() +
                       (length == Job::Length::picture ? kPictureLimit : kLongLimit);
    response.set_chunked_content_provider(
        "application/octet-stream",
        [job, until](std::size_t /*offset*/, httplib::DataSink& sink) {
          std::string sent;
          // Looks now and then whether anybody still listens.
          Job::End end = job->wait(100ms);
          for (; end == Job::End::waits; end = job->wait(100ms)) {
            if (const std::string progress = job->progress(); progress != sent) {
              sent = progress;
              if (!sink.write(sent.data(), sent.size())) job->cancel();
            }
            if (!sink.is_writable() || std::chrono::steady_clock::now() > until) {
              job->cancel();
              return false;
            }
          }
          const std::string whole = job->progress() +
                                    (end == Job::End::done     ? "="
                                     : end == Job::End::failed ? "!"
                                                               : "-") +
                                    job->bytes();
          sink.write(whole.data(), whole.size());
          sink.done();
          return true;
        },
        [job](bool) { job->cancel(); });
  }

  /// Has the worker make a map of what a request brings, and show it.
  void answer_file(
      const httplib::Request& request, httplib::Response& response,
      const httplib::ContentReader& content,
      const std::function<void(const Upload&, const ProgressMonitor&)>& show_what_it_brings) {
    // One at a time, until its map is shown.
    if (is_taking.exchange(true)) return refuse(response, 503, "another file is being read");
    const auto turn = std::make_shared<Turn>(is_taking);
    Upload upload{harmless_name(request.get_param_value("name")), {}};
    const bool is_whole = content([&](const char* bytes, std::size_t count) {
      upload.bytes.append(bytes, count);
      return upload.bytes.size() <= Upload::kMostBytes;
    });
    if (!is_whole) return refuse(response, 400, "the file did not come whole");
    answer(request, response, Job::Length::long_job, [&](const Query& /*query*/) -> Work {
      return [this, turn, show_what_it_brings, upload = std::move(upload)](Job& job) {
        // Before the page hears of it.
        const std::shared_ptr<void> ending(nullptr, [&](void*) { turn->end(); });
        ProgressMonitor monitor;
        monitor.stop = job.stop();
        monitor.on_progress = [&](const Progress& progress) {
          job.report(progress);
          worker.draw_waiting();
        };
        show_what_it_brings(upload, monitor);
        return current_file();
      };
    });
  }

  void route_files() {
    http.Post(kShape, [this](const auto& request, auto& response, const auto& content) {
      answer_file(
          request, response, content, [this](const Upload& upload, const ProgressMonitor& monitor) {
            const auto mesh =
                std::make_shared<const TriangleMesh>(uploaded_mesh(upload, monitor.stop));
            const std::string stem = upload.name.substr(0, upload.name.rfind('.'));
            show(exact_map(painter.device(), *mesh, {}, monitor), stem + ".qjulia.json", mesh);
          });
    });
    http.Post(kGrooves, [this](const auto& request, auto& response, const auto& content) {
      answer_file(
          request, response, content, [this](const Upload& upload, const ProgressMonitor& monitor) {
            const Map grooves = uploaded_map(upload, monitor.stop);
            show(with_versor_of(painter.device(), painter.map(), grooves, kTransferCells, monitor),
                 marked_name(current_file(), "_grooved"));
          });
    });
    // This kind of handler gets a reader of the body, and reads nothing.
    http.Post(kFirst, [this](const auto& request, auto& response, const httplib::ContentReader&) {
      answer(request, response, Job::Length::long_job, [this](const Query& /*query*/) -> Work {
        return [this](Job& /*job*/) {
          if (first) show(first->first, first->second, nullptr, /*is_the_first=*/true);
          return std::string();
        };
      });
    });
  }

  /// The worker's: shows the map as the brush has changed it; what was brought stays.
  /// @param earlier the strokes that can be taken back afterwards.
  void show_brushed(const Map& map, const std::string& named, bool is_the_first,
                    std::vector<Stroke> earlier, std::vector<Eigen::Vector3d> known) {
    const auto mesh = [&] {
      const std::lock_guard lock(mutex);
      return brought;
    }();
    show(map, named, mesh, is_the_first, std::move(known));
    strokes = std::move(earlier);
  }

  /// The worker's.
  void brush(const BrushRequest& wanted, const ProgressMonitor& monitor) {
    const ShownMap shown = shown_map();
    std::vector<Stroke> earlier = strokes;
    if (earlier.size() == kMostStrokes) earlier.erase(earlier.begin());
    earlier.push_back(
        {shown.map.layers, shown.map.provenance, shown.file, shown.is_first, outline});
    // Paint changes the outline too little to move the camera for it.
    show_brushed(painter.brushed(wanted, monitor),
                 marked_name(shown.file, wanted.copy ? "_portals" : "_painted"), false,
                 std::move(earlier), wanted.copy ? std::vector<Eigen::Vector3d>{} : outline);
  }

  /// The worker's.
  void take_back() {
    if (strokes.empty()) throw InputError("there is no stroke or copy left to take back");
    std::vector<Stroke> earlier = strokes;
    const Stroke last = std::move(earlier.back());
    earlier.pop_back();
    Map map = painter.map();
    map.layers = last.layers;
    map.provenance = last.provenance;
    show_brushed(map, last.file, last.was_first, std::move(earlier), last.outline);
  }

  /// Has the worker change the map by the brush, and answers with the name of its file.
  void answer_brush(
      const httplib::Request& request, httplib::Response& response,
      const std::function<std::function<void(const ProgressMonitor&)>(const Query&)>& read) {
    answer(request, response, Job::Length::long_job, [&](const Query& query) -> Work {
      return [this, change = read(query)](Job& job) {
        const auto set_brushing = [this](bool is) {
          const std::lock_guard lock(mutex);
          if (is && fit_runs) throw InputError("a fit runs; use the brush when it has ended");
          is_brushing = is;
        };
        set_brushing(true);
        const std::shared_ptr<void> ending(nullptr, [&](void*) { set_brushing(false); });
        ProgressMonitor monitor;
        monitor.stop = job.stop();
        change(monitor);
        return current_file();
      };
    });
  }

  void route_brush() {
    // This kind of handler gets a reader of the body, and reads nothing.
    http.Post(kBrush, [this](const auto& request, auto& response, const httplib::ContentReader&) {
      answer_brush(request, response, [this](const Query& query) {
        return [this, wanted = read_brush(query)](const ProgressMonitor& monitor) {
          brush(wanted, monitor);
        };
      });
    });
    http.Post(kTakeBack,
              [this](const auto& request, auto& response, const httplib::ContentReader&) {
                answer_brush(request, response, [this](const Query& /*query*/) {
                  return [this](const ProgressMonitor& /*monitor*/) { take_back(); };
                });
              });
  }

  /// The worker's.
  ShownMap shown_map() {
    const std::lock_guard lock(mutex);
    return {painter.map(), file, is_first};
  }

  std::string current_file() {
    const std::lock_guard lock(mutex);
    return file;
  }

  void route() {
    route_files();
    route_brush();
    http.set_pre_routing_handler([this](const auto& request, auto& response) {
      return admits(request, response) ? httplib::Server::HandlerResponse::Unhandled
                                       : httplib::Server::HandlerResponse::Handled;
    });
    http.set_exception_handler([](const auto&, auto& response, std::exception_ptr) {
      refuse(response, 500, "this request could not be answered");
    });
    http.Get("/", [this](const auto&, auto& response) {
      const std::lock_guard lock(mutex);
      response.set_content(page, "text/html; charset=utf-8");
    });
    http.Get("/frame", [this](const auto& request, auto& response) {
      answer(request, response, Job::Length::picture, [this](const Query& query) -> Work {
        return [this, view = read_view(query)](Job& job) {
          ProgressMonitor monitor;
          monitor.stop = job.stop();
          monitor.on_progress = [&](const Progress& progress) { job.report(progress); };
          return painter.picture(view, monitor);
        };
      });
    });
    http.Get("/point", [this](const auto& request, auto& response) {
      answer(request, response, Job::Length::picture, [this](const Query& query) -> Work {
        return [this, view = read_view(query)](Job& job) {
          ProgressMonitor monitor;
          monitor.stop = job.stop();
          const auto point = painter.points(view, {view.at}, monitor).front();
          return point ? nlohmann::json{point->x(), point->y(), point->z()}.dump() : "null";
        };
      });
    });
    http.Get("/outline", [this](const auto& request, auto& response) {
      try {
        const MapKnobs knobs = read_view(request.params).knobs;
        knobs.validate();
        const std::lock_guard lock(mutex);
        if (!turned) return refuse(response, 404, "there is no map yet");
        response.set_content(turned(knobs.rotate.value_or(Rotation{})), "application/json");
      } catch (const OptionError& error) {
        refuse(response, 400, message_of(error));
      } catch (const InputError& error) {
        refuse(response, 400, error.what());
      }
    });
    http.Get("/map", [this](const auto& request, auto& response) {
      answer(request, response, Job::Length::picture, [this](const Query& query) -> Work {
        return [this, view = read_view(query)](Job& /*job*/) { return painter.map_file(view); };
      });
    });
    http.Get("/make", [this](const auto& request, auto& response) {
      answer(request, response, Job::Length::long_job, [this](const Query& query) -> Work {
        MakeRequest wanted = read_make(query);
        if (painter.keeps_loose()) wanted.view.picture.keep_loose = true;
        return [this, wanted](Job& job) {
          ProgressMonitor monitor;
          monitor.stop = job.stop();
          monitor.on_progress = [&](const Progress& progress) {
            job.report(progress);
            worker.draw_waiting();
          };
          // Pictures are drawn on the painter's device while slabs of a mesh are evaluated on
          // threads of their own.
          const Device device = painter.device().sibling();
          return wanted.is_turntable
                     ? turntable(device, painter.turned(wanted.view), wanted, monitor)
                     : make_file(device, shown_map(), wanted, monitor);
        };
      });
    });
    route_fits();
  }

  void route_fits() {
    http.Get("/fit", [this](const auto&, auto& response) {
      response.set_content(fit_json(), "application/json");
    });
    // This kind of handler gets a reader of the body, and reads nothing.
    http.Post(kStop, [this](const auto&, auto& response, const httplib::ContentReader&) {
      stop_fit();
      response.set_content("{}", "application/json");
    });
    http.Post(kRefit, [this](const auto&, auto& response, const httplib::ContentReader&) {
      response.set_content(nlohmann::json{{"problem", begin_refit()}}.dump(), "application/json");
    });
  }

  std::string host;
  std::string name;  // the host's, in addresses
  int port = 0;
  std::string token = random_token();
  std::optional<FitTask> task;
  FileMaker make_file;
  std::atomic<bool> is_taking{false};  // a file from a page
  std::optional<std::pair<Map, std::string>>
      first;                             // the server's own map and its file; the worker's
  std::vector<Eigen::Vector3d> outline;  // the worker's: of the map that is shown
  std::vector<Stroke> strokes;           // the worker's: those that can be taken back, oldest first
  std::mutex mutex;                      // guards the members below
  std::string file;                      // the map's
  std::string page;
  std::stop_source fit_stop;  // keeps what was reached
  std::shared_ptr<Job> fit_job;
  std::shared_ptr<const TriangleMesh> brought;  // by a page, and its exact map is shown
  bool is_brushing = false;                     // the worker changes the map just now
  bool is_first = false;                        // whether the server's own map is shown
  bool awaits_fit = false;                      // that with which the server begins
  bool fit_runs = false;
  std::string fit_problem;
  std::function<std::string(const Rotation&)> turned;  ///< the page's outline; none before a map
  std::exception_ptr failed;                           // the fit
  bool is_fitted = false;
  Progress fit_progress;
  nlohmann::json stages = nlohmann::json::array();
  std::vector<std::vector<double>> energies{{}};  // one list for each stage
  std::condition_variable_any changed;
  Painter painter;  // the worker's
  Worker worker;
  BoundedServer http{[this](const auto& request) { return has_token(request); },
                     [this](const auto& request) { return takes_body(request); }};
};

Server::Server(const Device& device, const Map& map, const std::string& file,
               const ServerOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(device, std::nullopt, file, options);
  impl_->first = {map, file};
  impl_->show(map, file, nullptr, /*is_the_first=*/true);
}

Server::Server(const Device& device, FitTask fit, const std::string& file,
               const ServerOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(device, std::move(fit), file, options);
  impl_->begin_fit();
}

Server::~Server() = default;

std::string Server::address() const {
  return fmt::format("http://{}:{}/?token={}", impl_->name, impl_->port, impl_->token);
}

bool Server::run(const std::stop_token& stop) {
  bool has_ended = false;
  const std::jthread listener([&] {
    impl_->http.listen_after_bind();
    const std::lock_guard lock(impl_->mutex);
    has_ended = true;
    impl_->changed.notify_all();
  });
  std::unique_lock lock(impl_->mutex);
  const auto ended = [&] { return has_ended; };
  impl_->changed.wait(lock, stop, [&] { return has_ended || impl_->failed; });
  const bool cuts_fit = impl_->awaits_fit && !impl_->failed;
  lock.unlock();
  impl_->end_work();
  lock.lock();
  // A server that does not listen yet cannot be told to stop.
  while (!impl_->http.is_running() && !impl_->changed.wait_for(lock, 1ms, ended)) continue;
  lock.unlock();
  impl_->http.stop();
  lock.lock();
  for (auto wait = kLastAnswers; !impl_->changed.wait_for(lock, wait, ended); wait = 100ms) {
    hang_up(impl_->port);
  }
  if (impl_->failed) std::rethrow_exception(impl_->failed);
  if (cuts_fit && impl_->awaits_fit) throw Interrupted();
  return cuts_fit;
}

}  // namespace qjulia::explore

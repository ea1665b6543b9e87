#include "explore/server.hpp"

#include <fmt/format.h>
#include <httplib.h>

#include <chrono>
#include <condition_variable>
#include <exception>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <random>
#include <thread>
#include <vector>

#include "explore/maker.hpp"
#include "explore/page.hpp"
#include "explore/painter.hpp"
#include "explore/request.hpp"
#include "explore/worker.hpp"
#include "qjulia/error.hpp"

namespace qjulia::explore {
namespace {

using namespace std::chrono_literals;

constexpr int kThreads = 128;  ///< connections that are read and written at a time
constexpr auto kReadLimit = 2s, kWriteLimit = 10s;
constexpr int kKeptAlive = 1;  ///< seconds that a connection waits for its next request
constexpr std::chrono::minutes kPictureLimit(5), kLongLimit(60);
constexpr std::size_t kLongestBody = 4096;  ///< no request has one
constexpr std::size_t kLongestName = 64;    ///< of a client
constexpr const char* kTokenHeader = "X-Qjulia-Token";
constexpr const char* kStop = "/stop";  ///< what ends a fit
constexpr const char* kOwn = "";        ///< the client that no page can be

/// 32 hexadecimal digits that nobody can guess.
std::string random_token() {
  std::random_device bits;  // of the system
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

}  // namespace

void ServerOptions::validate() const {
  if (port < 0 || port > 65535) throw OptionError("port", "give 0 to 65535");
  if (host.empty()) throw OptionError("host", "give an address of this machine, such as 127.0.0.1");
}

struct Server::Impl {
  using Work = Job::Work;

  Impl(const Device& device, std::optional<FitTask> fit_task, const std::string& named,
       const ServerOptions& options)
      : host(options.host),
        file(named),
        task(std::move(fit_task)),
        painter(device, task ? &task->mesh : nullptr, options.keep_loose) {
    http.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
    http.set_payload_max_length(kLongestBody);
    http.set_read_timeout(kReadLimit);
    http.set_write_timeout(kWriteLimit);
    http.set_keep_alive_timeout(kKeptAlive);
    http.set_tcp_nodelay(true);
    // Not the library's own, with which several servers could share a port.
    http.set_socket_options([](socket_t) {});
    route();
    port = options.port;
    if (port == 0)
      port = http.bind_to_any_port(host);
    else if (!http.bind_to_port(host, port))
      port = -1;
    if (port <= 0) {
      throw Error(fmt::format("cannot listen on {}:{}: it is taken, or not this machine's", host,
                              options.port));
    }
  }

  /// From now on the page is the map's.
  void show(const RationalMap& map) {
    painter.show(map);
    const std::lock_guard lock(mutex);
    page = served_page(map, file);
  }

  void begin_fit() {
    page = fitting_page(file);
    worker.ask(kOwn, Job::Length::many_pictures, [this](Job& /*job*/) {
      try {
        run_fit();
      } catch (...) {
        const std::lock_guard lock(mutex);
        failed = std::current_exception();
        changed.notify_all();
      }
      return std::string();
    });
  }

  /// The worker's work, in which pictures come between. What was reached is lost where the server
  /// ends.
  void run_fit() {
    const std::stop_callback at_end(ending.get_token(), [this] { fit_stop.request_stop(); });
    const auto keep = [this](const auto& change) {
      {
        const std::lock_guard lock(mutex);
        change();
      }
      worker.draw_waiting();
    };
    ProgressMonitor monitor;
    monitor.stop = fit_stop.get_token();
    monitor.on_progress = [&](const Progress& progress) {
      if (task->on_progress) task->on_progress(progress);
      keep([&] { fit_progress = progress; });
    };
    FitOptions options = task->options;
    options.observer.on_evaluation = [&](double energy) {
      keep([&] { energies.back().push_back(energy); });
    };
    options.observer.on_stage = [&](const StageReport& stage, const RationalMap& map) {
      painter.show(map);
      keep([&] {
        stages.push_back({{"name", stage.name}, {"iou", stage.iou}});
        energies.emplace_back();
      });
    };
    FitResult result = fit(painter.device(), task->mesh, options, monitor);
    throw_if_stopped(ending.get_token());
    if (task->on_end) task->on_end(result);
    show(result.map);
    const std::lock_guard lock(mutex);
    is_fitted = true;
  }

  /// How the fit stands, for its page.
  std::string fit_json() {
    const std::lock_guard lock(mutex);
    return nlohmann::json{{"state", is_fitted ? "done" : "runs"},
                          {"activity", fit_progress.activity},
                          {"detail", fit_progress.detail},
                          {"fraction", fit_progress.fraction},
                          {"seconds_left", fit_progress.seconds_left},
                          {"stages", stages},
                          {"energies", energies}}
        .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
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
    const std::string own = fmt::format("{}:{}", host, port);
    const std::string named = request.get_header_value("Host");
    const bool is_own =
        named == own || (host == "127.0.0.1" && named == fmt::format("localhost:{}", port));
    if (!is_own || request.get_header_value_count("Host") != 1) {
      return refused(403, "this server has another name");
    }
    if (request.has_header("Origin") && request.get_header_value("Origin") != "http://" + named) {
      return refused(403, "requests of other sites are refused");
    }
    if (request.method != (request.path == kStop ? "POST" : "GET")) {
      return refused(405, "this is not asked so");
    }
    // Of which a request may name a thousand, each answered with the whole page.
    if (!request.ranges.empty()) return refused(416, "answers are whole; ask without a range");
    const std::string given = request.path == "/" ? request.get_param_value("token")
                                                  : request.get_header_value(kTokenHeader);
    if (!are_equal(given, token)) {
      return refused(403, "open the address that 'qjulia explore' printed: it has the token");
    }
    return true;
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
    const auto job = worker.ask(client, length, std::move(work));
    if (!job) return refuse(response, 503, "too many pages are waiting");
    const auto until = std::chrono::steady_clock::now() +
                       (length == Job::Length::picture ? kPictureLimit : kLongLimit);
    response.set_chunked_content_provider(
        "application/octet-stream",
        [job, until](std::size_t /*offset*/, httplib::DataSink& sink) {
          std::string told;
          // Looks now and then whether anybody still listens.
          Job::End end = job->wait(100ms);
          for (; end == Job::End::waits; end = job->wait(100ms)) {
            if (const std::string progress = job->progress(); progress != told) {
              told = progress;
              if (!sink.write(told.data(), told.size())) job->cancel();
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

  void route() {
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
    http.Get("/map", [this](const auto& request, auto& response) {
      answer(request, response, Job::Length::picture, [this](const Query& query) -> Work {
        return [this, view = read_view(query)](Job& /*job*/) { return painter.map_file(view); };
      });
    });
    http.Get("/make", [this](const auto& request, auto& response) {
      answer(request, response, Job::Length::many_pictures, [this](const Query& query) -> Work {
        return [this, wanted = read_make(query)](Job& job) {
          const RationalMap map = painter.turned(wanted.view);
          ProgressMonitor monitor;
          monitor.stop = job.stop();
          monitor.on_progress = [&](const Progress& progress) {
            job.report(progress);
            worker.draw_waiting();
          };
          return made_file(painter.device(), map, wanted, monitor);
        };
      });
    });
    if (!task) return;
    http.Get("/fit", [this](const auto&, auto& response) {
      response.set_content(fit_json(), "application/json");
    });
    http.Post(kStop, [this](const auto&, auto& response) {
      fit_stop.request_stop();
      response.set_content("{}", "application/json");
    });
  }

  std::string host, file;
  int port = 0;
  std::string token = random_token();
  std::stop_source ending;
  std::optional<FitTask> task;
  std::stop_source fit_stop;  // keeps what was reached
  std::mutex mutex;           // of what follows
  std::string page;
  std::exception_ptr failed;  // the fit
  bool is_fitted = false;
  Progress fit_progress;
  nlohmann::json stages = nlohmann::json::array();
  std::vector<std::vector<double>> energies{{}};  // of each stage
  std::condition_variable_any changed;
  Painter painter;  // the worker's
  Worker worker;
  httplib::Server http;
};

Server::Server(const Device& device, const RationalMap& map, const std::string& file,
               const ServerOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(device, std::nullopt, file, options);
  impl_->show(map);
}

Server::Server(const Device& device, FitTask fit, const std::string& file,
               const ServerOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(device, std::move(fit), file, options);
  impl_->begin_fit();
}

Server::~Server() = default;

std::string Server::address() const {
  return fmt::format("http://{}:{}/?token={}", impl_->host, impl_->port, impl_->token);
}

void Server::run(const std::stop_token& stop) {
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
  const std::exception_ptr failed = stop.stop_requested() ? nullptr : impl_->failed;
  impl_->ending.request_stop();
  impl_->worker.end();
  // A server that does not listen yet cannot be told to stop.
  while (!impl_->http.is_running() && !impl_->changed.wait_for(lock, 1ms, ended)) continue;
  lock.unlock();
  impl_->http.stop();
  if (failed) std::rethrow_exception(failed);
}

}  // namespace qjulia::explore

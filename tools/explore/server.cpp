#include "explore/server.hpp"

#include <fmt/format.h>
#include <httplib.h>

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <random>
#include <thread>

#include "explore/page.hpp"
#include "explore/painter.hpp"
#include "explore/view_request.hpp"
#include "explore/worker.hpp"
#include "qjulia/error.hpp"

namespace qjulia::explore {
namespace {

using namespace std::chrono_literals;

constexpr int kThreads = 128;  ///< connections that are read and written at a time
constexpr auto kReadLimit = 2s, kWriteLimit = 10s;
constexpr int kKeptAlive = 1;  ///< seconds that a connection waits for its next request
constexpr auto kFrameLimit = std::chrono::minutes(5);
constexpr std::size_t kLongestBody = 4096;  ///< no request has one
constexpr std::size_t kLongestName = 64;    ///< of a client
constexpr const char* kTokenHeader = "X-Qjulia-Token";

/// 32 hexadecimal digits that nobody can guess.
std::string random_token() {
  std::random_device bits;  // of the system
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", bits());
  return token;
}

/// In a time that does not tell where they differ.
bool are_equal(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference |=
        static_cast<unsigned char>(a[i]) ^ static_cast<unsigned>(static_cast<unsigned char>(b[i]));
  }
  return difference == 0;
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
  Impl(const Device& device, const RationalMap& map, const std::string& file,
       const ServerOptions& options);

  void route(const std::string& file, const RationalMap& map);
  /// Whether the request may be answered; if not, it is refused.
  bool admits(const httplib::Request& request, httplib::Response& response) const;
  /// Has the worker do what a request asks for, and sends what comes of it: its first byte says
  /// whether that is it ('='), nothing because another request came ('-'), or what went wrong
  /// ('!').
  void answer(const httplib::Request& request, httplib::Response& response,
              std::string (*work)(Painter&, const ViewRequest&, const std::stop_token&));

  std::string host;
  int port = 0;
  std::string token = random_token();
  std::stop_source ending;
  Painter painter;  // the worker's
  Worker worker;
  httplib::Server http;
};

Server::Impl::Impl(const Device& device, const RationalMap& map, const std::string& file,
                   const ServerOptions& options)
    : host(options.host), painter(device, map, options.keep_loose, ending.get_token()) {
  http.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  http.set_payload_max_length(kLongestBody);
  http.set_read_timeout(kReadLimit);
  http.set_write_timeout(kWriteLimit);
  http.set_keep_alive_timeout(kKeptAlive);
  http.set_tcp_nodelay(true);
  // Not the library's own, with which several servers could share a port.
  http.set_socket_options([](socket_t) {});
  route(file, map);
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

bool Server::Impl::admits(const httplib::Request& request, httplib::Response& response) const {
  response.set_header("Cache-Control", "no-store");
  response.set_header("X-Content-Type-Options", "nosniff");
  response.set_header("Referrer-Policy", "no-referrer");
  response.set_header("Cross-Origin-Resource-Policy", "same-origin");
  response.set_header("X-Frame-Options", "DENY");
  const std::string own = fmt::format("{}:{}", host, port);
  const std::string named = request.get_header_value("Host");
  const bool is_own =
      named == own || (host == "127.0.0.1" && named == fmt::format("localhost:{}", port));
  if (!is_own || request.get_header_value_count("Host") != 1) {
    refuse(response, 403, "this server has another name");
    return false;
  }
  if (request.has_header("Origin") && request.get_header_value("Origin") != "http://" + named) {
    refuse(response, 403, "requests of other sites are refused");
    return false;
  }
  if (request.method != "GET") {
    refuse(response, 405, "only GET is answered");
    return false;
  }
  // Of which a request may name a thousand, each answered with the whole page.
  if (!request.ranges.empty()) {
    refuse(response, 416, "answers are whole; ask without a range");
    return false;
  }
  const bool is_page = request.path == "/";
  const std::string given =
      is_page ? request.get_param_value("token") : request.get_header_value(kTokenHeader);
  if (!are_equal(given, token)) {
    refuse(response, 403, "open the address that 'qjulia explore' printed: it has the token");
    return false;
  }
  return true;
}

void Server::Impl::answer(const httplib::Request& request, httplib::Response& response,
                          std::string (*work)(Painter&, const ViewRequest&,
                                              const std::stop_token&)) {
  const std::string client = request.get_header_value("X-Qjulia-Client");
  if (client.empty() || client.size() > kLongestName) {
    return refuse(response, 400, "a request must say which page it comes from");
  }
  ViewRequest view;
  try {
    view = read_view(request.params);
  } catch (const InputError& error) {
    return refuse(response, 400, error.what());
  }
  const auto job = worker.ask(client, [this, work, view](const std::stop_token& stop) {
    return work(painter, view, stop);
  });
  if (!job) return refuse(response, 503, "too many pages are waiting");
  const auto until = std::chrono::steady_clock::now() + kFrameLimit;
  response.set_chunked_content_provider(
      "application/octet-stream",
      [job, until](std::size_t /*offset*/, httplib::DataSink& sink) {
        // Looks now and then whether anybody still listens.
        Job::End end = job->wait(100ms);
        while (end == Job::End::waits) {
          if (!sink.is_writable() || std::chrono::steady_clock::now() > until) {
            job->cancel();
            return false;
          }
          end = job->wait(100ms);
        }
        const std::string whole = (end == Job::End::done     ? "="
                                   : end == Job::End::failed ? "!"
                                                             : "-") +
                                  job->bytes();
        sink.write(whole.data(), whole.size());
        sink.done();
        return true;
      },
      [job](bool) { job->cancel(); });
}

void Server::Impl::route(const std::string& file, const RationalMap& map) {
  http.set_pre_routing_handler([this](const auto& request, auto& response) {
    return admits(request, response) ? httplib::Server::HandlerResponse::Unhandled
                                     : httplib::Server::HandlerResponse::Handled;
  });
  http.set_exception_handler([](const auto&, auto& response, std::exception_ptr) {
    refuse(response, 500, "this request could not be answered");
  });
  http.Get("/", [page = served_page(map, file)](const auto&, auto& response) {
    response.set_content(page, "text/html; charset=utf-8");
  });
  http.Get("/frame", [this](const auto& request, auto& response) {
    answer(request, response,
           [](Painter& with, const ViewRequest& view, const std::stop_token& stop) {
             return with.picture(view, stop);
           });
  });
  http.Get("/map", [this](const auto& request, auto& response) {
    answer(request, response, [](Painter& with, const ViewRequest& view, const std::stop_token&) {
      return with.map_file(view);
    });
  });
}

Server::Server(const Device& device, const RationalMap& map, const std::string& file,
               const ServerOptions& options) {
  options.validate();
  impl_ = std::make_unique<Impl>(device, map, file, options);
}

Server::~Server() = default;

std::string Server::address() const {
  return fmt::format("http://{}:{}/?token={}", impl_->host, impl_->port, impl_->token);
}

void Server::run(const std::stop_token& stop) {
  std::mutex mutex;
  std::condition_variable_any changed;
  bool has_ended = false;
  const std::jthread listener([&] {
    impl_->http.listen_after_bind();
    const std::lock_guard lock(mutex);
    has_ended = true;
    changed.notify_all();
  });
  std::unique_lock lock(mutex);
  const auto ended = [&] { return has_ended; };
  changed.wait(lock, stop, ended);
  impl_->ending.request_stop();
  impl_->worker.end();
  // A server that does not listen yet cannot be told to stop.
  while (!impl_->http.is_running() && !changed.wait_for(lock, 1ms, ended)) continue;
  lock.unlock();
  impl_->http.stop();
}

}  // namespace qjulia::explore

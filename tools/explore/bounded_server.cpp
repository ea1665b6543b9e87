#include "explore/bounded_server.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <memory>
#include <semaphore>
#include <utility>

#include "base/text.hpp"

namespace qjulia::explore {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int kThreads = 128;                      ///< connections that are open at a time
constexpr int kMostRequests = 100;                 ///< of a connection, one after the other
constexpr std::size_t kLongestRequest = 32 << 10;  ///< its line and headers
/// How long a connection may wait before its next request, take to send one, and its body, leave an
/// answer unread, and go on sending what nobody reads.
constexpr std::chrono::milliseconds kIdleLimit(1000), kReadLimit(2000), kBodyLimit(60000),
    kWriteLimit(10000), kDropLimit(500);
/// A peer that acknowledges nothing for so long is gone: a machine that fell asleep sends nothing.
constexpr unsigned int kSilenceLimit = 20;  // seconds

/// @return those of the events that came; 0 if none came in that time. Errors are events too.
short wait_for(int socket, short events, Clock::time_point until) {
  pollfd waits{socket, events, 0};
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now()).count();
    const int count = ::poll(&waits, 1, static_cast<int>(std::max<std::int64_t>(left, 0)));
    if (count > 0) return waits.revents;
    if (count == 0 || errno != EINTR) return 0;
  }
}

/// A connection, for one request and its answer.
class RequestStream : public httplib::Stream {
 public:
  explicit RequestStream(int socket) : socket_(socket) {}

  /// After the headers: so many more bytes may be read.
  void expect_body(std::size_t length) {
    body_ = length - std::min(length, filled_ - used_);
    until_ = Clock::now() + kBodyLimit;
    has_headers_ = true;
  }

  bool is_readable() const override {
    const std::size_t room = has_headers_ ? body_ : bytes_.size() - filled_;
    return used_ < filled_ || (room > 0 && wait_for(socket_, POLLIN, until_) != 0);
  }
  /// Whether the client still waits for the answer and has not gone.
  bool is_writable() const override {
    return wait_for(socket_, POLLOUT | POLLRDHUP, Clock::now() + kWriteLimit) == POLLOUT;
  }
  ssize_t read(char* to, std::size_t size) override {
    if (used_ == filled_) {
      if (!is_readable()) return -1;
      if (has_headers_) return read_body(to, size);
      const ssize_t count = ::recv(socket_, bytes_.data() + filled_, bytes_.size() - filled_, 0);
      if (count <= 0) return -1;
      filled_ += static_cast<std::size_t>(count);
    }
    size = std::min(size, filled_ - used_);
    std::copy_n(bytes_.data() + used_, size, to);
    used_ += size;
    return static_cast<ssize_t>(size);
  }
  ssize_t write(const char* from, std::size_t size) override {
    if (!is_writable()) return -1;
    return ::send(socket_, from, size, MSG_NOSIGNAL);
  }
  void get_remote_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  void get_local_ip_and_port(std::string& /*ip*/, int& /*port*/) const override {}
  socket_t socket() const override { return socket_; }

 private:
  ssize_t read_body(char* to, std::size_t size) {
    const ssize_t count = ::recv(socket_, to, std::min(size, body_), 0);
    if (count > 0) body_ -= static_cast<std::size_t>(count);
    return count > 0 ? count : -1;
  }

  int socket_;
  Clock::time_point until_ = Clock::now() + kReadLimit;
  bool has_headers_ = false;
  std::size_t body_ = 0;  // that may still be read
  std::array<char, kLongestRequest> bytes_;
  std::size_t filled_ = 0, used_ = 0;
};

/// Threads for connections. While all are busy no more connections are accepted: they wait in the
/// system's queue.
class Threads : public httplib::TaskQueue {
 public:
  /// Nothing in older releases of the library, a bool in newer ones.
  using Queued = decltype(std::declval<httplib::TaskQueue&>().enqueue({}));

  Queued enqueue(std::function<void()> serve) override {
    free_.acquire();
    threads_.enqueue([this, serve = std::move(serve)] {
      serve();
      free_.release();
    });
    return Queued(true);
  }
  void shutdown() override { threads_.shutdown(); }

 private:
  std::counting_semaphore<kThreads> free_{kThreads};
  httplib::ThreadPool threads_{kThreads};
};

void end_when_silent(int socket) {
  constexpr int kOn = 1, kSeconds = kSilenceLimit / 2;
  constexpr unsigned int kMilliseconds = 1000 * kSilenceLimit;
  ::setsockopt(socket, SOL_SOCKET, SO_KEEPALIVE, &kOn, sizeof(kOn));
  ::setsockopt(socket, IPPROTO_TCP, TCP_KEEPIDLE, &kSeconds, sizeof(kSeconds));
  ::setsockopt(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, &kMilliseconds, sizeof(kMilliseconds));
}

/// Ends a connection. If it is closed with bytes unread, the peer discards the answer, so what
/// still comes is read for a while.
void hang_up_politely(int socket) {
  ::shutdown(socket, SHUT_WR);
  std::array<char, 4096> dropped;
  const auto until = Clock::now() + kDropLimit;
  while (Clock::now() < until && wait_for(socket, POLLIN, until) != 0 &&
         ::recv(socket, dropped.data(), dropped.size(), 0) > 0) {
  }
  ::close(socket);
}

}  // namespace

bool has_body(const httplib::Request& request) {
  return request.has_header("Transfer-Encoding") ||
         (request.has_header("Content-Length") &&
          request.get_header_value("Content-Length") != "0");
}

std::optional<std::size_t> plain_body_length(const httplib::Request& request) {
  for (const char* name : {"Transfer-Encoding", "Content-Encoding"}) {
    if (request.has_header(name)) return std::nullopt;
  }
  // The library would take a form apart.
  if (request.get_header_value("Content-Type").starts_with("multipart")) return std::nullopt;
  if (request.get_header_value_count("Content-Length") != 1) return std::nullopt;
  return base::number_in<std::size_t>(request.get_header_value("Content-Length"));
}

BoundedServer::BoundedServer(Asks keeps, Asks takes_body)
    : keeps_(std::move(keeps)), takes_body_(std::move(takes_body)) {
  new_task_queue = [] { return new Threads; };
  set_tcp_nodelay(true);
  // These replace the library's socket options, with which several servers could share a port. A
  // port that another server has just left can be used.
  set_socket_options([](socket_t listener) {
    constexpr int kOn = 1;
    ::setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &kOn, sizeof(kOn));
  });
  set_expect_100_continue_handler([](const auto& /*request*/, auto& response) {
    return response.status = 413;  // there is no body to wait for
  });
}

int BoundedServer::open(const std::string& host, int port) {
  if (port == 0)
    port = bind_to_any_port(host);
  else if (!bind_to_port(host, port))
    port = -1;
  // The library's queue holds five connections that wait to be accepted; more would get no answer.
  if (port > 0) ::listen(svr_sock_, kThreads);
  return port;
}

bool BoundedServer::process_and_close_socket(socket_t socket) {
  end_when_silent(socket);
  int left = kMostRequests;
  while (left > 0 && wait_for(socket, POLLIN, Clock::now() + kIdleLimit) == POLLIN) {
    if (!serve(*this, socket, --left == 0)) break;
  }
  hang_up_politely(socket);
  return true;
}

template <class Library>
bool BoundedServer::serve(Library& library, socket_t socket, bool is_last) {
  RequestStream stream(socket);
  bool is_kept = false, is_closed = false;
  const auto setup = [&](httplib::Request& request) {
    if (takes_body_(request)) stream.expect_body(plain_body_length(request).value_or(0));
    is_kept = !has_body(request) && keeps_(request);
    if (is_kept) return;
    request.headers.erase("Connection");
    request.set_header("Connection", "close");
  };
  bool is_answered = false;
  if constexpr (requires { library.process_request(stream, is_last, is_closed, setup); }) {
    is_answered = library.process_request(stream, is_last, is_closed, setup);
  } else {  // newer releases of the library want to know addresses, for handlers that ask
    is_answered = library.process_request(stream, "", 0, "", 0, is_last, is_closed, setup);
  }
  return is_answered && is_kept && !is_closed;
}

}  // namespace qjulia::explore

#pragma once
/// An HTTP server whose clients cannot take its memory or its threads, whatever they send.

#include <httplib.h>
#undef _res  // a macro of <resolv.h>, and a parameter of Eigen's

#include <functional>
#include <optional>
#include <string>

namespace qjulia::explore {

/// The library reads a line of a request, or a body, for as long as somebody sends it. Here a
/// request ends after so many bytes and so much time; no body is read that is not expected; and no
/// more connections are accepted than there are threads to serve them.
class BoundedServer : public httplib::Server {
 public:
  using Asks = std::function<bool(const httplib::Request&)>;

  /// @param keeps whether the connection of this request may bring another one. @param takes_body
  /// whether the body that this request announces may be read.
  BoundedServer(Asks keeps, Asks takes_body);

  /// Listens. @param port 0: any that is free. @return the port; -1 where it cannot.
  int open(const std::string& host, int port);

 private:
  bool process_and_close_socket(socket_t socket) override;
  /// Answers one request. @param library this server; its type selects the code for a release of
  /// the library.
  /// @return whether another one may follow.
  template <class Library>
  bool serve(Library& library, socket_t socket, bool is_last);

  Asks keeps_, takes_body_;
};

/// Whether a request announces a body.
bool has_body(const httplib::Request& request);

/// The length of a body that comes as it is and in one piece; none where there is no such body.
std::optional<std::size_t> plain_body_length(const httplib::Request& request);

}  // namespace qjulia::explore

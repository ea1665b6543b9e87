#pragma once
/// A page over HTTP, drawn by a device of this machine.

#include <functional>
#include <memory>
#include <stop_token>
#include <string>

#include "explore/request.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::explore {

struct ShownMap {
  Map map;
  std::string file;       ///< its name
  bool is_first = false;  ///< whether it is the map with which the server began
};

/// Makes a file of the map that a page shows. @return its bytes. @param monitor gets, at last, what
/// the file holds.
using FileMaker =
    std::function<std::string(const Device& device, const ShownMap& shown,
                              const MakeRequest& wanted, const ProgressMonitor& monitor)>;

struct ServerOptions {
  std::string host = "127.0.0.1";  ///< the address to listen on, by which browsers ask for it
  int port = 0;                    ///< 0: any that is free
  bool keep_loose = false;         ///< pictures show loose pieces too
  FileMaker make_file{};           ///< meshes and pictures to keep
  void validate() const;           ///< @throws OptionError
};

/// What is to be fitted, and who else hears of it.
struct FitTask {
  TriangleMesh mesh;
  FitOptions options{};
  std::function<void(const Progress&)> on_progress{};
  /// Unless it fails. It may add to the result.
  std::function<void(FitResult&)> on_end{};
};

/// Serves the page of one map. Every request needs the token that stands in the page's address,
/// names this server as its host, and comes from no other site. No file of the user's is read or
/// written for a request; a page may send one mesh or map at a time, which then takes the place of
/// what all pages show, and its brush changes that.
class Server {
 public:
  /// Listens. @param file the name of the map's file. @throws OptionError where it cannot listen
  /// there.
  Server(const Device& device, const Map& map, const std::string& file,
         const ServerOptions& options = {});
  /// Serves a page that shows a fit while it runs, then that of its map.
  Server(const Device& device, FitTask fit, const std::string& file,
         const ServerOptions& options = {});
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// Where the page is, with its token.
  std::string address() const;
  /// Answers requests until a stop is requested, which ends a fit with what it has reached.
  /// @return whether it did. @throws what else ends the fit; Interrupted where it has reached
  /// nothing.
  bool run(const std::stop_token& stop);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace qjulia::explore

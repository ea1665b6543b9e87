#pragma once
/// A map and the script of a short film.

#include <string>

#include "process.hpp"
#include "qjulia/map/map_file.hpp"
#include "temporary_folder.hpp"

namespace qjulia::test {

inline constexpr const char* kScript = R"([film]
map = "ball.qjulia.json"
seconds = 2
rate = 3
step = "linear"
[options]
size = "32x24"
samples = 1
material = "trap"
[[key]]
at = 0
azimuth = 0
detail = 0.01
[[key]]
at = 2
azimuth = 180
detail = 0.05
)";

struct FilmStudio {
  TemporaryFolder folder;
  std::string script = folder.file("turn.toml", kScript);

  FilmStudio() {
    Map ball;
    ball.dynamics.factors = {{{}, 12}, {{0.5, 0.3, 0, 0.2}, -1}};
    ball.frame.box = Box{{-1, -1, -1}, {1, 1, 1}};
    ball.frame.detail = 0.01;
    ball.frame.diagonal = 3.4;
    ball.frame.inradius = 1;
    write_map(ball, folder / "ball.qjulia.json");
  }

  /// The bytes of a picture.
  std::string frame(const std::string& pictures, int number) const {
    return read_text(folder / (pictures + "/frame_000" + std::to_string(number) + ".png"));
  }
};

}  // namespace qjulia::test

#include "commands/film_templates.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>

#include "qjulia/base/error.hpp"

namespace qjulia::tools {
namespace {

constexpr const char* kTurntable = R"(# Once around, in steady light. It loops without a seam.
#   qjulia film turntable.toml -o turntable.mp4
[film]
map = "bunny.qjulia.json"   # or a mesh; seen from this file
seconds = 8
rate = 25                   # pictures a second
step = "linear"             # from one key to the next: hold, linear, ease, spline or geodesic

[options]                   # any option of 'qjulia render', for the whole film
size = "960x720"
look = "gold"

[[key]]
at = 0                      # seconds
azimuth = 30

[[key]]
at = 8
azimuth = 390               # beyond 360: nothing takes a short cut
# lamp_turn = 30 in the first key and 390 here: the lamps go with the camera, and the shape turns
)";

constexpr const char* kDissolve = R"(# The shape dissolves and comes back.
[film]
map = "bunny.qjulia.json"
seconds = 8
step = "ease"

[options]
size = "960x720"

[loop]
drift = "ping-pong"         # hold, cycle, ping-pong or offset

[[key]]
at = 0
drift = 0

[[key]]
at = 4
drift = 1.0
)";

constexpr const char* kDive =
    R"(# Into a portal of the map, without an end: the last picture is followed by the first.
#   qjulia film dive.toml -o dive.mp4
[film]
seconds = 5                 # until everything looks as before, that many times as large

[film.map]                  # a map with portals, made first; or its name in [film], as in: map = "stack.qjulia.json"
command = "portals"
map = "bunny.qjulia.json"
count = 1
size = 0.2

[dive]
portal = 1                  # the portal to dive into
copies = 9                  # the film shows the pictures so often: 5^9 is 2 million times as large

[options]
size = "960x720"
iterations = 9              # the shape's, and one more for each copy on a copy
no_ground = true            # it would be seen behind some copies alone
azimuth = 30                # the dive finds distance and look_at; give them to change the picture
elevation = -5
)";

constexpr const char* kZoom = R"(# From the whole set into its surface. Zooms go by equal ratios.
[film]
map = "bunny.qjulia.json"
seconds = 10

[options]
size = "960x720"
look = "porcelain"

[[key]]
at = 0
step = "geodesic"           # pan and zoom so that the picture always moves equally fast
zoom = 1
azimuth = 20
look_at = [0, 0, 0]         # shape units

[[key]]
at = 10
zoom = 30
azimuth = 60
look_at = [-0.6, 0.5, 0.1]  # a place on the surface: 'render --aov' finds it
)";

constexpr const char* kBreathe =
    R"(# The surface grows wild and calms down again, while its pattern turns.
[film]
map = "bunny.qjulia.json"
seconds = 6
step = "ease"
loop = "ping-pong"

[options]
size = "960x720"
material = "trap"
palette = "ember"

[[key]]
at = 0
detail = 0.01
phase_i = 0                 # degrees: the phase is cos A + i sin A

[[key]]
at = 3
detail = 0.04
phase_i = 40
)";

const std::map<std::string, const char*>& templates() {
  static const std::map<std::string, const char*> all{{"turntable", kTurntable},
                                                      {"dissolve", kDissolve},
                                                      {"dive", kDive},
                                                      {"zoom", kZoom},
                                                      {"breathe", kBreathe}};
  return all;
}

}  // namespace

std::string film_template(const std::string& name) {
  const auto found = templates().find(name);
  if (found != templates().end()) return found->second;
  throw InputError(fmt::format("there is no template '{}'; give one of {}", name,
                               fmt::join(film_template_names(), ", ")));
}

std::vector<std::string> film_template_names() {
  std::vector<std::string> names;
  for (const auto& [name, text] : templates()) names.push_back(name);
  return names;
}

}  // namespace qjulia::tools

#pragma once
/// A folder with five meshes, an empty file and a manifest of quick fits, for tests of batches.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "obj_text.hpp"
#include "shapes.hpp"
#include "temporary_folder.hpp"

namespace qjulia::test {

/// Names of the fits that succeed; that of the empty file is "empty".
inline const std::vector<std::string> kGoodFits = {"ball", "box", "torus", "small", "wide"};

/// @param defaults more lines of [defaults].
/// @param evaluations of each fit: 40 take a tenth of a second.
/// @return the manifest's path.
inline std::string make_manifest(const TemporaryFolder& folder, const std::string& defaults = "",
                                 int evaluations = 40) {
  const auto write = [&](const std::string& name, const TriangleMesh& mesh) {
    folder.file(name + ".obj", obj_text(mesh));
  };
  write("ball", shapes::sphere(2));
  write("box", shapes::box());
  write("torus", shapes::torus());
  write("small", shapes::sphere(1, 0.1));
  write("wide", shapes::box({-1, -1, -1}, {3, 1, 0.5}));
  folder.file("empty.obj", "");
  return folder.file("m.toml",
                     "[defaults]\nfactors = 24\nmax_evaluations = " + std::to_string(evaluations) +
                         "\n" + defaults + "[[fit]]\nmesh = \"*.obj\"\n");
}

inline nlohmann::json read_summary(const std::string& folder) {
  return nlohmann::json::parse(read_text(folder + "/summary.json"));
}

inline std::string map_bytes(const std::string& folder, const std::string& name) {
  return read_text(folder + "/" + name + ".qjulia.json");
}

}  // namespace qjulia::test

#pragma once
/// Files that pages send: meshes and maps.

#include <stop_token>
#include <string>

#include "qjulia/map/map.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::explore {

struct Upload {
  static constexpr std::size_t kMostBytes = 64 << 20;

  std::string name;  ///< of the file in the browser; its extension says what it is
  std::string bytes;
};

/// The names of files come from browsers: what is no letter, digit, dot, - or _ becomes _, and long
/// names lose their beginning.
std::string harmless_name(const std::string& name);

/// @throws InputError naming the file: of a type that `read_mesh` does not read, or what that
/// throws.
TriangleMesh uploaded_mesh(const Upload& upload, const std::stop_token& stop = {});
/// @throws InputError naming the file, as `read_map` does.
Map uploaded_map(const Upload& upload, const std::stop_token& stop = {});

}  // namespace qjulia::explore

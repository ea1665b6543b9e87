#include "explore/make_request.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "base/range_check.hpp"
#include "explore/query_number.hpp"
#include "qjulia/error.hpp"
#include "qjulia/file_types.hpp"

namespace qjulia::explore {
namespace {

/// The value of a name that may be given once, taken out of the query.
std::optional<std::string> taken(Query& query, const std::string& name) {
  if (query.count(name) > 1) throw InputError(fmt::format("'{}' is given twice", name));
  const auto node = query.extract(name);
  if (node.empty()) return std::nullopt;
  return node.mapped();
}

template <class Number>
std::optional<Number> taken_number(Query& query, const std::string& name, Number least,
                                   Number most) {
  const auto text = taken(query, name);
  if (!text) return std::nullopt;
  const auto value = query_number<Number>(*text);
  base::expect_between(name.c_str(), value, least, most);
  return value;
}

}  // namespace

MakeRequest read_make(Query query) {
  MakeRequest made;
  const std::string what = taken(query, "make").value_or("");
  made.is_turntable = what == "turntable";
  made.extension = "." + what;
  const auto meshes = extensions(FileContent::mesh, FileUse::write);
  if (!made.is_turntable && std::ranges::count(meshes, made.extension) == 0) {
    throw InputError("make: give ply, obj, off, stl, glb or turntable");
  }
  made.surface.resolution =
      taken_number(query, "resolution", 16, MakeRequest::kMostCells).value_or(256);
  made.millimetres = taken_number(query, "millimetres", 1e-3, 1e5);
  made.frames = taken_number(query, "frames", 2, MakeRequest::kMostFrames).value_or(made.frames);
  made.view = read_view(query);
  made.surface.iterations = made.view.picture.iterations;
  const PictureOptions& picture = made.view.picture;
  if (made.extension == ".stl" && !picture.cuts.empty()) {
    throw InputError(
        "a set that is cut open is not closed, and cannot be printed: set x, y and z under 'Cut "
        "open' to 100, or make another file");
  }
  if (made.is_turntable &&
      picture.height > MakeRequest::kMostPixels / picture.width / made.frames) {
    throw InputError("so many pictures are too large for a page: give fewer, or a smaller size");
  }
  return made;
}

}  // namespace qjulia::explore

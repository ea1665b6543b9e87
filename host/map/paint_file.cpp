#include "map/paint_file.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "base/base64.hpp"
#include "base/deflate.hpp"

namespace qjulia::map {

nlohmann::json paint_json(const Paint& paint) {
  const std::string bytes(paint.shares.begin(), paint.shares.end());
  return {{"cells", paint.cells},
          {"origin", {paint.origin.x(), paint.origin.y(), paint.origin.z()}},
          {"step", paint.step},
          {"data", base::base64(base::deflated(bytes))}};
}

Paint read_paint(const Object& object) {
  object.expect_only(std::array<std::string_view, 4>{"cells", "origin", "step", "data"});
  Paint paint;
  paint.cells = object.integers("cells");
  paint.origin = object.vector("origin");
  paint.step = object.number("step");
  // Before anything is allocated: what the cells ask for.
  for (const int along : paint.cells) {
    if (along >= Paint::kFewestCells && along <= Paint::kMostCells) continue;
    object.refuse(fmt::format("has impossible \"cells\": {} to {} along each side, and {} in all",
                              Paint::kFewestCells, Paint::kMostCells, Paint::kMostInAll));
  }
  if (paint.size() > Paint::kMostInAll) {
    object.refuse(fmt::format("has {} \"cells\" in all: at most {} are allowed", paint.size(),
                              Paint::kMostInAll));
  }
  const std::optional<std::string> packed = base::from_base64(object.text("data"));
  if (!packed) object.refuse("has \"data\" that is not base64");
  const auto bytes = base::inflated(*packed, paint.size());
  if (!bytes) {
    object.refuse(fmt::format(
        "has \"data\" that is not a zlib stream of the {} bytes that its \"cells\" ask for",
        paint.size()));
  }
  paint.shares.assign(bytes->begin(), bytes->end());
  return paint;
}

}  // namespace qjulia::map

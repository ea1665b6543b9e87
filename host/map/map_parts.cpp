#include "base/base64.hpp"
#include "base/deflate.hpp"
#include "map/leaves.hpp"

namespace qjulia::map {

using nlohmann::json;

std::string text_of_bytes(const std::string& bytes) { return base::base64(base::deflated(bytes)); }

std::string bytes_of_text(const Object& object, std::size_t size, const char* keys) {
  const auto data = base::from_base64(object.text("data"));
  if (!data) object.refuse("has \"data\" that is not base64");
  auto bytes = base::inflated(*data, size);
  if (!bytes) {
    object.refuse(fmt::format(
        "has \"data\" that is not a zlib stream of the {} bytes that its {} ask for", size, keys));
  }
  return *std::move(bytes);
}

bool are_within(const std::array<int, 3>& cells, int fewest, int most) {
  return std::ranges::all_of(cells, [&](int along) { return along >= fewest && along <= most; });
}

json json_of(const Quaternion& q) { return coordinates(q); }
json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json json_of(const Paint& paint) {
  return {{"cells", paint.cells},
          {"origin", json_of(paint.origin)},
          {"step", paint.step},
          {"data", text_of_bytes(std::string(paint.shares.begin(), paint.shares.end()))}};
}

json json_of(const std::vector<Portal>& portals) {
  json all = json::array();
  for (const Portal& portal : portals) {
    json one = {
        {"center", json_of(portal.center)}, {"radius", portal.radius}, {"scale", portal.scale}};
    const auto& [axis, degrees] = portal.rotation;
    if (portal.rotation != Rotation{}) one["rotation"] = {axis.x(), axis.y(), axis.z(), degrees};
    if (portal.destination != Eigen::Vector3d::Zero()) {
      one["destination"] = json_of(portal.destination);
    }
    if (portal.mask != PortalMask::none) one["mask"] = word_of(portal.mask);
    all.push_back(one);
  }
  return all;
}

void read(const Object& map, const char* key, Quaternion& q) { q = map.quaternion(key); }

void read(const Object& map, const char* key, Paint& paint) {
  const Object object = map.object(key);
  object.expect_only({"cells", "origin", "step", "data"});
  paint.cells = object.integers("cells");
  paint.origin = object.vector("origin");
  paint.step = object.number("step");
  // Before anything is allocated: what the cells ask for.
  if (!are_within(paint.cells, Paint::kFewestCells, Paint::kMostCells)) {
    object.refuse(fmt::format("has impossible \"cells\": {} to {} along each side, and {} in all",
                              Paint::kFewestCells, Paint::kMostCells, Paint::kMostInAll));
  }
  if (paint.size() > Paint::kMostInAll) {
    object.refuse(fmt::format("has {} \"cells\" in all: at most {} are allowed", paint.size(),
                              Paint::kMostInAll));
  }
  const std::string bytes = bytes_of_text(object, paint.size(), "\"cells\"");
  paint.shares.assign(bytes.begin(), bytes.end());
}

void read(const Object& map, const char* key, std::vector<Portal>& portals) {
  const std::size_t count = map.array(key).size();
  if (count > kMostPortals) {  // before they are read
    map.refuse(fmt::format("\"portals\" has {}: a map may have {}", count, kMostPortals));
  }
  map.for_each(key, [&](const Object& object) {
    object.expect_only({"center", "radius", "scale", "rotation", "destination", "mask"});
    Portal portal;
    portal.center = object.vector("center");
    portal.radius = object.number("radius");
    portal.scale = object.number("scale");
    if (object.has("rotation")) {
      const Quaternion rotation = object.quaternion("rotation");
      portal.rotation = {{rotation.x, rotation.y, rotation.z}, rotation.w};
    }
    if (object.has("destination")) portal.destination = object.vector("destination");
    if (object.has("mask")) read(object, "mask", portal.mask);
    portals.push_back(portal);
  });
}

}  // namespace qjulia::map

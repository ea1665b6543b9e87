#include "map/map_parts.hpp"

#include <cstdint>
#include <initializer_list>
#include <memory>

#include "base/base64.hpp"
#include "base/deflate.hpp"

namespace qjulia::map {
namespace {

using nlohmann::json;

const char* to_string(FourthCoordinate fourth) {
  return fourth == FourthCoordinate::round ? "round" : "ignored";
}

const char* to_string(NoiseValues values) {
  return values == NoiseValues::vectors ? "vectors" : "quaternions";
}

/// The one of `values` whose name stands under `key`. @throws InputError with `problem`.
template <class Value>
Value named(const Object& object, const char* key, std::initializer_list<Value> values,
            const char* problem) {
  const std::string name = object.text(key);
  for (const Value value : values) {
    if (name == to_string(value)) return value;
  }
  object.refuse(problem);
}

std::string packed_text(const std::string& bytes) { return base::base64(base::deflated(bytes)); }

/// What is packed under "data". @param size bytes that `keys` ask for.
std::string unpacked(const Object& object, std::size_t size, const char* keys) {
  const auto data = base::from_base64(object.text("data"));
  if (!data) object.refuse("has \"data\" that is not base64");
  auto bytes = base::inflated(*data, size);
  if (!bytes) {
    object.refuse(fmt::format(
        "has \"data\" that is not a zlib stream of the {} bytes that its {} ask for", size, keys));
  }
  return *std::move(bytes);
}

using Numbers = std::vector<std::int16_t>;

/// Each number as its difference from the one before, modulo 2^16: all low bytes, then all high
/// ones. Smooth fields then have few different bytes.
void add_planes(std::string& bytes, const Numbers& numbers) {
  const std::size_t begin = bytes.size();
  bytes.resize(begin + 2 * numbers.size());
  unsigned before = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto now = static_cast<std::uint16_t>(numbers[i]);
    const unsigned difference = now - before;
    bytes[begin + i] = static_cast<char>(difference & 255U);
    bytes[begin + numbers.size() + i] = static_cast<char>(difference >> 8U & 255U);
    before = now;
  }
}

Numbers numbers_in_planes(std::string_view bytes) {
  Numbers numbers(bytes.size() / 2);
  unsigned before = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const unsigned low = static_cast<unsigned char>(bytes[i]);
    const unsigned high = static_cast<unsigned char>(bytes[numbers.size() + i]);
    before += low | high << 8U;
    numbers[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(before));
  }
  return numbers;
}

/// One bit a coarse cell, the first in the lowest bit of the first byte.
std::string mask_of(const DistanceGridData& data) {
  std::string mask((data.coarse.size() + 7) / 8, '\0');
  for (const std::uint32_t block : data.blocks) {
    mask[block / 8] =
        static_cast<char>(static_cast<unsigned char>(mask[block / 8]) | 1U << (block % 8));
  }
  return mask;
}

std::vector<std::uint32_t> blocks_in(std::string_view mask) {
  std::vector<std::uint32_t> blocks;
  for (std::uint32_t block = 0; block < 8 * mask.size(); ++block) {
    if ((static_cast<unsigned char>(mask[block / 8]) >> (block % 8) & 1U) != 0) {
      blocks.push_back(block);
    }
  }
  return blocks;
}

bool are_within(const std::array<int, 3>& cells, int fewest, int most) {
  return std::ranges::all_of(cells, [&](int along) { return along >= fewest && along <= most; });
}

}  // namespace

json json_of(const Quaternion& q) { return coordinates(q); }
json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json json_of(const DistanceModulus& distance) {
  const DistanceGridData& data = distance.grid->data();
  std::string bytes;
  add_planes(bytes, data.coarse);
  bytes += mask_of(data);
  add_planes(bytes, data.corrections);
  return {{"cells", data.cells},           {"origin", json_of(distance.origin)},
          {"step", distance.step},         {"shell", distance.shell},
          {"inradius", distance.inradius}, {"fourth", to_string(distance.fourth)},
          {"blocks", data.blocks.size()},  {"data", packed_text(bytes)}};
}

json json_of(const NoiseVersor& noise) {
  return {{"octaves", noise.octaves},
          {"scale", noise.scale},
          {"seed", noise.seed},
          {"values", to_string(noise.values)},
          {"origin", json_of(noise.origin)}};
}

json json_of(const Paint& paint) {
  return {{"cells", paint.cells},
          {"origin", json_of(paint.origin)},
          {"step", paint.step},
          {"data", packed_text(std::string(paint.shares.begin(), paint.shares.end()))}};
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
    if (portal.mask != PortalMask::none) one["mask"] = to_string(portal.mask);
    all.push_back(one);
  }
  return all;
}

void read(const Object& map, const char* key, Quaternion& q) { q = map.quaternion(key); }

void read(const Object& map, const char* key, DistanceModulus& distance) {
  const Object object = map.object(key);
  object.expect_only({"cells", "origin", "step", "shell", "inradius", "fourth", "blocks", "data"});
  distance.origin = object.vector("origin");
  distance.step = object.number("step");
  distance.shell = object.number("shell");
  distance.inradius = object.number("inradius");
  distance.fourth = named(object, "fourth", {FourthCoordinate::round, FourthCoordinate::ignored},
                          "has a \"fourth\" that is neither \"round\" nor \"ignored\"");
  DistanceGridData data;
  data.cells = object.integers("cells");
  const int blocks = object.integer("blocks");
  if (!are_within(data.cells, DistanceGrid::kFewestCells, DistanceGrid::kMostCells) || blocks < 0 ||
      static_cast<std::size_t>(blocks) > data.coarse_size()) {
    object.refuse(
        fmt::format("has impossible \"cells\" or \"blocks\": {} to {} cells along each "
                    "side, and at most one block for 64 cells",
                    DistanceGrid::kFewestCells, DistanceGrid::kMostCells));
  }
  const std::size_t coarse = 2 * data.coarse_size();
  const std::size_t mask = (data.coarse_size() + 7) / 8;
  const std::size_t corrections = 2 * DistanceGridData::kBlock * static_cast<std::size_t>(blocks);
  const std::string bytes =
      unpacked(object, coarse + mask + corrections, "\"cells\" and \"blocks\"");
  const std::string_view all = bytes;
  data.coarse = numbers_in_planes(all.substr(0, coarse));
  data.blocks = blocks_in(all.substr(coarse, mask));
  data.corrections = numbers_in_planes(all.substr(coarse + mask));
  try {
    distance.grid = std::make_shared<const DistanceGrid>(std::move(data));
    distance.validate();
  } catch (const InputError& error) {
    object.refuse(fmt::format("is wrong: {}", error.what()));
  }
}

void read(const Object& map, const char* key, NoiseVersor& noise) {
  const Object object = map.object(key);
  object.expect_only({"octaves", "scale", "seed", "values", "origin"});
  noise.octaves = object.integer("octaves");
  noise.scale = object.number("scale");
  const double seed = object.number("seed");
  if (!(seed >= 0 && seed <= std::numeric_limits<std::uint32_t>::max()) ||
      seed != std::floor(seed)) {
    object.refuse("has a \"seed\" that is no whole number from 0 to 4294967295");
  }
  noise.seed = static_cast<std::uint32_t>(seed);
  noise.values = named(object, "values", {NoiseValues::vectors, NoiseValues::quaternions},
                       "has \"values\" that are neither \"vectors\" nor \"quaternions\"");
  noise.origin = object.vector("origin");
}

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
  const std::string bytes = unpacked(object, paint.size(), "\"cells\"");
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
    if (object.has("mask")) {
      portal.mask =
          named(object, "mask", {PortalMask::none, PortalMask::outside, PortalMask::inside},
                "has a \"mask\" that is none of \"none\", \"outside\" and \"inside\"");
    }
    portals.push_back(portal);
  });
}

}  // namespace qjulia::map

#include "map/distance_file.hpp"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "base/base64.hpp"
#include "base/deflate.hpp"

namespace qjulia::map {
namespace {

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

const char* name_of(FourthCoordinate fourth) {
  return fourth == FourthCoordinate::round ? "round" : "ignored";
}

}  // namespace

nlohmann::json distance_json(const DistanceModulus& distance) {
  const DistanceGridData& data = distance.grid->data();
  std::string bytes;
  add_planes(bytes, data.coarse);
  bytes += mask_of(data);
  add_planes(bytes, data.corrections);
  return {{"cells", data.cells},
          {"origin", {distance.origin.x(), distance.origin.y(), distance.origin.z()}},
          {"step", distance.step},
          {"shell", distance.shell},
          {"inradius", distance.inradius},
          {"fourth", name_of(distance.fourth)},
          {"blocks", data.blocks.size()},
          {"data", base::base64(base::deflated(bytes))}};
}

DistanceModulus read_distance(const Object& object) {
  object.expect_only(std::array<std::string_view, 8>{"cells", "origin", "step", "shell", "inradius",
                                                     "fourth", "blocks", "data"});
  DistanceModulus distance;
  distance.origin = object.vector("origin");
  distance.step = object.number("step");
  distance.shell = object.number("shell");
  distance.inradius = object.number("inradius");
  const std::string fourth = object.text("fourth");
  if (fourth != name_of(FourthCoordinate::round)) {
    if (fourth != name_of(FourthCoordinate::ignored)) {
      object.refuse("has a \"fourth\" that is neither \"round\" nor \"ignored\"");
    }
    distance.fourth = FourthCoordinate::ignored;
  }

  DistanceGridData data;
  data.cells = object.integers("cells");
  const bool in_range = std::ranges::all_of(data.cells, [](int cells) {
    return cells >= DistanceGrid::kFewestCells && cells <= DistanceGrid::kMostCells;
  });
  const int blocks = object.integer("blocks");
  if (!in_range || blocks < 0 || static_cast<std::size_t>(blocks) > data.coarse_size()) {
    object.refuse(
        fmt::format("has impossible \"cells\" or \"blocks\": {} to {} cells along each "
                    "side, and at most one block for 64 cells",
                    DistanceGrid::kFewestCells, DistanceGrid::kMostCells));
  }
  const std::size_t coarse = 2 * data.coarse_size();
  const std::size_t mask = (data.coarse_size() + 7) / 8;
  const std::size_t corrections = 2 * DistanceGridData::kBlock * static_cast<std::size_t>(blocks);
  const std::optional<std::string> packed = base::from_base64(object.text("data"));
  if (!packed) object.refuse("has \"data\" that is not base64");
  const auto bytes = base::inflated(*packed, coarse + mask + corrections);
  if (!bytes) {
    object.refuse(
        fmt::format("has \"data\" that is not a zlib stream of the {} bytes that its "
                    "\"cells\" and \"blocks\" ask for",
                    coarse + mask + corrections));
  }
  const std::string_view all = *bytes;
  data.coarse = numbers_in_planes(all.substr(0, coarse));
  data.blocks = blocks_in(all.substr(coarse, mask));
  data.corrections = numbers_in_planes(all.substr(coarse + mask));
  try {
    distance.grid = std::make_shared<const DistanceGrid>(std::move(data));
    distance.validate();
  } catch (const InputError& error) {
    object.refuse(fmt::format("is wrong: {}", error.what()));
  }
  return distance;
}

}  // namespace qjulia::map

#include <cmath>
#include <limits>

#include "map/checks.hpp"
#include "map/kinds/distance_modulus_parts.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

bool DistanceModulus::operator==(const DistanceModulus& other) const {
  const bool same_grid =
      grid == other.grid || (grid && other.grid && grid->data() == other.grid->data());
  return same_grid && origin == other.origin && step == other.step && shell == other.shell &&
         inradius == other.inradius && fourth == other.fourth;
}

void DistanceModulus::validate() const {
  if (!grid) throw InputError("the map's distance has no grid");
  map::check_length("distance.step", step);
  map::check_length("distance.shell", shell);
  map::check_length("distance.inradius", inradius);
  map::check_origin("distance.origin", origin);
}

/// Far out F grows as ‖q‖.
double DistanceModulus::degree(const Dynamics& /*map*/) const {
  return std::numeric_limits<double>::infinity();
}

/// With R the radius of a ball about the origin that holds the inside, d(x) ≥ ‖x‖ − R, because
/// the segment from x away from the origin, or towards it, has a point of the surface no farther
/// off; and so d₄(q) ≥ ‖q‖ − R. The radius where (r − R)/δ + S = ln r is found by bisection. A cell
/// is added for what the spline differs from the distance.
OuterBound DistanceModulus::outer_bound(const Dynamics& map) const {
  validate();
  if (fourth == FourthCoordinate::ignored) return {std::numeric_limits<double>::infinity(), true};
  const Eigen::Vector3d center = -origin / step;
  const double reach = step * (1 + grid->farthest_inside({center.x(), center.y(), center.z()}));
  const auto excess = [&](double r) { return (r - reach) / shell + map.log_scale - std::log(r); };
  // Beyond δ it rises.
  double low = std::max(reach, shell), high = low;
  for (double more = shell; excess(high) <= 0; more *= 2) high += more;
  for (int halving = 0; halving < 50; ++halving) {
    const double middle = 0.5 * (low + high);
    (excess(middle) > 0 ? high : low) = middle;
  }
  return {high, true};
}

}  // namespace qjulia

namespace qjulia::map {
namespace {

using nlohmann::json;

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

}  // namespace

using GridLeaf = KeyedLeaf<std::shared_ptr<const DistanceGrid>>;

json GridLeaf::json_of(const std::shared_ptr<const DistanceGrid>& grid) {
  const DistanceGridData& data = grid->data();
  std::string bytes;
  add_planes(bytes, data.coarse);
  bytes += mask_of(data);
  add_planes(bytes, data.corrections);
  return {{"cells", data.cells}, {"blocks", data.blocks.size()}, {"data", text_of_bytes(bytes)}};
}

void GridLeaf::read(const Object& object, std::shared_ptr<const DistanceGrid>& grid) {
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
      bytes_of_text(object, coarse + mask + corrections, "\"cells\" and \"blocks\"");
  const std::string_view all = bytes;
  data.coarse = numbers_in_planes(all.substr(0, coarse));
  data.blocks = blocks_in(all.substr(coarse, mask));
  data.corrections = numbers_in_planes(all.substr(coarse + mask));
  try {
    grid = std::make_shared<const DistanceGrid>(std::move(data));
  } catch (const InputError& error) {
    object.refuse(fmt::format("is wrong: {}", error.what()));
  }
}

}  // namespace qjulia::map

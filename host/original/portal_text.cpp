#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/input_file.hpp"
#include "base/text.hpp"
#include "original/original_file.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::original {
namespace {

constexpr const char* kBlanks = " \t\r";

[[noreturn]] void refuse_portals(const std::string& source, const std::string& what) {
  throw InputError(fmt::format("portals '{}': {}", source, what));
}

/// A line of "name: numbers".
struct PortalLine {
  const std::string& source;
  std::size_t number;  ///< from 1
  std::string_view name{}, words{};

  [[noreturn]] void refuse(const std::string& what) const {
    refuse_portals(source, fmt::format("line {} {}", number, what));
  }

  /// `count` finite numbers, and no more.
  std::vector<double> numbers(std::size_t count) const {
    std::vector<double> values;
    std::string_view rest = words;
    for (;;) {
      rest.remove_prefix(std::min(rest.find_first_not_of(kBlanks), rest.size()));
      if (rest.empty()) break;
      double value = 0;
      const auto [end, code] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
      if (code != std::errc{} || !std::isfinite(value)) refuse("has a word that is no number");
      rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
      values.push_back(value);
    }
    if (values.size() != count) {
      refuse(fmt::format("has {} numbers where {} are needed", values.size(), count));
    }
    return values;
  }
};

}  // namespace

std::vector<Portal> portals_from_text(std::string_view text, const std::string& source,
                                      const ShapeToMap& to_map) {
  std::optional<double> radius, scale;
  std::vector<Portal> portals;
  PortalLine line{source, 0};
  for (const std::string& whole : base::split(text, '\n')) {
    ++line.number;
    const auto begin = whole.find_first_not_of(kBlanks);
    if (begin == std::string::npos) continue;
    const auto colon = whole.find(':');
    if (colon == std::string::npos) line.refuse("has no name and colon");
    line.name = std::string_view(whole).substr(begin, colon - begin);
    line.words = std::string_view(whole).substr(colon + 1);
    if (line.name == "Portals radius") {
      radius = line.numbers(1)[0];
    } else if (line.name == "Portals scale") {
      scale = line.numbers(1)[0];
    } else if (line.name == "Portal location") {
      if (portals.size() == kMostPortals) {
        line.refuse(fmt::format("is one portal more than the {} of a map", kMostPortals));
      }
      const auto x = line.numbers(3);
      Portal portal;
      portal.center = to_map.to_map({x[0], x[1], x[2]});
      if (!portal.center.allFinite()) line.refuse("is not finite in the map's coordinates");
      portal.mask = PortalMask::outside;
      portals.push_back(portal);
    } else if (line.name == "Portal rotation") {
      if (portals.empty()) line.refuse("turns a portal before the first location");
      const auto turn = line.numbers(4);
      portals.back().rotation = {{turn[1], turn[2], turn[3]}, turn[0] * 180 / std::numbers::pi};
      if (!(portals.back().rotation.axis.norm() > 0)) line.refuse("has an axis of length 0");
    } else {
      line.refuse("is none of Portals radius, Portals scale, Portal location, Portal rotation");
    }
  }
  if (!radius || !scale) {
    refuse_portals(source, "names no \"Portals radius:\" or \"Portals scale:\"");
  }
  if (portals.empty()) refuse_portals(source, "has no \"Portal location:\"");
  for (Portal& portal : portals) {
    portal.radius = *radius * to_map.scale;
    portal.scale = *scale;
  }
  return portals;
}

std::vector<Portal> read_portal_text(const std::filesystem::path& path, const ShapeToMap& to_map) {
  constexpr std::uint64_t kLargestText = std::uint64_t{1} << 20;
  std::string text;
  base::InputFile(path, "portals", kLargestText).read_all(text);
  return portals_from_text(text, path.string(), to_map);
}

}  // namespace qjulia::original

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/input_file.hpp"
#include "qjulia/error.hpp"
#include "qjulia/original_file.hpp"

namespace qjulia {
namespace {

/// Lines of "name: numbers".
class PortalLines {
 public:
  PortalLines(std::string_view text, std::string source)
      : rest_(text), source_(std::move(source)) {}

  /// The next line that is not blank; none at the end.
  std::optional<std::string_view> next() {
    while (!rest_.empty()) {
      const auto end = std::min(rest_.find('\n'), rest_.size());
      std::string_view line = rest_.substr(0, end);
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++number_;
      const auto first = line.find_first_not_of(kBlanks);
      if (first == std::string_view::npos) continue;
      line.remove_prefix(first);
      return line.substr(0, line.find_last_not_of(kBlanks) + 1);
    }
    return std::nullopt;
  }

  /// `count` finite numbers, and no more.
  std::vector<double> numbers(std::string_view words, std::size_t count) const {
    std::vector<double> values;
    for (;;) {
      words.remove_prefix(std::min(words.find_first_not_of(kBlanks), words.size()));
      if (words.empty()) break;
      double value = 0;
      const auto [end, code] = std::from_chars(words.data(), words.data() + words.size(), value);
      if (code != std::errc{} || !std::isfinite(value)) refuse("has a word that is no number");
      words.remove_prefix(static_cast<std::size_t>(end - words.data()));
      values.push_back(value);
    }
    if (values.size() != count) {
      refuse(fmt::format("has {} numbers where {} are needed", values.size(), count));
    }
    return values;
  }

  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(fmt::format("portals '{}': line {} {}", source_, number_, what));
  }
  [[noreturn]] void refuse_file(const std::string& what) const {
    throw InputError(fmt::format("portals '{}': {}", source_, what));
  }

 private:
  static constexpr const char* kBlanks = " \t\r";

  std::string_view rest_;
  std::string source_;
  std::size_t number_ = 0;
};

}  // namespace

std::vector<Portal> portals_from_text(std::string_view text, const std::string& source,
                                      const ShapeToMap& to_map) {
  PortalLines lines(text, source);
  std::optional<double> radius, scale;
  std::vector<Portal> portals;
  while (const auto line = lines.next()) {
    const auto colon = line->find(':');
    if (colon == std::string_view::npos) lines.refuse("has no name and colon");
    const std::string_view name = line->substr(0, colon), words = line->substr(colon + 1);
    if (name == "Portals radius") {
      radius = lines.numbers(words, 1)[0];
    } else if (name == "Portals scale") {
      scale = lines.numbers(words, 1)[0];
    } else if (name == "Portal location") {
      if (portals.size() == kMostPortals) {
        lines.refuse(fmt::format("is one portal more than the {} of a map", kMostPortals));
      }
      const auto x = lines.numbers(words, 3);
      Portal portal;
      portal.center = to_map.to_map({x[0], x[1], x[2]});
      portal.mask = PortalMask::outside;
      portals.push_back(portal);
    } else if (name == "Portal rotation") {
      if (portals.empty()) lines.refuse("turns a portal before the first location");
      const auto turn = lines.numbers(words, 4);
      portals.back().rotation = {{turn[1], turn[2], turn[3]}, turn[0] * 180 / std::numbers::pi};
      if (!(portals.back().rotation.axis.norm() > 0)) lines.refuse("has an axis of length 0");
    } else {
      lines.refuse("is none of Portals radius, Portals scale, Portal location, Portal rotation");
    }
  }
  if (!radius || !scale) lines.refuse_file("names no \"Portals radius:\" or \"Portals scale:\"");
  if (portals.empty()) lines.refuse_file("has no \"Portal location:\"");
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

}  // namespace qjulia

#include <fmt/format.h>

#include <array>
#include <utility>

#include "qjulia/base/detail_choice.hpp"

namespace qjulia {
namespace {

constexpr std::array<std::pair<DetailWord, const char*>, 4> kDetailNames{
    {{DetailWord::automatic, "auto"},
     {DetailWord::smooth, "smooth"},
     {DetailWord::clear, "clear"},
     {DetailWord::wild, "wild"}}};

}  // namespace

std::string to_string(const DetailChoice& detail) {
  if (const auto* number = std::get_if<double>(&detail)) return fmt::format("{}", *number);
  for (const auto& [word, name] : kDetailNames) {
    if (word == std::get<DetailWord>(detail)) return name;
  }
  return {};
}

std::optional<DetailWord> detail_word_named(std::string_view name) {
  for (const auto& [word, known] : kDetailNames) {
    if (name == known) return word;
  }
  return std::nullopt;
}

}  // namespace qjulia

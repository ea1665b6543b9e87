#include "qjulia/base/setting.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "base/text.hpp"

namespace qjulia {
namespace {

/// The numbers of a value that its setting's range is for.
template <class Value>
std::vector<double> numbers_in(const Value* value) {
  if constexpr (std::is_arithmetic_v<Value>) return {static_cast<double>(*value)};
  return {};
}

std::vector<double> numbers_in(const Eigen::Vector3d* vector) {
  return {vector->begin(), vector->end()};
}

template <class Value>
std::vector<double> numbers_in(const std::optional<Value>* value) {
  return *value ? numbers_in(&**value) : std::vector<double>();
}

std::vector<double> numbers_in(const DetailChoice* detail) {
  const auto* const number = std::get_if<double>(detail);
  return number != nullptr ? std::vector{*number} : std::vector<double>();
}

std::vector<double> numbers_in(const SizePlace&) { return {}; }
std::vector<double> numbers_in(const WordPlace&) { return {}; }

}  // namespace

const char* to_string(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::none:
      return "none";
    case Interpolation::linear:
      return "linear";
    case Interpolation::logarithmic:
      return "logarithmic";
    case Interpolation::rotation:
      return "rotation";
  }
  return "";
}

std::string Setting::option() const {
  std::string text = name;
  std::ranges::replace(text, '_', '-');
  return text;
}

std::string Setting::values_text() const {
  return values.empty() ? fmt::format("{}", fmt::join(words, "|")) : values;
}

std::string Setting::range_text() const {
  const bool is_above_zero = least == kAboveZero;
  if (!std::isfinite(most)) {
    if (!std::isfinite(least)) return "any finite number";
    return is_above_zero ? "more than 0" : fmt::format("{} or more", least);
  }
  return is_above_zero ? fmt::format("a number above 0, up to {}", most)
                       : fmt::format("{} to {}", least, most);
}

void Setting::expect_in_range(double value) const {
  const bool is_in_range = value >= least && value <= most;
  if (is_in_range && (may_be_infinite || std::isfinite(value))) return;
  throw InputError(fmt::format("{} is out of range; give {}{}{}", value, range_text(),
                               unit.empty() ? "" : " ", unit));
}

std::size_t Setting::index_of(std::string_view word) const {
  const auto found = std::ranges::find(words, word);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  throw InputError(fmt::format("'{}' is not known; give one of: {}", word, fmt::join(words, ", ")));
}

std::string SizePlace::text() const { return fmt::format("{}x{}", *width, *height); }

void SizePlace::read(std::string_view text) const {
  const auto words = base::split(std::string(text), 'x');
  const auto side = [&](std::size_t i) {
    return words.size() == 2 ? base::number_in<int>(words[i]).value_or(0) : 0;
  };
  if (side(0) <= 0 || side(1) <= 0) {
    throw InputError(fmt::format("'{}' is not WIDTHxHEIGHT in pixels, such as 1280x960", text));
  }
  *width = side(0);
  *height = side(1);
}

std::string option_of(const Setting& setting, const ValuePlace& place) {
  const auto* const flag = std::get_if<bool*>(&place);
  return flag != nullptr && **flag ? "no-" + setting.option() : setting.option();
}

void expect_in_range(const Setting& setting, const ValuePlace& place) {
  const auto numbers = std::visit([](const auto& value) { return numbers_in(value); }, place);
  try {
    for (const double number : numbers) setting.expect_in_range(number);
  } catch (const InputError& error) {
    throw OptionError(setting.name, error.what());
  }
}

}  // namespace qjulia

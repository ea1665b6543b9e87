#pragma once
/// Enumerations whose values have words, in files and elsewhere.

#include <string_view>

namespace qjulia {

/// A value of an enumeration and its word. `words(value)`, declared beside the enumeration, lists
/// all of them.
template <class Value>
struct Word {
  Value value;
  std::string_view word;
};

/// The word for a value.
template <class Value>
constexpr std::string_view word_of(Value value) {
  for (const auto& [each, word] : words(value)) {
    if (each == value) return word;
  }
  return {};
}

}  // namespace qjulia

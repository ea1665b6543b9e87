#pragma once
/// What follows from the leaves of a kind's members, which its struct visits: the object of a map
/// file, written and read, and the reals of a device's buffer.

#include <array>
#include <concepts>
#include <cstdint>
#include <span>
#include <string_view>
#include <type_traits>
#include <vector>

#include "map/map_parts.hpp"

namespace qjulia::map {

template <class Kind>
concept HasLeaves = requires(Kind& kind) {
  Kind::leaves(kind, [](const char*, const auto&) {});
};

template <class Value>
concept HasWords = std::is_enum_v<Value> && requires(Value value) {
  words(value);
};

// ---- Map files

template <class Number>
requires std::is_arithmetic_v<Number> nlohmann::json json_of(Number number) { return number; }

template <HasWords Value>
nlohmann::json json_of(Value value) {
  return word_of(value);
}

inline void read(const Object& object, const char* key, int& n) { n = object.integer(key); }
inline void read(const Object& object, const char* key, double& x) { x = object.number(key); }
inline void read(const Object& object, const char* key, Eigen::Vector3d& v) {
  v = object.vector(key);
}
inline void read(const Object& object, const char* key, std::uint32_t& n) {
  const double number = object.number(key);
  if (!(number >= 0 && number <= std::numeric_limits<std::uint32_t>::max()) ||
      number != std::floor(number)) {
    object.refuse(fmt::format("has a \"{}\" that is no whole number from 0 to 4294967295", key));
  }
  n = static_cast<std::uint32_t>(number);
}

template <HasWords Value>
void read(const Object& object, const char* key, Value& value) {
  const std::string name = object.text(key);
  std::string known;
  for (const auto& [each, word] : words(value)) {
    if (name == word) {
      value = each;
      return;
    }
    known += fmt::format("{}\"{}\"", known.empty() ? "" : ", ", word);
  }
  object.refuse(fmt::format("has a \"{}\" that is none of {}", key, known));
}

/// A leaf that has several keys in its kind's object, and no name of its own. Specialisations have
/// `keys`, `json_of(leaf)` and `read(object, leaf)`.
template <class Leaf>
struct KeyedLeaf {};

template <class Leaf>
concept HasKeys = requires {
  KeyedLeaf<Leaf>::keys;
};

template <HasLeaves Kind>
nlohmann::json json_of(const Kind& kind) {
  nlohmann::json all = nlohmann::json::object();
  Kind::leaves(kind, [&]<class Leaf>(const char* name, const Leaf& leaf) {
    if constexpr (HasKeys<Leaf>) {
      all.update(KeyedLeaf<Leaf>::json_of(leaf));
    } else {
      all[name] = json_of(leaf);
    }
  });
  return all;
}

template <HasLeaves Kind>
void read(const Object& map, const char* key, Kind& kind) {
  const Object object = map.object(key);
  std::vector<std::string_view> keys;
  Kind::leaves(kind, [&]<class Leaf>(const char* name, const Leaf& /*leaf*/) {
    if constexpr (HasKeys<Leaf>) {
      keys.insert(keys.end(), KeyedLeaf<Leaf>::keys.begin(), KeyedLeaf<Leaf>::keys.end());
    } else {
      keys.emplace_back(name);
    }
  });
  object.expect_only(keys);
  Kind::leaves(kind, [&]<class Leaf>(const char* name, Leaf& leaf) {
    if constexpr (HasKeys<Leaf>) {
      KeyedLeaf<Leaf>::read(object, leaf);
    } else {
      read(object, name, leaf);
    }
  });
  if constexpr (requires { kind.validate(); }) {
    try {
      kind.validate();
    } catch (const InputError& error) {
      object.refuse(fmt::format("is wrong: {}", error.what()));
    }
  }
}

// ---- Devices

template <class Real, class Numbers>
void extend(std::vector<Real>& reals, const Numbers& numbers) {
  reals.insert(reals.end(), numbers.begin(), numbers.end());
}

template <class Numbers>
void put(std::span<double> reals, std::size_t at, const Numbers& numbers) {
  std::copy(numbers.begin(), numbers.end(), reals.subspan(at).begin());
}

/// A value of 32 bits, in two halves: reals of single precision hold each exactly.
template <class Real>
void append(std::vector<Real>& reals, std::uint32_t bits) {
  extend(reals, std::array{static_cast<double>(bits & 0xffffU), static_cast<double>(bits >> 16U)});
}
template <class Real, std::same_as<int> Number>
void append(std::vector<Real>& reals, Number number) {
  reals.push_back(static_cast<Real>(number));
}
template <class Real, std::same_as<double> Number>
void append(std::vector<Real>& reals, Number number) {
  reals.push_back(static_cast<Real>(number));
}
template <class Real, HasWords Value>
void append(std::vector<Real>& reals, Value value) {
  reals.push_back(static_cast<Real>(static_cast<int>(value)));
}
template <class Real>
void append(std::vector<Real>& reals, const Eigen::Vector3d& v) {
  extend(reals, v);
}
template <class Real>
void append(std::vector<Real>& reals, const Quaternion& q) {
  extend(reals, coordinates(q));
}
template <class Real, HasLeaves Kind>
void append(std::vector<Real>& reals, const Kind& kind) {
  Kind::leaves(kind, [&](const char* /*name*/, const auto& leaf) { append(reals, leaf); });
}

}  // namespace qjulia::map

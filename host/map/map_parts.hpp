#pragma once
/// The parts of a map as a map file holds them (docs/reference/map-format.md), and how they are
/// read: strictly.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "qjulia/base/error.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::map {

[[noreturn]] inline void fail(const std::string& source, const std::string& what) {
  throw InputError(fmt::format("map '{}': {}", source, what));
}

/// A JSON object and what messages call it. Every member asked for must be of its type.
class Object {
 public:
  Object(const nlohmann::json& value, std::string source, std::string name)
      : value_(value), source_(std::move(source)), name_(std::move(name)) {
    if (!value_.is_object()) {
      fail(source_, fmt::format("{} must be an object, but is {}",
                                name_.empty() ? "the file" : '"' + name_ + '"', shown(value_)));
    }
  }

  bool has(const char* key) const { return value_.contains(key); }

  const nlohmann::json& at(const char* key) const {
    const auto found = value_.find(key);
    if (found == value_.end()) {
      fail(source_, fmt::format("the key \"{}\" is missing; a map file needs it", path(key)));
    }
    return *found;
  }

  double number(const char* key) const { return number(at(key), path(key)); }

  std::string text(const char* key) const {
    const nlohmann::json& value = at(key);
    if (!value.is_string()) wrong(path(key), "a string", value);
    return value.get<std::string>();
  }

  const nlohmann::json& array(const char* key) const {
    const nlohmann::json& value = at(key);
    if (!value.is_array()) wrong(path(key), "an array", value);
    return value;
  }

  Quaternion quaternion(const char* key) const {
    const auto [x, y, z, w] = numbers<4>(at(key), path(key));
    return {x, y, z, w};
  }

  Eigen::Vector3d vector(const char* key) const {
    return Eigen::Vector3d(numbers<3>(at(key), path(key)).data());
  }

  Box box(const char* key) const {
    const nlohmann::json& value = array(key);
    if (value.size() != 2) wrong(path(key), "two corners", value);
    return {Eigen::Vector3d(numbers<3>(value[0], path(key) + "[0]").data()),
            Eigen::Vector3d(numbers<3>(value[1], path(key) + "[1]").data())};
  }

  /// @throws InputError: the file, this object's name where it has one, and what is wrong.
  [[noreturn]] void refuse(const std::string& what) const {
    fail(source_, name_.empty() ? what : fmt::format("\"{}\" {}", name_, what));
  }

  int integer(const char* key) const {
    const nlohmann::json& value = at(key);
    if (!value.is_number_integer() || value < std::numeric_limits<int>::min() ||
        value > std::numeric_limits<int>::max()) {
      wrong(path(key), "a whole number", value);
    }
    return value.get<int>();
  }

  std::array<int, 3> integers(const char* key) const {
    std::array<int, 3> result{};
    const auto all = numbers<3>(at(key), path(key));
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (!(std::abs(all[i]) < 1e9) || all[i] != std::floor(all[i])) {
        wrong(path(key), "an array of 3 whole numbers", at(key));
      }
      result[i] = static_cast<int>(all[i]);
    }
    return result;
  }

  Object object(const char* key) const { return {at(key), source_, path(key)}; }

  /// Calls `visit` with each object of an array.
  template <class Visit>
  void for_each(const char* key, const Visit& visit) const {
    const nlohmann::json& all = array(key);
    for (std::size_t i = 0; i < all.size(); ++i) {
      visit(Object(all[i], source_, fmt::format("{}[{}]", path(key), i)));
    }
  }

  /// Refuses members with other names: a misspelt one would be ignored in silence.
  void expect_only(const std::vector<std::string_view>& keys) const {
    for (const auto& [key, unused] : value_.items()) {
      if (std::ranges::find(keys, std::string_view(key)) != keys.end()) continue;
      fail(source_,
           fmt::format("unknown key \"{}\"; remove it or correct its name", path(key.c_str())));
    }
  }

 private:
  std::string path(const char* key) const { return name_.empty() ? key : name_ + '.' + key; }

  [[noreturn]] void wrong(const std::string& path, const char* wanted,
                          const nlohmann::json& value) const {
    fail(source_, fmt::format("\"{}\" must be {}, but is {}", path, wanted, shown(value)));
  }

  /// The value itself if it is short, else what it is.
  static std::string shown(const nlohmann::json& value) {
    if (value.is_array()) return fmt::format("an array of {}", value.size());
    if (value.is_object()) return "an object";
    return value.is_string() ? "a string" : value.dump();
  }

  double number(const nlohmann::json& value, const std::string& path) const {
    if (!value.is_number()) wrong(path, "a finite number", value);
    return value.get<double>();
  }

  template <std::size_t N>
  std::array<double, N> numbers(const nlohmann::json& value, const std::string& path) const {
    if (!value.is_array() || value.size() != N) {
      wrong(path, N == 3 ? "an array of 3 numbers" : "an array of 4 numbers", value);
    }
    std::array<double, N> result{};
    for (std::size_t i = 0; i < N; ++i) {
      result[i] = number(value[i], fmt::format("{}[{}]", path, i));
    }
    return result;
  }

  const nlohmann::json& value_;
  std::string source_;
  std::string name_;
};

/// Bytes as text: compressed (zlib), in base64.
std::string text_of_bytes(const std::string& bytes);
/// The bytes under "data". @param size their number, for which `keys` ask
std::string bytes_of_text(const Object& object, std::size_t size, const char* keys);
/// Whether a grid's numbers of cells are from `fewest` to `most`.
bool are_within(const std::array<int, 3>& cells, int fewest, int most);

nlohmann::json json_of(const Quaternion& q);
nlohmann::json json_of(const Eigen::Vector3d& v);
nlohmann::json json_of(const Paint& paint);
nlohmann::json json_of(const std::vector<Portal>& portals);

/// Each reads what `map` has under `key`. @throws InputError naming the key that is wrong.
void read(const Object& map, const char* key, Quaternion& q);
void read(const Object& map, const char* key, Paint& paint);
void read(const Object& map, const char* key, std::vector<Portal>& portals);

}  // namespace qjulia::map

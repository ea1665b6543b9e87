#pragma once
/// Values of keyword arguments, from Python to the types that the library's options have. Each
/// function raises TypeError or ValueError that begins with the argument's name.

#include <pybind11/pybind11.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "qjulia/base/detail_choice.hpp"
#include "qjulia/base/rotation.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::python {

/// What a message shows of a value: its repr, cut where it is long.
std::string shown(const pybind11::handle& value);

void read(const pybind11::handle& given, const std::string& name, bool& value);
void read(const pybind11::handle& given, const std::string& name, int& value);
void read(const pybind11::handle& given, const std::string& name, std::uint64_t& value);
void read(const pybind11::handle& given, const std::string& name, double& value);
void read(const pybind11::handle& given, const std::string& name, std::string& value);
void read(const pybind11::handle& given, const std::string& name, std::filesystem::path& value);
void read(const pybind11::handle& given, const std::string& name, Eigen::Vector3d& value);
void read(const pybind11::handle& given, const std::string& name, Quaternion& value);
void read(const pybind11::handle& given, const std::string& name, Rotation& value);
/// Two corners, as (2, 3) or six numbers.
void read(const pybind11::handle& given, const std::string& name, Box& value);
void read(const pybind11::handle& given, const std::string& name, std::vector<Lamp>& value);
void read(const pybind11::handle& given, const std::string& name, LightColor& value);
void read(const pybind11::handle& given, const std::string& name, Background& value);
void read(const pybind11::handle& given, const std::string& name, MaterialRange& value);
/// "z=50%,x=0.2", or a dict such as {"z": "50%", "x": 0.2}.
void read(const pybind11::handle& given, const std::string& name, std::vector<Cut>& value);
void read(const pybind11::handle& given, const std::string& name, Precision& value);
/// A number, or "auto", "smooth", "clear" or "wild".
void read(const pybind11::handle& given, const std::string& name, DetailChoice& value);
/// "x" to "-z"; "auto" leaves it out.
void read(const pybind11::handle& given, const std::string& name, std::optional<UpAxis>& value);

template <class Value>
requires(!std::is_same_v<Value, UpAxis>) void read(const pybind11::handle& given,
                                                   const std::string& name,
                                                   std::optional<Value>& value) {
  Value own{};
  read(given, name, own);
  value = std::move(own);
}

/// So many finite numbers. @param what they are, such as "X Y Z".
std::vector<double> numbers(const pybind11::handle& given, const std::string& name,
                            std::size_t count, const char* what);

/// One of a few words. @throws ValueError that lists them.
template <class Value>
void read_word(const pybind11::handle& given, const std::string& name, Value& value,
               const std::vector<std::pair<std::string, Value>>& words) {
  std::string word;
  read(given, name, word);
  std::string all;
  for (const auto& [known, meant] : words) {
    if (word == known) {
      value = meant;
      return;
    }
    all += (all.empty() ? "'" : ", '") + known + "'";
  }
  throw pybind11::value_error(name + " must be one of " + all + ", not " + shown(given));
}

}  // namespace qjulia::python

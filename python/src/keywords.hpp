#pragma once
/// The keyword arguments of one call.

#include <pybind11/pybind11.h>

#include <string>
#include <vector>

#include "settings.hpp"
#include "values.hpp"

namespace qjulia::python {

/// What Python calls an option of this name in the library: "n" is "iterations" everywhere.
std::string argument_name(const std::string& field);

/// Hands out keyword arguments by name, and says in the end what nobody asked for.
class Keywords {
 public:
  /// @param function as messages call it.
  Keywords(std::string function, pybind11::dict given)
      : function_(std::move(function)), given_(std::move(given)) {}

  /// The argument, or a null handle where it was not given or is None.
  pybind11::handle argument(const std::string& name);

  /// Reads the argument where it was given; None leaves the value as it is.
  template <class Value>
  void take(const std::string& name, Value& value) {
    if (const auto given = argument(name)) read(given, name, value);
  }
  /// The same for a setting, by the name that Python calls it.
  void take(const Setting& setting, const ValuePlace& place) {
    const std::string name = argument_name(setting.name);
    if (const auto given = argument(name)) read(given, name, setting, place);
  }
  /// All settings of a table.
  template <class Table, class Options>
  void take_all(const Table& table, Options& options) {
    for (const auto& setting : table) take(setting, setting.place(options));
  }
  template <class Value>
  void take_word(const std::string& name, Value& value,
                 const std::vector<std::pair<std::string, Value>>& words) {
    if (const auto given = argument(name)) read_word(given, name, value, words);
  }

  /// @throws TypeError where an argument was given that nobody asked for, with the nearest name.
  void expect_no_more() const;

 private:
  std::string function_;
  pybind11::dict given_;
  std::vector<std::string> known_;
};

}  // namespace qjulia::python

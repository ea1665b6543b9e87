#pragma once
/// Settings of the library's tables as keyword arguments.

#include <pybind11/pybind11.h>

#include <string>

#include "qjulia/base/setting.hpp"

namespace qjulia::python {

/// Reads an argument for a setting. @throws TypeError or ValueError that begins with `name`.
void read(const pybind11::handle& given, const std::string& name, const Setting& setting,
          const ValuePlace& place);

/// A setting for documentation, signatures and tests: a dict of name, field, type, default,
/// values, unit, range, example, help and more.
pybind11::dict described_setting(const Setting& setting, const ValuePlace& place);

template <class Table, class Options>
pybind11::list described(const Table& table, Options usual) {
  pybind11::list all;
  for (const auto& setting : table) all.append(described_setting(setting, setting.place(usual)));
  return all;
}

}  // namespace qjulia::python

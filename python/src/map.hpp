#pragma once
/// A map as Python holds it. It never changes: what changes a map makes another.

#include <pybind11/pybind11.h>

#include <memory>
#include <utility>

#include "device.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia::python {

/// The field that was evaluated last, so that the next call need not prepare it again.
struct KeptField {
  const device::Context* context = nullptr;
  Layout layout{};
  Precision precision{};
  double escape = 0;
  std::shared_ptr<const Field> field;
};

struct KeptMap {
  Map map;
  KeptField kept{};  ///< read and written with Python's lock
};
using MapPointer = std::shared_ptr<KeptMap>;

inline MapPointer kept(Map map) { return std::make_shared<KeptMap>(KeptMap{std::move(map), {}}); }

void add_map(pybind11::module_& module);

}  // namespace qjulia::python

#pragma once
/// The library's exceptions as Python's.

#include <pybind11/pybind11.h>

namespace qjulia::python {

/// Makes the classes of exceptions in the module, and has what the library throws become them.
void add_errors(pybind11::module_& module);

}  // namespace qjulia::python

#include "errors.hpp"

#include <string>
#include <utility>

#include "keywords.hpp"
#include "qjulia/base/error.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// Classes live as long as the process.
struct Classes {
  PyObject *error, *input, *option, *output, *no_device, *device, *kernel_build;
};
Classes& classes() {
  static Classes all{};
  return all;
}

PyObject* made(py::module_& module, const char* name, const char* doc, PyObject* first,
               PyObject* second = nullptr) {
  const py::object bases = second == nullptr
                               ? py::reinterpret_borrow<py::object>(first)
                               : py::make_tuple(py::handle(first), py::handle(second));
  const std::string full_name = std::string("qjulia.") + name;
  PyObject* made_class = PyErr_NewExceptionWithDoc(full_name.c_str(), doc, bases.ptr(), nullptr);
  if (made_class == nullptr) throw py::error_already_set();
  module.attr(name) = py::handle(made_class);
  return made_class;
}

void translate(std::exception_ptr thrown) {
  try {
    if (thrown) std::rethrow_exception(std::move(thrown));
  } catch (const OptionError& error) {
    const std::string message = argument_name(error.field()) + ": " + error.problem();
    PyErr_SetString(classes().option, message.c_str());
  } catch (const InputError& error) {
    PyErr_SetString(classes().input, error.what());
  } catch (const OutputError& error) {
    PyErr_SetString(classes().output, error.what());
  } catch (const Interrupted& error) {
    PyErr_SetString(PyExc_KeyboardInterrupt, error.what());
  } catch (const NoDeviceError& error) {
    PyErr_SetString(classes().no_device, error.what());
  } catch (const DeviceError& error) {
    PyErr_SetString(classes().device, error.what());
  } catch (const KernelBuildError& error) {
    PyErr_SetString(classes().kernel_build, error.what());
  } catch (const Error& error) {
    PyErr_SetString(classes().error, error.what());
  }
}

}  // namespace

void add_errors(py::module_& module) {
  Classes& all = classes();
  all.error = made(module, "Error", "Base of what qjulia raises on purpose.", PyExc_Exception);
  all.input = made(module, "InputError",
                   "A file, an array or an argument cannot be used; the message names it.",
                   all.error, PyExc_ValueError);
  all.option = made(module, "OptionError", "The value of an argument cannot be used.", all.input);
  all.output =
      made(module, "OutputError", "A result could not be written.", all.error, PyExc_OSError);
  all.no_device = made(module, "NoDeviceError", "No OpenCL device matches what was asked for.",
                       all.error, PyExc_RuntimeError);
  all.device = made(module, "DeviceError", "An OpenCL call failed.", all.error, PyExc_RuntimeError);
  all.kernel_build = made(module, "KernelBuildError",
                          "A kernel did not compile; the message holds the compiler's log.",
                          all.error, PyExc_RuntimeError);
  py::register_exception_translator(&translate);
}

}  // namespace qjulia::python

#include "arrays.hpp"

#include <cmath>

#include "values.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

std::string shape_text(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) {
    text += (i == 0 ? "" : ", ") + std::to_string(array.shape(i));
  }
  return text + (array.ndim() == 1 ? ",)" : ")");
}

std::string wanted_shapes(const std::vector<int>& lengths) {
  std::string text;
  for (const int length : lengths) {
    text += (text.empty() ? "" : " or ") +
            (length == 0 ? std::string("(N,)") : "(N, " + std::to_string(length) + ")");
  }
  return text;
}

py::array array_in(const py::handle& given, const std::string& name, const char* kinds,
                   const char* wanted) {
  const auto array = py::array::ensure(given);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(name + " must be an array of " + wanted + ", not " + shown(given));
  }
  const bool is_empty_list = array.size() == 0 && array.dtype().kind() == 'f';
  if (std::string(kinds).find(array.dtype().kind()) == std::string::npos && !is_empty_list) {
    throw py::type_error(name + " must be an array of " + wanted + ", not of dtype " +
                         shown(py::str(array.dtype())));
  }
  return array;
}

void expect_shape(const py::array& array, const std::string& name,
                  const std::vector<int>& lengths) {
  for (const int length : lengths) {
    if (length == 0 ? array.ndim() == 1 : array.ndim() == 2 && array.shape(1) == length) return;
  }
  throw py::value_error(name + " must have shape " + wanted_shapes(lengths) + ", not " +
                        shape_text(array));
}

void expect_finite(const DoubleArray& values, const std::string& name) {
  const double* const data = values.data();
  for (py::ssize_t i = 0; i < values.size(); ++i) {
    if (std::isfinite(data[i])) continue;
    const py::ssize_t row = values.ndim() == 2 ? i / values.shape(1) : i;
    throw py::value_error(name + "[" + std::to_string(row) + "] is not finite");
  }
}

}  // namespace

DoubleArray rows_of_numbers(const py::handle& given, const std::string& name,
                            const std::vector<int>& lengths) {
  const py::array array = array_in(given, name, "fiu", "real numbers");
  expect_shape(array, name, lengths);
  DoubleArray values(array);
  expect_finite(values, name);
  return values;
}

IndexArray rows_of_indices(const py::handle& given, const std::string& name, int length) {
  const py::array array = array_in(given, name, "iu", "whole numbers");
  expect_shape(array, name, {length});
  return IndexArray(array);
}

std::vector<double> numbers_for(const py::handle& given, const std::string& name,
                                std::size_t count) {
  const DoubleArray values = rows_of_numbers(given, name, {0});
  if (static_cast<std::size_t>(values.size()) != count) {
    throw py::value_error(name + " must have length " + std::to_string(count) + ", not " +
                          std::to_string(values.size()));
  }
  return {values.data(), values.data() + values.size()};
}

}  // namespace qjulia::python

#pragma once
/// NumPy's arrays in and out. Functions that take one raise TypeError or ValueError that begins
/// with the argument's name.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <string>
#include <utility>
#include <vector>

namespace qjulia::python {

using DoubleArray =
    pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;
using IndexArray =
    pybind11::array_t<std::int64_t, pybind11::array::c_style | pybind11::array::forcecast>;

/// An array of real numbers, all finite, whose rows have one of these lengths; 0 stands for an
/// array of one dimension.
DoubleArray rows_of_numbers(const pybind11::handle& given, const std::string& name,
                            const std::vector<int>& lengths);

/// The same of whole numbers. Where it is empty its type may be any.
IndexArray rows_of_indices(const pybind11::handle& given, const std::string& name, int length);

/// `count` real numbers, all finite.
std::vector<double> numbers_for(const pybind11::handle& given, const std::string& name,
                                std::size_t count);

/// An array that owns the vector. `Item` is made of `Number`s alone; the shape is that of them all.
template <class Number, class Item>
pybind11::array array_of(std::vector<Item> items, const std::vector<pybind11::ssize_t>& shape) {
  static_assert(sizeof(Item) % sizeof(Number) == 0);
  auto* const owned = new std::vector<Item>(std::move(items));
  const pybind11::capsule owner(
      owned, [](void* vector) { delete static_cast<std::vector<Item>*>(vector); });
  return pybind11::array_t<Number>(shape, reinterpret_cast<const Number*>(owned->data()), owner);
}

}  // namespace qjulia::python

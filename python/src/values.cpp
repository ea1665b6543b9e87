#include "values.hpp"

#include <pybind11/numpy.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "qjulia/picture/picture.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

[[noreturn]] void throw_type(const std::string& name, const char* wanted, const py::handle& given) {
  PyErr_Clear();
  throw py::type_error(name + " must be " + wanted + ", not " + shown(given));
}

/// Python's whole number; numbers of NumPy count, floats do not.
py::object whole(const py::handle& given, const std::string& name) {
  if (PyBool_Check(given.ptr())) throw_type(name, "a whole number", given);
  PyObject* const number = PyNumber_Index(given.ptr());
  if (number == nullptr) throw_type(name, "a whole number", given);
  return py::reinterpret_steal<py::object>(number);
}

[[noreturn]] void throw_too_large(const std::string& name, const py::handle& given) {
  PyErr_Clear();
  throw py::value_error(name + " is out of range: " + shown(given));
}

}  // namespace

std::string shown(const py::handle& value) {
  constexpr std::size_t kMost = 60;
  PyObject* const text = PyObject_Repr(value.ptr());
  if (text == nullptr) {
    PyErr_Clear();
    return "such an object";
  }
  const py::str owned = py::reinterpret_steal<py::str>(text);
  const py::str part = owned[py::slice(0, kMost, 1)];
  const py::bytes bytes = part.attr("encode")("utf-8", "backslashreplace");
  return static_cast<std::string>(bytes) + (py::len(owned) > kMost ? "..." : "");
}

void read(const py::handle& given, const std::string& name, bool& value) {
  // NumPy's own type of truth is no bool.
  if (!PyBool_Check(given.ptr()) &&
      !py::str(given.attr("__class__").attr("__name__")).equal(py::str("bool_"))) {
    throw_type(name, "True or False", given);
  }
  value = PyObject_IsTrue(given.ptr()) == 1;
}

void read(const py::handle& given, const std::string& name, int& value) {
  const py::object number = whole(given, name);
  const long long wide = PyLong_AsLongLong(number.ptr());
  if (PyErr_Occurred() != nullptr || wide < std::numeric_limits<int>::min() ||
      wide > std::numeric_limits<int>::max()) {
    throw_too_large(name, given);
  }
  value = static_cast<int>(wide);
}

void read(const py::handle& given, const std::string& name, std::uint64_t& value) {
  const py::object number = whole(given, name);
  const unsigned long long wide = PyLong_AsUnsignedLongLong(number.ptr());
  if (PyErr_Occurred() != nullptr) throw_too_large(name, given);
  value = wide;
}

void read(const py::handle& given, const std::string& name, double& value) {
  if (PyBool_Check(given.ptr())) throw_type(name, "a number", given);
  const double number = PyFloat_AsDouble(given.ptr());
  if (PyErr_Occurred() != nullptr) throw_type(name, "a number", given);
  value = number;
}

void read(const py::handle& given, const std::string& name, std::string& value) {
  if (!py::isinstance<py::str>(given)) throw_type(name, "a string", given);
  try {
    value = given.cast<std::string>();
  } catch (const py::cast_error&) {
    throw_type(name, "a string that can be written as UTF-8", given);
  }
}

void read(const py::handle& given, const std::string& name, std::filesystem::path& value) {
  PyObject* bytes = nullptr;
  if (PyUnicode_FSConverter(given.ptr(), &bytes) == 0) throw_type(name, "a path", given);
  value = static_cast<std::string>(py::reinterpret_steal<py::bytes>(bytes));
}

std::vector<double> numbers(const py::handle& given, const std::string& name, std::size_t count,
                            const char* what) {
  const std::string wanted = std::to_string(count) + " numbers, " + what;
  const auto array = py::array::ensure(given);
  if (!array) throw_type(name, wanted.c_str(), given);
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u') throw_type(name, wanted.c_str(), given);
  const py::array_t<double, py::array::c_style | py::array::forcecast> values(array);
  if (static_cast<std::size_t>(values.size()) != count) {
    throw py::value_error(name + " must be " + wanted + ", not " + shown(given));
  }
  std::vector<double> all(values.data(), values.data() + values.size());
  for (const double value : all) {
    if (!std::isfinite(value)) throw py::value_error(name + " has a number that is not finite");
  }
  return all;
}

void read(const py::handle& given, const std::string& name, Eigen::Vector3d& value) {
  const auto v = numbers(given, name, 3, "X Y Z");
  value = {v[0], v[1], v[2]};
}

void read(const py::handle& given, const std::string& name, Quaternion& value) {
  const auto v = numbers(given, name, 4, "X Y Z W");
  value = {v[0], v[1], v[2], v[3]};
}

void read(const py::handle& given, const std::string& name, Rotation& value) {
  const auto v = numbers(given, name, 4, "X Y Z DEGREES");
  value = {{v[0], v[1], v[2]}, v[3]};
}

void read(const py::handle& given, const std::string& name, Box& value) {
  const auto v = numbers(given, name, 6, "the low and the high corner");
  value = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
}

namespace {

/// What `from` makes of a text. @throws ValueError naming the argument
template <class From>
auto from_text(const py::handle& given, const std::string& name, const From& from) {
  std::string text;
  read(given, name, text);
  try {
    return from(text);
  } catch (const InputError& error) {
    throw py::value_error(name + ": " + error.what());
  }
}

/// A lamp as text, or as a sequence of its values.
Lamp lamp_of(const py::handle& given, const std::string& name) {
  if (!py::isinstance<py::sequence>(given) && !py::isinstance<py::array>(given)) {
    throw_type(name, "\"AZIMUTH,ELEVATION,STRENGTH\" or a list of these", given);
  }
  if (py::isinstance<py::str>(given)) return from_text(given, name, lamp_from);
  return from_text(py::str(",").attr("join")(
                       py::module_::import("builtins").attr("map")(py::type::of(py::str()), given)),
                   name, lamp_from);
}

}  // namespace

void read(const py::handle& given, const std::string& name, std::vector<Lamp>& value) {
  value.clear();
  // One lamp begins with a number, several with a lamp.
  const bool is_list = !py::isinstance<py::str>(given) && py::isinstance<py::sequence>(given) &&
                       py::len(given) > 0 &&
                       py::isinstance<py::sequence>(py::reinterpret_borrow<py::sequence>(given)[0]);
  if (!is_list) {
    value.push_back(lamp_of(given, name));
    return;
  }
  for (const py::handle lamp : given) value.push_back(lamp_of(lamp, name));
}

void read(const py::handle& given, const std::string& name, LightColor& value) {
  value = from_text(given, name, light_color_from);
}

void read(const py::handle& given, const std::string& name, Background& value) {
  value = from_text(given, name, background_from);
}

void read(const py::handle& given, const std::string& name, std::vector<Cut>& value) {
  if (py::isinstance<py::str>(given)) {
    value = from_text(given, name, cuts_from);
    return;
  }
  if (!py::isinstance<py::dict>(given)) {
    throw_type(name, "text such as \"z=50%\", or a dict such as {\"z\": \"50%\"}", given);
  }
  value.clear();
  for (const auto& [axis, place] : py::reinterpret_borrow<py::dict>(given)) {
    if (!py::isinstance<py::str>(axis) || py::len(axis) != 1) throw_type(name, "x, y or z", axis);
    const py::str word = py::str("{}={}").format(axis, place);
    for (const Cut& cut : from_text(word, name, cuts_from)) value.push_back(cut);
  }
}

void read(const py::handle& given, const std::string& name, MaterialRange& value) {
  const auto length =
      py::isinstance<py::sequence>(given) || py::isinstance<py::array>(given) ? py::len(given) : 0;
  const std::vector<double> v =
      numbers(given, name, std::max<std::size_t>(length, 2), "rising from LOW to HIGH");
  value = range_of(v);
}

void read(const py::handle& given, const std::string& name, Precision& value) {
  std::vector<std::pair<std::string, Precision>> words;
  for (const Precision precision : kPrecisions) words.emplace_back(to_string(precision), precision);
  read_word(given, name, value, words);
}

void read(const py::handle& given, const std::string& name, DetailChoice& value) {
  if (!py::isinstance<py::str>(given)) {
    double number = 0;
    read(given, name, number);
    value = number;
    return;
  }
  std::vector<std::pair<std::string, DetailChoice>> words;
  for (const auto word :
       {DetailWord::automatic, DetailWord::smooth, DetailWord::clear, DetailWord::wild}) {
    words.emplace_back(to_string(word), word);
  }
  read_word(given, name, value, words);
}

void read(const py::handle& given, const std::string& name, std::optional<UpAxis>& value) {
  std::vector<std::pair<std::string, std::optional<UpAxis>>> words{{"auto", std::nullopt}};
  for (const auto axis :
       {UpAxis::x, UpAxis::y, UpAxis::z, UpAxis::minus_x, UpAxis::minus_y, UpAxis::minus_z}) {
    words.emplace_back(to_string(axis), axis);
  }
  read_word(given, name, value, words);
}

}  // namespace qjulia::python

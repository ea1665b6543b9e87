#include "settings.hpp"

#include <pybind11/stl.h>

#include "keywords.hpp"
#include "qjulia/base/colors.hpp"
#include "qjulia/picture/picture.hpp"
#include "values.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// What Python's side has for each type of value.
struct Shown {
  std::string type;  ///< as stubs write it
  py::object usual;  ///< the default
  bool has_range = false;
};

class ShownOf {
 public:
  explicit ShownOf(const Setting& setting) : setting_(setting) {}

  Shown operator()(const bool* value) const { return {"bool", py::bool_(*value)}; }
  Shown operator()(const int* value) const { return {"SupportsIndex", py::int_(*value), true}; }
  Shown operator()(const std::uint64_t* value) const {
    return {"SupportsIndex", py::int_(*value), true};
  }
  Shown operator()(const double* value) const { return {"float", py::float_(*value), true}; }
  Shown operator()(const std::string* value) const { return {"str", py::str(*value)}; }
  Shown operator()(const WordPlace& value) const {
    std::string words;
    for (const std::string& word : setting_.words) {
      words += (words.empty() ? "\"" : ", \"") + word + "\"";
    }
    return {"Literal[" + words + "]", py::str(setting_.words.at(value.index()))};
  }
  Shown operator()(const DetailChoice* value) const {
    const auto* const number = std::get_if<double>(value);
    if (number != nullptr) return {"_Detail", py::float_(*number)};
    return {"_Detail", py::str(to_string(*value))};
  }
  Shown operator()(const Quaternion* q) const {
    return {"ArrayLike", py::make_tuple(q->x, q->y, q->z, q->w)};
  }
  Shown operator()(const Palette*) const {
    return {"Union[str, Sequence[str]]", py::str(palette_names().front())};
  }
  Shown operator()(const Background* background) const {
    return {"str", py::str(to_string(*background))};
  }
  Shown operator()(const std::vector<Lamp>*) const {
    return {"Union[str, Sequence[Any]]", py::tuple()};
  }
  Shown operator()(const SizePlace& size) const {
    return {"Tuple[int, int]", py::make_tuple(*size.width, *size.height)};
  }
  Shown operator()(const std::vector<Cut>*) const {
    return {"Union[str, Mapping[str, Union[float, str]]]", py::str()};
  }
  Shown operator()(const std::optional<LightColor>*) const { return none("str", false); }
  Shown operator()(const std::optional<int>*) const { return none("SupportsIndex", true); }
  Shown operator()(const std::optional<std::uint64_t>*) const {
    return none("SupportsIndex", true);
  }
  Shown operator()(const std::optional<double>* value) const {
    Shown shown = none("float", true);
    if (*value) shown.usual = py::float_(**value);
    return shown;
  }
  Shown operator()(const std::optional<UpAxis>*) const { return none("_Up", false); }
  template <class Value>
  Shown operator()(const std::optional<Value>*) const {
    return none("ArrayLike", false);
  }

 private:
  Shown none(const std::string& type, bool has_range) const {
    // "auto" is among the words of _Up.
    const bool has_word = has_range && !setting_.automatic.empty();
    return {has_word ? "Union[" + type + ", Literal[\"" + setting_.automatic + "\"], None]"
                     : "Optional[" + type + "]",
            py::none(), has_range};
  }

  const Setting& setting_;
};

/// Reads an argument into each type of value.
class ReadArgument {
 public:
  ReadArgument(const py::handle& given, const std::string& name, const Setting& setting)
      : given_(given), name_(name), setting_(setting) {}

  void operator()(const WordPlace& value) const {
    std::vector<std::pair<std::string, std::size_t>> words;
    for (const std::string& word : setting_.words) words.emplace_back(word, words.size());
    std::size_t index = 0;
    read_word(given_, name_, index, words);
    value.set(index);
  }
  void operator()(const SizePlace& size) const {
    const auto pair = py::reinterpret_borrow<py::object>(given_);
    if (!py::isinstance<py::sequence>(pair) || py::len(pair) != 2) {
      throw py::value_error(name_ + " must be (width, height) in pixels, not " + shown(given_));
    }
    read(pair[py::int_(0)], name_, *size.width);
    read(pair[py::int_(1)], name_, *size.height);
  }
  void operator()(Palette*) const {
    throw py::type_error(name_ + " is read together with the material");
  }
  template <class Value>
  void operator()(Value* value) const {
    read(given_, name_, *value);
  }
  template <class Value>
  void operator()(std::optional<Value>* value) const {
    if (!setting_.automatic.empty() && py::isinstance<py::str>(given_) &&
        given_.equal(py::str(setting_.automatic))) {
      value->reset();
    } else {
      read(given_, name_, *value);
    }
  }

 private:
  const py::handle& given_;
  const std::string& name_;
  const Setting& setting_;
};

}  // namespace

void read(const py::handle& given, const std::string& name, const Setting& setting,
          const ValuePlace& place) {
  std::visit(ReadArgument(given, name, setting), place);
}

py::dict described_setting(const Setting& setting, const ValuePlace& place) {
  const Shown shown = std::visit(ShownOf(setting), place);
  py::dict row;
  row["name"] = argument_name(setting.name);
  row["field"] = setting.name;
  row["type"] = shown.type;
  row["default"] = shown.usual;
  row["values"] = setting.values_text();
  row["unit"] = setting.unit;
  row["range"] = shown.has_range ? setting.range_text() : "";
  row["example"] = setting.example.words();
  row["help"] = setting.help;
  row["more"] = setting.left_out.empty() ? setting.more
                                         : "Default: " + setting.left_out + "." +
                                               (setting.more.empty() ? "" : " ") + setting.more;
  return row;
}

}  // namespace qjulia::python

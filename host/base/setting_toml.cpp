#include "base/setting_toml.hpp"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "qjulia/base/error.hpp"
#include "qjulia/picture/picture.hpp"

namespace qjulia::base {
namespace {

class TomlValue {
 public:
  TomlValue(const toml::node& node, const Setting& setting) : node_(node), setting_(setting) {}

  void operator()(bool* value) const {
    const auto given = node_.value_exact<bool>();
    if (!given) throw InputError("give true or false");
    *value = *given;
  }
  void operator()(double* value) const { *value = number(); }
  void operator()(std::optional<double>* value) const {
    if (!setting_.automatic.empty() && node_.value<std::string>() == setting_.automatic) {
      value->reset();
    } else {
      *value = number();
    }
  }
  void operator()(std::string* value) const { *value = text(); }
  void operator()(const WordPlace& value) const { value.set(setting_.index_of(text())); }
  void operator()(Background* value) const { *value = background_from(text()); }
  void operator()(std::optional<LightColor>* value) const { *value = light_color_from(text()); }
  void operator()(std::vector<Lamp>* value) const {
    value->clear();
    const toml::array* const list = node_.as_array();
    if (list == nullptr) {
      value->push_back(lamp_from(text()));
      return;
    }
    for (const toml::node& lamp : *list) {
      value->push_back(lamp_from(lamp.value<std::string>().value_or("")));
    }
  }
  void operator()(std::optional<MaterialRange>* value) const {
    const toml::array* const list = node_.as_array();
    if (list == nullptr) throw InputError("give a list of numbers");
    std::vector<double> values;
    for (const toml::node& each : *list) {
      const auto number = each.value<double>();
      if (!number) throw InputError("give a list of numbers");
      values.push_back(*number);
    }
    *value = range_of(values);
    (*value)->validate();
  }
  void operator()(const SizePlace&) const { throw InputError("it cannot stand in a file"); }
  template <class Value>
  void operator()(Value*) const {
    throw InputError("it cannot stand in a file");
  }

 private:
  template <class Value>
  Value get(const char* wanted) const {
    const auto value = node_.value<Value>();
    if (!value) throw InputError(fmt::format("give {}", wanted));
    return *value;
  }
  std::string text() const { return get<std::string>("text in quotes"); }
  double number() const {
    const auto value = get<double>("a number");
    if (!std::isfinite(value)) throw InputError("give a finite number");
    return value;
  }

  const toml::node& node_;
  const Setting& setting_;
};

}  // namespace

void read_value(const toml::node& node, const Setting& setting, const ValuePlace& place) {
  std::visit(TomlValue(node, setting), place);
  try {
    expect_in_range(setting, place);
  } catch (const OptionError& error) {
    throw InputError(error.problem());
  }
}

}  // namespace qjulia::base

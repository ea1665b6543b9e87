#include "keywords.hpp"

#include <algorithm>
#include <array>

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// The library's names that Python spells otherwise.
constexpr std::array<std::pair<const char*, const char*>, 1> kOwnNames{{{"iterations", "n"}}};

}  // namespace

std::string argument_name(const std::string& field) {
  const auto found =
      std::ranges::find_if(kOwnNames, [&](const auto& names) { return field == names.first; });
  return found == kOwnNames.end() ? field : found->second;
}

py::handle Keywords::argument(const std::string& name) {
  known_.push_back(name);
  if (!given_.contains(name)) return {};
  const py::handle value = given_[py::str(name)];
  return value.is_none() ? py::handle() : value;
}

void Keywords::expect_no_more() const {
  for (const auto& [key, value] : given_) {
    std::string name;
    read(key, "a keyword", name);
    if (std::ranges::find(known_, name) != known_.end()) continue;
    py::list candidates;
    for (const std::string& known : known_) candidates.append(known);
    std::string hint;
    if (const std::string own = argument_name(name);
        own != name && std::ranges::find(known_, own) != known_.end()) {
      hint = own;
    } else if (const py::list close =
                   py::module_::import("difflib").attr("get_close_matches")(name, candidates, 1);
               !close.empty()) {
      hint = close[0].cast<std::string>();
    }
    std::string all;
    for (const std::string& known : known_) all += (all.empty() ? "" : ", ") + known;
    throw py::type_error(function_ + "() has no argument '" + name + "'; " +
                         (hint.empty() ? "it takes " + all : "did you mean '" + hint + "'?"));
  }
}

}  // namespace qjulia::python

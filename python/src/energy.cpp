#include "qjulia/energy/energy.hpp"

#include <algorithm>
#include <utility>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "parts.hpp"
#include "points.hpp"
#include "unlocked.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// A loss that Python computes for all samples at once, before the library asks for each.
struct PythonLoss {
  py::object function;  ///< None: the loss is one of the library's
  std::vector<double> values, derivatives;
};

/// An energy with its device, which it uses alone.
class PythonEnergy {
 public:
  PythonEnergy(const KeptMap& map, OpenDevice device, const EnergySamples& samples,
               EnergyOptions options, py::object loss)
      : device_(std::move(device)),
        samples_(samples.size()),
        loss_(std::make_unique<PythonLoss>(PythonLoss{std::move(loss), {}, {}})) {
    if (!loss_->function.is_none()) {
      options.loss = EnergyLoss::own;
      options.own = [own = loss_.get()](double, std::size_t i) {
        return std::pair(own->values[i], own->derivatives[i]);
      };
    }
    const DeviceUse use(device_);
    const Unlocked unlocked;
    energy_.emplace(device_.device, map.map, samples, options);
  }

  std::size_t size() const { return energy_->size(); }
  std::size_t samples() const { return samples_; }
  std::vector<double> unknowns() const { return energy_->unknowns(); }

  double value(const py::object& x) const {
    const std::vector<double> unknowns = numbers_for(x, "x", size());
    const DeviceUse use(device_);
    prepare_loss(unknowns);
    const Unlocked unlocked;
    return energy_->value(unknowns);
  }

  py::tuple value_and_gradient(const py::object& x) const {
    const std::vector<double> unknowns = numbers_for(x, "x", size());
    std::vector<double> gradient(size());
    const DeviceUse use(device_);
    prepare_loss(unknowns);
    const double energy = [&] {
      const Unlocked unlocked;
      return energy_->value_and_gradient(unknowns, gradient);
    }();
    const auto length = static_cast<py::ssize_t>(gradient.size());
    return py::make_tuple(energy, array_of<double>(std::move(gradient), {length}));
  }

  std::vector<double> field_at(const py::object& x) const {
    const std::vector<double> unknowns = numbers_for(x, "x", size());
    const DeviceUse use(device_);
    return field_at(unknowns);
  }

  MapPointer map_at(const py::object& x) const {
    return kept(energy_->map_at(numbers_for(x, "x", size())));
  }

 private:
  std::vector<double> field_at(const std::vector<double>& unknowns) const {
    const Unlocked unlocked;
    return energy_->field_at(unknowns);
  }

  /// Has Python's loss computed for the field of these unknowns.
  void prepare_loss(const std::vector<double>& unknowns) const {
    if (loss_->function.is_none()) return;
    const auto length = static_cast<py::ssize_t>(samples_);
    const py::object found = loss_->function(array_of<double>(field_at(unknowns), {length}));
    if (!py::isinstance<py::sequence>(found) || py::len(found) != 2) {
      throw py::type_error("loss must return two arrays, values and derivatives, not " +
                           shown(found));
    }
    loss_->values = numbers_for(found[py::int_(0)], "loss's values", samples_);
    loss_->derivatives = numbers_for(found[py::int_(1)], "loss's derivatives", samples_);
  }

  OpenDevice device_;
  std::size_t samples_;
  std::unique_ptr<PythonLoss> loss_;
  std::optional<Energy> energy_;
};

py::array array_of_all(std::vector<double> values) {
  const auto length = static_cast<py::ssize_t>(values.size());
  return array_of<double>(std::move(values), {length});
}

std::unique_ptr<PythonEnergy> made(const KeptMap& map, const OpenDevice& device,
                                   const py::object& points, const py::dict& given) {
  EnergyOptions options;
  EnergySamples samples;
  bool in_shape = true;
  py::object loss = py::none();
  Keywords keywords("Energy", given);
  keywords.take_word("space", in_shape, {{"shape", true}, {"map", false}});
  samples.points = given_points(map.map, points, in_shape).at;
  const auto take_numbers = [&](const char* name, std::vector<double>& values) {
    if (const auto array = keywords.argument(name)) {
      values = numbers_for(array, name, samples.size());
    }
  };
  take_numbers("sides", samples.sides);
  take_numbers("weights", samples.weights);
  take_numbers("targets", samples.targets);
  if (const auto wanted = keywords.argument("loss")) {
    if (PyCallable_Check(wanted.ptr()) != 0) {
      loss = py::reinterpret_borrow<py::object>(wanted);
    } else {
      read_word(wanted, "loss", options.loss,
                {{"distance", EnergyLoss::distance}, {"tanh", EnergyLoss::tanh}});
    }
  }
  keywords.take("alpha", options.alpha);
  keywords.take("n", options.iterations);
  keywords.take("slice", options.slice);
  keywords.take("escape", options.escape);
  keywords.take("precision", options.precision);
  keywords.expect_no_more();
  return std::make_unique<PythonEnergy>(map, device, samples, std::move(options), std::move(loss));
}

}  // namespace

void add_energy(py::module_& module) {
  py::class_<PythonEnergy>(module, "Energy")
      .def(py::init(&made))
      .def_property_readonly("size", &PythonEnergy::size)
      .def_property_readonly("samples", &PythonEnergy::samples)
      .def("unknowns", [](const PythonEnergy& self) { return array_of_all(self.unknowns()); })
      .def("value", &PythonEnergy::value)
      .def("value_and_gradient", &PythonEnergy::value_and_gradient)
      .def("field", [](const PythonEnergy& self,
                       const py::object& x) { return array_of_all(self.field_at(x)); })
      .def("map_at", &PythonEnergy::map_at);
}

}  // namespace qjulia::python

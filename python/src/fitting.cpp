/// Maps from meshes.

#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "mesh.hpp"
#include "parts.hpp"
#include "qjulia/edit/painting.hpp"
#include "qjulia/exact/exact_map.hpp"
#include "qjulia/exact/exact_settings.hpp"
#include "qjulia/fit/fit.hpp"
#include "qjulia/fit/fit_settings.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// Weights that a function of Python's gives. It has to outlive them, as has the watcher.
SampleWeights weights_of(const py::handle& call, Watcher& watcher) {
  if (PyCallable_Check(call.ptr()) == 0) {
    throw py::type_error("weights must be a function of points, not " + shown(call));
  }
  return [call, &watcher](std::span<const Eigen::Vector3d> points) {
    std::optional<std::vector<double>> found;
    watcher.on_caller([&] {
      const auto count = static_cast<py::ssize_t>(points.size());
      std::vector<Eigen::Vector3d> all(points.begin(), points.end());
      const py::object weights = call(array_of<double>(std::move(all), {count, 3}));
      found = numbers_for(weights, "weights", points.size());
    });
    if (!found) throw Interrupted();
    return *std::move(found);
  };
}

FitOptions fit_options(const py::dict& given, Watcher& watcher) {
  FitOptions options;
  Keywords keywords("fit", given);
  keywords.take_all(fit_settings(), options);
  keywords.take("schedule_text", options.schedule_text);
  if (const auto initial = keywords.argument("initial")) {
    options.initial = initial.cast<const KeptMap&>().map;
  }
  if (const auto weights = keywords.argument("weights")) {
    options.weights = weights_of(weights, watcher);
  }
  keywords.take("checkpoint", options.checkpoint);
  keywords.take("resume", options.resume);
  keywords.expect_no_more();
  options.validate();
  return options;
}

py::dict dict_of(const StageReport& stage) {
  py::dict all;
  all["name"] = stage.name;
  all["evaluations"] = stage.evaluations;
  all["energy_before"] = stage.energy_before;
  all["energy_after"] = stage.energy_after;
  all["seconds"] = stage.seconds;
  all["iou"] = stage.iou;
  all["n"] = stage.iterations;
  return all;
}

/// For programs: they do not change with the wording for people.
const char* key(StopReason reason) {
  switch (reason) {
    case StopReason::schedule_done:
      return "schedule_done";
    case StopReason::evaluations:
      return "evaluations";
    case StopReason::time_limit:
      return "time_limit";
    case StopReason::target_iou:
      return "target_iou";
    case StopReason::interrupted:
      return "interrupted";
    case StopReason::converged:
      return "converged";
  }
  return "";
}

py::dict dict_of(FitResult result) {
  py::dict all;
  all["stopped"] = key(result.stopped);
  all["evaluations"] = result.evaluations;
  all["seconds"] = result.seconds;
  all["mean_distance"] = result.mean_distance;
  py::list stages, warnings;
  for (const StageReport& stage : result.stages) stages.append(dict_of(stage));
  for (const std::string& warning : result.warnings) warnings.append(warning);
  all["stages"] = stages;
  all["warnings"] = warnings;
  all["summary"] = full_summary(result);
  all["map"] = kept(std::move(result.map));
  return all;
}

/// Who the user wants called. None of them is for whoever is None.
FitObserver observer(Watcher& watcher, const py::object& on_stage,
                     const py::object& on_evaluation) {
  FitObserver all;
  if (!on_evaluation.is_none()) {
    all.on_evaluation = [&watcher, call = py::handle(on_evaluation)](double energy) {
      watcher.on_caller([&] { call(energy); });
    };
  }
  if (!on_stage.is_none()) {
    all.on_stage = [&watcher, call = py::handle(on_stage)](const StageReport& stage,
                                                           const Map& map) {
      watcher.on_caller([&] { call(dict_of(stage), kept(map)); });
    };
  }
  return all;
}

py::dict fitted(const OpenDevice& device, const TriangleMesh& mesh, const py::object& on_stage,
                const py::object& on_evaluation, const py::object& on_progress,
                const py::dict& given) {
  Watcher watcher(true);
  FitOptions options = fit_options(given, watcher);
  options.observer = observer(watcher, on_stage, on_evaluation);
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  FitResult result;
  watcher.run(device, [&] { result = fit(device.device, mesh, options, monitor); });
  return dict_of(std::move(result));
}

/// A fit that Python takes stage by stage. Whoever has it keeps what it calls.
class PythonFit {
 public:
  PythonFit(OpenDevice device, const TriangleMesh& mesh, const py::object& on_evaluation,
            const py::object& on_progress, const py::dict& given)
      : device_(std::move(device)) {
    FitOptions options = fit_options(given, watcher_);
    options.observer = observer(watcher_, py::none(), on_evaluation);
    const ProgressMonitor monitor = watcher_.monitor(on_progress);
    run([&] { fit_.emplace(device_.device, mesh, options, monitor); });
  }

  py::object step() {
    std::optional<StageReport> stage;
    run([&] { stage = fit_->step(); });
    if (stage) watcher_.hear_ctrl_c();
    return stage ? py::object(dict_of(*stage)) : py::none();
  }

  MapPointer map() {
    Map map;
    run([&] { map = fit_->map(); });
    return kept(std::move(map));
  }

  py::dict result() {
    FitResult result;
    run([&] { result = fit_->result(); });
    return dict_of(std::move(result));
  }

  py::list stages() {
    const Turn turn(is_running_);
    py::list all;
    for (const StageReport& stage : fit_->stages()) all.append(dict_of(stage));
    return all;
  }

  py::object stopped() {
    const Turn turn(is_running_);
    const auto reason = fit_->stopped();
    return reason ? py::object(py::str(key(*reason))) : py::none();
  }

 private:
  /// Marks the fit as in use. Calls of other threads and of its own callbacks come in between,
  /// since Python's lock is let go.
  class Turn {
   public:
    explicit Turn(bool& is_running) : is_running_(is_running) {
      if (is_running) {
        PyErr_SetString(PyExc_RuntimeError,
                        "this fit is in the middle of another call; wait until that has returned");
        throw py::error_already_set();
      }
      is_running = true;
    }
    ~Turn() { is_running_ = false; }
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    bool& is_running_;
  };

  void run(const std::function<void()>& work) {
    const Turn turn(is_running_);
    watcher_.run(device_, work);
  }

  OpenDevice device_;
  Watcher watcher_{true};
  std::optional<Fit> fit_;
  bool is_running_ = false;
};

/// What gives the grooves their pattern: a word with numbers, or another map.
void take_versor(Keywords& keywords, ExactMapOptions& options) {
  RandomRoots roots;
  NoiseVersor noise;
  noise.scale *= kMapSide;  // cells along the longest side, as users give it
  std::string word = "random";
  const auto given = keywords.argument("versor");
  const bool is_map = given && py::isinstance<KeptMap>(given);
  if (given && !is_map) {
    read_word<std::string>(given, "versor", word,
                           {{"random", "random"}, {"noise", "noise"}, {"noise4", "noise4"}});
  }
  if (is_map) {
    const Map& map = given.cast<const KeptMap&>().map;
    if (!std::holds_alternative<FactorsVersor>(map.dynamics.versor)) {
      throw py::value_error("versor: it is a " + map.dynamics.kind() +
                            " map; give one whose versor is of factors");
    }
    options.versor = FactorsOfMap{map.dynamics.factors, map.frame.shape_to_map};
    options.phase = map.dynamics.phase;
  } else if (word == "random") {
    keywords.take("roots", roots.roots);
    keywords.take("seed", roots.seed);
    options.versor = roots;
  } else {
    keywords.take("octaves", noise.octaves);
    keywords.take("scale", noise.scale);
    std::uint64_t seed = noise.seed;
    keywords.take("seed", seed);
    if (seed > 0xffffffffU) throw py::value_error("seed must be below 2**32 for a noise");
    noise.seed = static_cast<std::uint32_t>(seed);
    noise.scale /= kMapSide;
    if (word == "noise4") noise.values = NoiseValues::quaternions;
    options.versor = noise;
  }
}

MapPointer shaped(const OpenDevice& device, const TriangleMesh& mesh, const py::object& on_progress,
                  const py::dict& given) {
  ExactMapOptions options;
  PaintOptions paint;
  Keywords keywords("shape", given);
  keywords.take_all(exact_settings(), options);
  take_versor(keywords, options);
  keywords.take("phase", options.phase);
  keywords.take("thickness", paint.thickness);
  keywords.expect_no_more();
  options.validate();
  paint.validate();
  Map map;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] {
    map = exact_map(device.device, mesh, options, monitor);
    if (paint.thickness) map.layers.paint = painted(device.device, map, paint, monitor);
  });
  return kept(std::move(map));
}

}  // namespace

void add_fitting(py::module_& module) {
  module.def("fit", &fitted);
  py::class_<PythonFit>(module, "Fit")
      .def(py::init<OpenDevice, const TriangleMesh&, const py::object&, const py::object&,
                    const py::dict&>())
      .def("step", &PythonFit::step)
      .def("map", &PythonFit::map)
      .def("result", &PythonFit::result)
      .def("stages", &PythonFit::stages)
      .def("stopped", &PythonFit::stopped);
  module.def("shape", &shaped);
  module.def("fit_settings", [] { return described(fit_settings(), FitOptions{}); });
  module.def("exact_settings", [] { return described(exact_settings(), ExactMapOptions{}); });
}

}  // namespace qjulia::python

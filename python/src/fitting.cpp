/// Maps from meshes.

#include <utility>

#include "keywords.hpp"
#include "map.hpp"
#include "mesh.hpp"
#include "parts.hpp"
#include "qjulia/exact_map.hpp"
#include "qjulia/fit.hpp"
#include "qjulia/painting.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

void take_detail(Keywords& keywords, DetailChoice& detail) {
  const auto given = keywords.argument("detail");
  if (!given) return;
  if (!py::isinstance<py::str>(given)) {
    double number = 0;
    read(given, "detail", number);
    detail = number;
    return;
  }
  std::vector<std::pair<std::string, DetailChoice>> words;
  for (const auto word :
       {DetailWord::automatic, DetailWord::smooth, DetailWord::clear, DetailWord::wild}) {
    words.emplace_back(to_string(word), word);
  }
  read_word(given, "detail", detail, words);
}

FitOptions fit_options(const py::dict& given) {
  FitOptions options;
  Keywords keywords("fit", given);
  keywords.take("factors", options.factors);
  keywords.take("max_factors", options.max_factors);
  take_detail(keywords, options.detail);
  keywords.take("seed", options.seed);
  keywords.take("time_limit", options.time_limit);
  keywords.take("max_evaluations", options.max_evaluations);
  keywords.take("target_iou", options.target_iou);
  keywords.take_word("unknowns", options.unknowns,
                     {{"all", Unknowns::all}, {"exponents", Unknowns::exponents}});
  keywords.take_word("placement", options.placement,
                     {{"depth", Placement::depth}, {"paper", Placement::paper}});
  keywords.take("precision", options.precision);
  keywords.take("schedule", options.schedule);
  keywords.take("schedule_text", options.schedule_text);
  if (const auto initial = keywords.argument("initial")) {
    options.initial = initial.cast<const KeptMap&>().map;
  }
  keywords.take("polish", options.polish);
  keywords.take("sample_parts", options.sample_parts);
  keywords.take("checkpoint", options.checkpoint);
  keywords.take("steepness", options.steepness);
  keywords.take("up", options.up);
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
  FitOptions options = fit_options(given);
  Watcher watcher(true);
  options.observer = observer(watcher, on_stage, on_evaluation);
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  FitResult result;
  watcher.run(device, [&] { result = fit(device.device, mesh, options, monitor); });
  return dict_of(std::move(result));
}

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
  keywords.take("resolution", options.resolution);
  take_detail(keywords, options.detail);
  keywords.take("steepness", options.steepness);
  keywords.take("up", options.up);
  take_versor(keywords, options);
  keywords.take("phase", options.phase);
  keywords.take_word("fourth", options.fourth,
                     {{"round", FourthCoordinate::round}, {"ignored", FourthCoordinate::ignored}});
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
  module.def("shape", &shaped);
}

}  // namespace qjulia::python

/// Fields at points and on grids.

#include <algorithm>
#include <cmath>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "parts.hpp"
#include "points.hpp"
#include "qjulia/map/sample.hpp"
#include "qjulia/map/sample_settings.hpp"
#include "unlocked.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// Below it a call is over before a user could press Ctrl-C: points times iterations times factors.
constexpr double kShortWork = 2e7;

bool is_short(const Map& map, std::size_t points, int iterations) {
  const auto factors = static_cast<double>(std::max<std::size_t>(map.dynamics.factors.size(), 16));
  return static_cast<double>(points) * std::max(iterations, 1) * factors < kShortWork;
}

std::shared_ptr<const Field> field_of(KeptMap& self, const OpenDevice& device, Precision precision,
                                      double escape) {
  const device::Context* const context = &device.device.context();
  KeptField& kept = self.kept;
  if (kept.field && kept.context == context && kept.layout == device.device.layout() &&
      kept.precision == precision && kept.escape == escape) {
    return kept.field;
  }
  auto field = [&] {
    const Unlocked unlocked;
    return std::make_shared<const Field>(device.device, self.map, precision,
                                         StopRadii{.escape = escape});
  }();
  kept = {context, device.device.layout(), precision, escape, field};
  return field;
}

/// What all functions of points take.
struct Query {
  int iterations = 1;
  bool in_shape = true;
  Precision precision = Precision::single;
  double escape = kUsualEscape;
};

Query query(Keywords& keywords) {
  Query asked;
  keywords.take("n", asked.iterations);
  keywords.take_word("space", asked.in_shape, {{"shape", true}, {"map", false}});
  keywords.take("precision", asked.precision);
  keywords.take("escape", asked.escape);
  return asked;
}

/// Runs `evaluate(field)` on the calling thread where it is short, else so that Ctrl-C ends it.
template <class Evaluate>
auto evaluated(KeptMap& self, const OpenDevice& device, const Query& asked,
               const GivenPoints& points, const Evaluate& evaluate) {
  if (!is_short(self.map, points.at.size(), asked.iterations)) {
    return watched(device, [&](const std::stop_token& stop) {
      return evaluate(
          Field(device.device, self.map, asked.precision, StopRadii{.escape = asked.escape}, stop));
    });
  }
  const DeviceUse use(device);
  const auto field = field_of(self, device, asked.precision, asked.escape);
  const Unlocked unlocked;
  return evaluate(*field);
}

/// Gradients by the user's coordinates, as many of them as points have.
py::array gradient_array(const std::vector<Quaternion>& gradients, const GivenPoints& given) {
  const auto count = static_cast<py::ssize_t>(gradients.size());
  std::vector<double> values;
  values.reserve(gradients.size() * static_cast<std::size_t>(given.length));
  for (const Quaternion& gradient : gradients) {
    const auto all = coordinates(gradient);
    for (int i = 0; i < given.length; ++i) {
      values.push_back(given.slope * all[static_cast<std::size_t>(i)]);
    }
  }
  return array_of<double>(std::move(values), {count, given.length});
}

py::object field_at(KeptMap& self, const OpenDevice& device, const py::object& points,
                    const py::dict& given) {
  bool gradient = false;
  Keywords keywords("field", given);
  const Query asked = query(keywords);
  keywords.take("gradient", gradient);
  keywords.expect_no_more();
  const GivenPoints at = given_points(self.map, points, asked.in_shape);
  const auto count = static_cast<py::ssize_t>(at.at.size());
  auto values = evaluated(self, device, asked, at,
                          [&](const Field& field) { return field.at(at.at, asked.iterations); });
  py::array result = array_of<double>(std::move(values), {count});
  if (!gradient) return result;
  const auto slopes = evaluated(self, device, asked, at, [&](const Field& field) {
    return field.gradient_at(at.at, asked.iterations);
  });
  return py::make_tuple(result, gradient_array(slopes, at));
}

/// What else there is to ask of points. Quaternions are in the map's coordinates.
enum class Asked { versors, images, orbits, escape_counts };

template <Asked kAsked>
py::array asked_of_points(KeptMap& self, const OpenDevice& device, const py::object& points,
                          const py::dict& given) {
  constexpr const char* kNames[] = {"versors", "images", "orbits", "escape_counts"};
  Keywords keywords(kNames[static_cast<std::size_t>(kAsked)], given);
  const Query asked = query(keywords);
  keywords.expect_no_more();
  const GivenPoints at = given_points(self.map, points, asked.in_shape);
  const int n = asked.iterations;
  const auto count = static_cast<py::ssize_t>(at.at.size());
  auto found = evaluated(self, device, asked, at, [&](const Field& field) {
    if constexpr (kAsked == Asked::versors) return field.versors_at(at.at);
    if constexpr (kAsked == Asked::images) return field.images_at(at.at, n);
    if constexpr (kAsked == Asked::orbits) return field.orbits_at(at.at, n);
    if constexpr (kAsked == Asked::escape_counts) return field.escape_counts_at(at.at, n);
  });
  if constexpr (kAsked == Asked::escape_counts) {
    return array_of<int>(std::move(found), {count});
  } else if constexpr (kAsked == Asked::orbits) {
    return array_of<double>(std::move(found), {count, n + 1, 4});
  } else {
    return array_of<double>(std::move(found), {count, 4});
  }
}

py::array box_array(const Box& box) {
  return array_of<double>(std::vector<Eigen::Vector3d>{box.low, box.high}, {2, 3});
}

/// F_n at the centres of a box's cells, [x][y][z], and the box.
py::tuple sampled(const KeptMap& self, const OpenDevice& device, const py::object& on_progress,
                  const py::dict& given) {
  SampleOptions options;
  Keywords keywords("sample", given);
  keywords.take_all(sample_settings(), options);
  keywords.expect_no_more();
  options.validate();
  CellGrid grid;
  std::vector<double> values;
  Watcher watcher;
  const ProgressMonitor monitor = watcher.monitor(on_progress);
  watcher.run(device, [&] {
    grid = sample_grid(device.device, self.map, options, monitor.stop);
    values.reserve(grid.size());
    sample_field(
        device.device, self.map, options, grid, CellOrder::z_fastest,
        [&](std::span<const double> part) {
          values.insert(values.end(), part.begin(), part.end());
        },
        monitor);
  });
  const std::vector<py::ssize_t> shape{grid.cells[0], grid.cells[1], grid.cells[2]};
  py::object cells = array_of<double>(std::move(values), shape);
  if (options.precision == Precision::single) cells = cells.attr("astype")("float32");
  return py::make_tuple(cells, box_array(grid.box));
}

}  // namespace

void add_evaluation(py::module_& module) {
  module.def("field", &field_at);
  module.def("versors", &asked_of_points<Asked::versors>);
  module.def("images", &asked_of_points<Asked::images>);
  module.def("orbits", &asked_of_points<Asked::orbits>);
  module.def("escape_counts", &asked_of_points<Asked::escape_counts>);
  module.def("sample", &sampled);
  module.def("sample_settings", [] { return described(sample_settings(), SampleOptions{}); });
}

}  // namespace qjulia::python

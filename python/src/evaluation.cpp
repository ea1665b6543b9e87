/// Fields at points and on grids.

#include <algorithm>
#include <cmath>

#include "arrays.hpp"
#include "keywords.hpp"
#include "map.hpp"
#include "parts.hpp"
#include "qjulia/sample.hpp"
#include "watched.hpp"

namespace py = pybind11;

namespace qjulia::python {
namespace {

/// Points in map coordinates, as the user gave them in one space or the other.
struct GivenPoints {
  std::vector<Quaternion> at;
  int length = 3;    ///< of a row
  double slope = 1;  ///< map units a unit of the points
};

GivenPoints given_points(const Map& map, const py::object& points, bool in_shape) {
  const DoubleArray rows = rows_of_numbers(points, "points", {3, 4});
  GivenPoints given;
  given.length = static_cast<int>(rows.shape(1));
  if (given.length == 4 && in_shape) {
    throw py::value_error(
        "points of shape (N, 4) are in map coordinates; give space=\"map\" with them");
  }
  const ShapeToMap& to_map = map.frame.shape_to_map;
  if (in_shape) given.slope = to_map.scale;
  given.at.reserve(static_cast<std::size_t>(rows.shape(0)));
  const double* row = rows.data();
  for (py::ssize_t i = 0; i < rows.shape(0); ++i, row += given.length) {
    Eigen::Vector3d x(row[0], row[1], row[2]);
    if (in_shape) x = to_map.to_map(x);
    given.at.push_back({x.x(), x.y(), x.z(), given.length == 4 ? row[3] : map.dynamics.slice});
  }
  return given;
}

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
    const py::gil_scoped_release release;
    return std::make_shared<const Field>(device.device, self.map, precision,
                                         StopRadii{.escape = escape});
  }();
  kept = {context, device.device.layout(), precision, escape, field};
  return field;
}

/// Runs `evaluate(field)` on the calling thread where it is short, else so that Ctrl-C ends it.
template <class Evaluate>
auto evaluated(KeptMap& self, const OpenDevice& device, Precision precision, double escape,
               bool at_once, const Evaluate& evaluate) {
  if (!at_once) {
    return watched(device, [&](const std::stop_token& stop) {
      return evaluate(Field(device.device, self.map, precision, StopRadii{.escape = escape}, stop));
    });
  }
  const DeviceUse use(device);
  const auto field = field_of(self, device, precision, escape);
  const py::gil_scoped_release release;
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
  int iterations = 1;
  bool gradient = false, in_shape = true;
  Precision precision = Precision::single;
  double escape = kUsualEscape;
  Keywords keywords("field", given);
  keywords.take("n", iterations);
  keywords.take("gradient", gradient);
  keywords.take_word("space", in_shape, {{"shape", true}, {"map", false}});
  keywords.take("precision", precision);
  keywords.take("escape", escape);
  keywords.expect_no_more();
  const GivenPoints at = given_points(self.map, points, in_shape);
  const auto count = static_cast<py::ssize_t>(at.at.size());
  const bool at_once = is_short(self.map, at.at.size(), iterations);
  auto values = evaluated(self, device, precision, escape, at_once,
                          [&](const Field& field) { return field.at(at.at, iterations); });
  py::array result = array_of<double>(std::move(values), {count});
  if (!gradient) return result;
  const auto slopes = evaluated(self, device, precision, escape, at_once,
                                [&](const Field& field) { return field.gradient_at(at.at); });
  return py::make_tuple(result, gradient_array(slopes, at));
}

py::array box_array(const Box& box) {
  return array_of<double>(std::vector<Eigen::Vector3d>{box.low, box.high}, {2, 3});
}

/// F_n at the centres of a box's cells, [x][y][z], and the box.
py::tuple sampled(const KeptMap& self, const OpenDevice& device, const py::object& on_progress,
                  const py::dict& given) {
  SampleOptions options;
  Keywords keywords("sample", given);
  keywords.take("resolution", options.resolution);
  keywords.take("n", options.iterations);
  keywords.take("box", options.box);
  keywords.take("escape", options.escape);
  keywords.take("precision", options.precision);
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
  module.def("sample", &sampled);
}

}  // namespace qjulia::python

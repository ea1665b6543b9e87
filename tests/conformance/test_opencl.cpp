// Devices made of a program's own OpenCL, and kernels of its own on maps.

#include <algorithm>
#include <array>
#include <catch2/catch_all.hpp>
#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "distance_map.hpp"
#include "qjulia/base/error.hpp"
#include "qjulia/map/opencl.hpp"
#include "qjulia/map/paint.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;
using Catch::Matchers::ContainsSubstring;

namespace {

void expect(cl_int code) {
  if (code != CL_SUCCESS) throw std::runtime_error("OpenCL error " + std::to_string(code));
}

/// An object of OpenCL that is released at the end of its scope.
template <class Handle, cl_int (*kRelease)(Handle)>
class Owned {
 public:
  explicit Owned(Handle handle) : handle_(handle) {}
  Owned(Owned&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Owned(const Owned&) = delete;
  Owned& operator=(const Owned&) = delete;
  ~Owned() {
    if (handle_ != nullptr) kRelease(handle_);
  }
  Handle get() const { return handle_; }

 private:
  Handle handle_;
};
using OwnedContext = Owned<cl_context, clReleaseContext>;
using OwnedQueue = Owned<cl_command_queue, clReleaseCommandQueue>;
using OwnedDevice = Owned<cl_device_id, clReleaseDevice>;
using OwnedBuffer = Owned<cl_mem, clReleaseMemObject>;
using OwnedKernel = Owned<cl_kernel, clReleaseKernel>;

OwnedContext make_context(const std::vector<cl_device_id>& devices) {
  cl_int code = CL_SUCCESS;
  const cl_context context = clCreateContext(nullptr, static_cast<cl_uint>(devices.size()),
                                             devices.data(), nullptr, nullptr, &code);
  expect(code);
  return OwnedContext(context);
}

OwnedQueue make_queue(const OwnedContext& context, cl_device_id device,
                      cl_command_queue_properties properties = 0) {
  cl_int code = CL_SUCCESS;
  const cl_command_queue queue = clCreateCommandQueue(context.get(), device, properties, &code);
  expect(code);
  return OwnedQueue(queue);
}

OwnedBuffer make_buffer(const Device& device, std::size_t bytes) {
  cl_int code = CL_SUCCESS;
  const cl_mem buffer =
      clCreateBuffer(opencl_context(device), CL_MEM_READ_WRITE, bytes, nullptr, &code);
  expect(code);
  return OwnedBuffer(buffer);
}

/// The id of the device that tests run on.
cl_device_id tested() { return opencl_device(test::shared_device()); }

/// A part of that device; none where it cannot be divided.
std::optional<OwnedDevice> part_of_it() {
  const std::array<cl_device_partition_property, 3> parts{CL_DEVICE_PARTITION_EQUALLY, 1, 0};
  std::vector<cl_device_id> made(1024);
  cl_uint count = 0;
  if (clCreateSubDevices(tested(), parts.data(), 1024, made.data(), &count) != CL_SUCCESS) {
    return std::nullopt;
  }
  for (cl_uint i = 1; i < count; ++i) clReleaseDevice(made[i]);
  return OwnedDevice(made[0]);
}

cl_uint references(const OwnedContext& context) {
  cl_uint count = 0;
  expect(
      clGetContextInfo(context.get(), CL_CONTEXT_REFERENCE_COUNT, sizeof count, &count, nullptr));
  return count;
}

std::vector<Quaternion> points_about(std::size_t count) {
  std::mt19937_64 bits(8);
  std::vector<Quaternion> points;
  for (std::size_t i = 0; i < count; ++i) {
    points.push_back({test::uniform(bits, -1.5, 1.5), test::uniform(bits, -1.5, 1.5),
                      test::uniform(bits, -1.5, 1.5), test::uniform(bits, -0.2, 0.2)});
  }
  return points;
}

Map painted_map_with_portal() {
  Map map = test::random_map(12, 0.1, 0.6, 5);
  Paint paint;
  paint.cells = {6, 6, 6};
  paint.origin = {-1.2, -1.2, -1.2};
  paint.step = 0.4;
  for (std::size_t i = 0; i < paint.size(); ++i) {
    paint.shares.push_back(static_cast<std::uint8_t>(255 - 11 * i % 200));
  }
  map.layers.paint = paint;
  map.layers.portals = {
      {{0.9, 0.2, 0.1}, 0.5, 2.5, {{0, 1, 1}, 50}, {0.1, 0, 0}, PortalMask::none}};
  return map;
}

const char* const kField = R"(
#include "map.clh"
kernel void own_field(global const real* points, int stride, global const real* map, int factors,
                      global real* field) {
  int g = (int)get_global_id(0);
  lane_store(map_modulus(q_load(points, stride, g), map, factors), field, g);
}
)";

template <class Value>
void set_argument(const OwnedKernel& kernel, cl_uint index, const Value& value) {
  expect(clSetKernelArg(kernel.get(), index, sizeof value, &value));
}

/// What the kernel above finds at the points.
template <class Real>
std::vector<double> own_field(const Device& device, const Map& map, Precision precision,
                              const std::vector<Quaternion>& points) {
  const MapBuffer buffer = map_buffer(device, map, precision);
  const auto lanes = static_cast<std::size_t>(buffer.lane_width);
  const std::size_t items = (points.size() + lanes - 1) / lanes;
  const std::size_t stride = items * lanes;
  std::vector<Real> in(4 * stride), out(stride);
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) {
      in[c * stride + i] = static_cast<Real>(coordinates(points[i])[c]);
    }
  }
  const OwnedBuffer places = make_buffer(device, in.size() * sizeof(Real));
  const OwnedBuffer field = make_buffer(device, out.size() * sizeof(Real));
  const OwnedKernel kernel(build_kernel(device, map, precision, kField, "own_field"));
  set_argument(kernel, 0, places.get());
  set_argument(kernel, 1, static_cast<cl_int>(stride));
  set_argument(kernel, 2, buffer.map);
  set_argument(kernel, 3, buffer.factors);
  set_argument(kernel, 4, field.get());
  const cl_command_queue queue = opencl_queue(device);
  expect(clEnqueueWriteBuffer(queue, places.get(), CL_FALSE, 0, in.size() * sizeof(Real), in.data(),
                              0, nullptr, nullptr));
  expect(clEnqueueNDRangeKernel(queue, kernel.get(), 1, nullptr, &items, nullptr, 0, nullptr,
                                nullptr));
  expect(clEnqueueReadBuffer(queue, field.get(), CL_TRUE, 0, out.size() * sizeof(Real), out.data(),
                             0, nullptr, nullptr));
  return {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(points.size())};
}

/// Four arrays of points as a BufferField takes them, with any numbers past the points.
template <class Real>
std::vector<Real> arrays_of(const std::vector<Quaternion>& points, std::size_t stride) {
  std::vector<Real> in(4 * stride, Real(7));
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) {
      in[c * stride + i] = static_cast<Real>(coordinates(points[i])[c]);
    }
  }
  return in;
}

/// Checks a BufferField against a Field, from buffers to buffers.
template <class Real>
void check_buffer_field(const Device& device, const Map& map, Precision precision) {
  const auto points = points_about(101);
  const BufferField in_buffers(device, map, precision);
  const std::size_t stride = in_buffers.stride(points.size());
  CHECK(stride % static_cast<std::size_t>(device.lane_width(precision)) == 0);
  const auto in = arrays_of<Real>(points, stride);
  const OwnedBuffer places = make_buffer(device, in.size() * sizeof(Real));
  const OwnedBuffer results = make_buffer(device, in.size() * sizeof(Real));
  const cl_command_queue queue = opencl_queue(device);
  expect(clEnqueueWriteBuffer(queue, places.get(), CL_TRUE, 0, in.size() * sizeof(Real), in.data(),
                              0, nullptr, nullptr));
  std::vector<Real> found(4 * stride);
  const auto read = [&] {
    expect(clEnqueueReadBuffer(queue, results.get(), CL_TRUE, 0, found.size() * sizeof(Real),
                               found.data(), 0, nullptr, nullptr));
  };
  const Field field(device, map, precision);
  for (const int iterations : {1, 4}) {
    in_buffers.at(places.get(), points.size(), iterations, results.get());
    read();
    const auto expected = field.at(points, iterations);
    CHECK(std::vector<double>(found.begin(), found.begin() + 101) == expected);
  }
  in_buffers.gradient_at(places.get(), points.size(), results.get());
  read();
  const auto gradients = field.gradient_at(points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    CHECK(found[i] == gradients[i].x);
    CHECK(found[3 * stride + i] == gradients[i].w);
  }
}

}  // namespace

TEST_CASE("a device made of a program's own OpenCL computes what the chosen one does") {
  const auto properties = GENERATE(as<cl_command_queue_properties>(), 0, CL_QUEUE_PROFILING_ENABLE);
  const Map map = test::random_map(37, 0.05, 0.4, 71);
  const auto points = points_about(1000);
  const OwnedContext context = make_context({tested()});
  const OwnedQueue queue = make_queue(context, tested(), properties);
  const Device own = device_from_opencl(context.get(), tested(), queue.get());
  CHECK(opencl_context(own) == context.get());
  CHECK(opencl_device(own) == tested());
  CHECK(opencl_queue(own) == queue.get());
  const DeviceInfo& chosen = test::shared_device().info();
  CHECK(own.info().name == chosen.name);
  CHECK(own.info().platform == chosen.platform);
  CHECK(own.info().index == chosen.index);
  for (const Precision precision : kPrecisions) {
    if (!test::can_check(own, precision)) continue;
    const Field mine(own, map, precision);
    const Field theirs(test::shared_device().with_layout(own.layout()), map, precision);
    CHECK(mine.at(points, 1) == theirs.at(points, 1));
    CHECK(mine.at(points, 5) == theirs.at(points, 5));
    CHECK(Field(own.sibling(), map, precision).at(points, 5) == theirs.at(points, 5));
  }
  const auto times = own.kernel_times();
  REQUIRE(times.contains("field_at_points"));
  CHECK(times.at("field_at_points").launches >= 2);
}

TEST_CASE("a device keeps the program's OpenCL and lets it go") {
  const OwnedContext context = make_context({tested()});
  const cl_uint before = references(context);
  {
    std::optional<Device> own;
    {
      const OwnedQueue queue = make_queue(context, tested());
      own = device_from_opencl(context.get(), tested(), queue.get());
    }
    CHECK(references(context) > before);
    const Field field(*own, test::random_map(9, 0.1, 0.5, 3));
    CHECK(field.at(points_about(20)).size() == 20);
  }
  CHECK(references(context) == before);
}

TEST_CASE("a device that is not in the context is refused, be it a part of one that is") {
  const auto part = part_of_it();
  if (!part) {
    WARN("the device cannot be divided: not checked");
    return;
  }
  const OwnedContext context = make_context({tested()});
  const OwnedQueue queue = make_queue(context, tested());
  CHECK_THROWS_AS(device_from_opencl(context.get(), part->get(), queue.get()), InputError);
  CHECK_THROWS_WITH(device_from_opencl(context.get(), part->get(), queue.get()),
                    ContainsSubstring("device is not in the context"));
}

TEST_CASE("contexts, devices and queues that do not fit together are refused") {
  const OwnedContext context = make_context({tested()}), other = make_context({tested()});
  const OwnedQueue queue = make_queue(context, tested()), foreign = make_queue(other, tested());
  CHECK_THROWS_AS(device_from_opencl(context.get(), tested(), foreign.get()), InputError);
  CHECK_THROWS_WITH(device_from_opencl(context.get(), tested(), foreign.get()),
                    ContainsSubstring("queue belongs to another context"));
  CHECK_THROWS_WITH(device_from_opencl(nullptr, tested(), queue.get()),
                    ContainsSubstring("context is null"));
  CHECK_THROWS_WITH(device_from_opencl(context.get(), nullptr, queue.get()),
                    ContainsSubstring("device is null"));
  CHECK_THROWS_WITH(device_from_opencl(context.get(), tested(), nullptr),
                    ContainsSubstring("queue is null"));

  cl_int code = CL_SUCCESS;
  const OwnedQueue unordered(
      clCreateCommandQueue(context.get(), tested(), CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE, &code));
  if (code == CL_SUCCESS) {
    CHECK_THROWS_WITH(device_from_opencl(context.get(), tested(), unordered.get()),
                      ContainsSubstring("out of order"));
  }
}

TEST_CASE("a kernel of one's own finds the field of every kind of map") {
  const auto [name, map] =
      GENERATE(table<std::string, Map>({{"factors", test::random_map(37, 0.05, 0.4, 71)},
                                        {"quadratic", quadratic_map({-0.2, 0.6, 0.2, 0.1})},
                                        {"distance", test::distance_map()},
                                        {"painted, with a portal", painted_map_with_portal()}}));
  const int width = GENERATE(from_range(test::lane_widths()));
  CAPTURE(name, width);
  const OwnedContext context = make_context({tested()});
  const OwnedQueue queue = make_queue(context, tested());
  const Device device =
      device_from_opencl(context.get(), tested(), queue.get()).with_lane_width(width);
  const auto points = points_about(101);
  for (const Precision precision : kPrecisions) {
    if (!test::can_check(device, precision)) continue;
    CAPTURE(to_string(precision));
    const auto expected = Field(device, map, precision).at(points);
    const auto found = precision == Precision::dbl
                           ? own_field<double>(device, map, precision, points)
                           : own_field<float>(device, map, precision, points);
    CHECK(found == expected);
  }
}

TEST_CASE("a field in buffers is the field of the same points") {
  const auto [name, map] =
      GENERATE(table<std::string, Map>({{"factors", test::random_map(37, 0.05, 0.4, 71)},
                                        {"painted, with a portal", painted_map_with_portal()}}));
  const int width = GENERATE(from_range(test::lane_widths()));
  CAPTURE(name, width);
  const OwnedContext context = make_context({tested()});
  const OwnedQueue queue = make_queue(context, tested());
  const Device device =
      device_from_opencl(context.get(), tested(), queue.get()).with_lane_width(width);
  check_buffer_field<float>(device, map, Precision::single);
  if (test::can_check(device, Precision::dbl)) {
    check_buffer_field<double>(device, map, Precision::dbl);
  }
}

TEST_CASE("buffers that a field cannot use are refused by name") {
  const OwnedContext context = make_context({tested()});
  const OwnedQueue queue = make_queue(context, tested());
  const Device device = device_from_opencl(context.get(), tested(), queue.get());
  const BufferField field(device, test::random_map(9, 0.1, 0.5, 3));
  const std::size_t array = field.stride(100) * sizeof(float);
  const OwnedBuffer points = make_buffer(device, 4 * array), found = make_buffer(device, array);
  const OwnedBuffer foreign = make_buffer(test::shared_device(), 4 * array);
  CHECK(field.stride(0) == 0);
  CHECK_NOTHROW(field.at(points.get(), 100, 2, found.get()));
  CHECK_NOTHROW(field.at(points.get(), 0, 2, found.get()));
  CHECK_THROWS_WITH(field.at(nullptr, 100, 1, found.get()), ContainsSubstring("points: is null"));
  CHECK_THROWS_WITH(field.at(points.get(), 100, 1, nullptr), ContainsSubstring("field: is null"));
  CHECK_THROWS_WITH(field.at(found.get(), 100, 1, found.get()), ContainsSubstring("points: has"));
  CHECK_THROWS_WITH(field.gradient_at(points.get(), 100, found.get()),
                    ContainsSubstring("gradient: has"));
  CHECK_THROWS_WITH(field.at(foreign.get(), 100, 1, found.get()),
                    ContainsSubstring("another context"));
  CHECK_THROWS_WITH(field.at(points.get(), 100, 0, found.get()), ContainsSubstring("iterations"));
  CHECK_THROWS_WITH(field.at(points.get(), 100, 17, found.get()), ContainsSubstring("iterations"));
  CHECK_THROWS_WITH(field.at(points.get(), std::size_t{1} << 40, 1, found.get()),
                    ContainsSubstring("count"));
}

TEST_CASE("sources that do not build say where, and a kernel that is not there is named") {
  const Device& device = test::shared_device();
  const Map map = test::random_map(8, 0.5, 1.5, 3);
  const auto build = [&](const std::string& source, const std::string& name) {
    return OwnedKernel(build_kernel(device, map, Precision::single, source, name));
  };
  CHECK_THROWS_AS(build(kField, "own_feild"), InputError);
  CHECK_THROWS_WITH(build(kField, "own_feild"), ContainsSubstring("'own_feild'"));
  CHECK_THROWS_AS(build("#include \"other.clh\"\n", "k"), KernelBuildError);
  CHECK_THROWS_WITH(build("#include \"other.clh\"\n", "k"), ContainsSubstring("other.clh"));
  const std::string wrong = "#include \"map.clh\"\n\nkernel void k(global real* x) { x = y; }\n";
  CHECK_THROWS_AS(build(wrong, "k"), KernelBuildError);
  CHECK_THROWS_WITH(build(wrong, "k"), ContainsSubstring("source:3"));
}

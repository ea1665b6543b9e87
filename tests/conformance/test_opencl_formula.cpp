// The formula for Mandelbulber 2, with stand-ins of the two structs that it takes: what it computes
// is the field, and a distance of 0 is where the set is.

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch_all.hpp>
#include <cmath>
#include <vector>

#include "formula/formula.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/opencl.hpp"
#include "random_maps.hpp"
#include "test_device.hpp"

using namespace qjulia;

namespace {

// What the formula uses of the program's structs, and a loop like the program's.
const char* const kStandIns = R"(
#define REAL float
#define REAL4 float4
typedef struct { float offset0, scale1, offset0005; float3 rotation; } TransformCommon;
typedef struct { TransformCommon transformCommon; } sFractalCl;
typedef struct { float4 c; float pos_neg, r, DE, dist; int i; } sExtendedAuxCl;
)";
const char* const kLoop = R"(
__constant sFractalCl fractal = {{SLICE, STEEPNESS, 0.002f, (float3)(0.0f, 0.0f, 0.0f)}};
kernel void iterate(global const float* points, int n, global float* out) {
  int g = (int)get_global_id(0);
  float4 z = (float4)(points[3 * g], points[3 * g + 1], points[3 * g + 2], 0.0f);
  sExtendedAuxCl aux;
  aux.pos_neg = 1.0f;
  aux.DE = 1.0f;
  aux.dist = 1000.0f;
  for (aux.i = 0; aux.i < n; ++aux.i) {
    z = CustomIteration(z, &fractal, &aux);
    aux.r = length(z);
    if (aux.r > BAILOUT) break;
  }
  out[2 * g] = log(aux.r);
  out[2 * g + 1] = aux.r / aux.DE;
}
)";

void expect_success(cl_int code) { REQUIRE(code == CL_SUCCESS); }

/// F_n and the distance at each point of the picture's frame.
std::vector<float> iterated(const Device& device, const Map& map, const std::string& source,
                            std::vector<float> points, int n) {
  const cl_kernel kernel = build_kernel(device, map, Precision::single, source, "iterate");
  const std::size_t count = points.size() / 3;
  std::vector<float> out(2 * count);
  cl_int code = CL_SUCCESS;
  const cl_mem in = clCreateBuffer(opencl_context(device), CL_MEM_COPY_HOST_PTR,
                                   points.size() * sizeof(float), points.data(), &code);
  expect_success(code);
  const cl_mem result = clCreateBuffer(opencl_context(device), CL_MEM_READ_WRITE,
                                       out.size() * sizeof(float), nullptr, &code);
  expect_success(code);
  expect_success(clSetKernelArg(kernel, 0, sizeof in, &in));
  expect_success(clSetKernelArg(kernel, 1, sizeof n, &n));
  expect_success(clSetKernelArg(kernel, 2, sizeof result, &result));
  const cl_command_queue queue = opencl_queue(device);
  expect_success(
      clEnqueueNDRangeKernel(queue, kernel, 1, nullptr, &count, nullptr, 0, nullptr, nullptr));
  expect_success(clEnqueueReadBuffer(queue, result, CL_TRUE, 0, out.size() * sizeof(float),
                                     out.data(), 0, nullptr, nullptr));
  clReleaseMemObject(in);
  clReleaseMemObject(result);
  clReleaseKernel(kernel);
  return out;
}

}  // namespace

TEST_CASE("the OpenCL formula gives the field and the set at 1,000 points") {
  const Device& device = test::shared_device();
  Map map = test::random_map(40, 0.001, 0.4, 5);
  map.layers.steepness = GENERATE(1.0, 3.0);
  map.dynamics.slice = 0.05;
  map.frame.box = Box{{-1, -1.2, -0.8}, {1, 1.2, 0.8}};
  map.frame.up = GENERATE(UpAxis::y, UpAxis::z);
  const formula::Reach reach = formula::reach_of(device, map);
  const double bailout = std::max(1.0, std::min(reach.stops.outer, reach.stops.escape));
  const std::string source = fmt::format(
      "{}{}#define SLICE {:.7f}f\n#define STEEPNESS {:.7f}f\n#define BAILOUT {:.7f}f\n{}",
      kStandIns, opencl_formula(map, reach, "a map"), map.dynamics.slice, map.layers.steepness,
      bailout, kLoop);
  // The picture's x, y and z are the shape's, turned so that up is z: X right, Y up, Z front.
  constexpr std::size_t kCount = 1000;
  std::vector<float> seen;
  std::vector<Quaternion> points;
  std::mt19937_64 bits(3);
  while (points.size() < kCount) {
    const Eigen::Vector3d x(test::uniform(bits, -1.2, 1.2), test::uniform(bits, -1.2, 1.2),
                            test::uniform(bits, -1.2, 1.2));
    if (x.norm() > 0.9 * bailout) continue;  // its orbit has ended
    points.push_back({x.x(), x.y(), x.z(), map.dynamics.slice});
    const Eigen::Vector3d right = map.frame.up == UpAxis::y
                                      ? Eigen::Vector3d(x.x(), -x.z(), x.y())   // front is z
                                      : Eigen::Vector3d(x.y(), -x.x(), x.z());  // front is x
    for (const double c : right) seen.push_back(static_cast<float>(c / 1.2));
  }
  const Field field(device, map, Precision::single, {0, bailout, bailout});
  for (const int n : {1, 2, 6}) {
    const auto found = iterated(device, map, source, seen, n);
    const auto wanted = field.at(points, n);
    std::size_t close = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      close += std::abs(found[2 * i] - std::min(wanted[i], 40.0)) <
               (n == 1 ? 1e-4 : 1e-2) * (1 + std::abs(wanted[i]));
    }
    CAPTURE(n, close, map.layers.steepness, map.frame.up);
    CHECK(close >= 990);
    std::size_t inside = 0, agree = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      inside += wanted[i] < map.dynamics.surface_level;
      agree += (found[2 * i + 1] < 1e-6) == (wanted[i] < map.dynamics.surface_level);
    }
    if (n == 1) CHECK(inside > 20);
    CHECK(agree >= 990);
  }
}

// A kernel of your own on a map: a picture of how near orbits come to the plane X = 0.
// own_kernel MAP [WIDTH]
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <qjulia/map/map_file.hpp>
#include <qjulia/map/opencl.hpp>
#include <qjulia/picture/picture.hpp>
#include <qjulia/profile/own_launch.hpp>

const char* const kSource = R"(
#include "map.clh"
// nearest: width x width pixels of the square [-2, 2]^2 of the plane Z = 0; a work-item has QJ_WIDTH.
kernel void traps(int width, int iterations, global const real* map, int factors,
                  global real* nearest) {
  int g = (int)get_global_id(0);
  ilane pixel = (ilane)(g * QJ_WIDTH) + LANE_NUMBERS;
  lane x = 4 * (to_lane(pixel % width) + (real)0.5) / width - 2;
  lane y = 2 - 4 * (to_lane(pixel / width) + (real)0.5) / width;
  qlane q = q_make(x, y, lane_of(0), lane_of(map[QJ_MAP_SLICE]));
  ilane live = isless(map_log_radius(q), lane_of(map[QJ_MAP_LOG_ESCAPE]));
  lane least = lane_of(1);
  for (int i = 0; i < iterations && lane_any(live); ++i) {
    lane f = map_modulus(q, map, factors);
    live &= isless(f, lane_of(map[QJ_MAP_LOG_ESCAPE]));
    q = q_where(live, map_image(q, f, map, factors), q);
    least = lane_where(live, fmin(least, fabs(q.x)), least);
  }
  lane_store(least, nearest, g);
}
)";

void expect(cl_int code) {
  if (code != CL_SUCCESS) throw std::runtime_error("OpenCL error " + std::to_string(code));
}

int main(int argc, char** argv) try {
  if (argc < 2) throw qjulia::InputError("usage: own_kernel MAP [WIDTH]");
  const cl_int width = (argc > 2 ? std::atoi(argv[2]) : 480) / 16 * 16;  // whole lanes
  const cl_int iterations = 8;
  const auto map = qjulia::read_map(argv[1]);
  // A program with a context and a queue of its own calls qjulia::device_from_opencl here.
  const auto device = qjulia::Device::choose();
  const auto buffer = qjulia::map_buffer(device, map);
  const cl_kernel kernel = qjulia::build_kernel(device, map, buffer.precision, kSource, "traps");

  std::vector<float> nearest(std::size_t(width) * std::size_t(width));
  const std::size_t bytes = nearest.size() * sizeof(float);
  const std::size_t items = nearest.size() / std::size_t(buffer.lane_width);
  cl_int code = CL_SUCCESS;
  const cl_mem out =
      clCreateBuffer(qjulia::opencl_context(device), CL_MEM_WRITE_ONLY, bytes, nullptr, &code);
  expect(code);
  expect(clSetKernelArg(kernel, 0, sizeof width, &width));
  expect(clSetKernelArg(kernel, 1, sizeof iterations, &iterations));
  expect(clSetKernelArg(kernel, 2, sizeof buffer.map, &buffer.map));
  expect(clSetKernelArg(kernel, 3, sizeof buffer.factors, &buffer.factors));
  expect(clSetKernelArg(kernel, 4, sizeof out, &out));
  const cl_command_queue queue = qjulia::opencl_queue(device);
  expect(clEnqueueNDRangeKernel(queue, kernel, 1, nullptr, &items, nullptr, 0, nullptr, nullptr));
  expect(clEnqueueReadBuffer(queue, out, CL_TRUE, 0, bytes, nearest.data(), 0, nullptr, nullptr));
  // How fast it is: a launch, and the multiply-adds, multiplications and divisions that it has.
  constexpr double kSlots = 62;  // of F and the image, for each factor and iterate
  qjulia::OwnLaunch launch;
  launch.kernel = "traps";
  launch.slots = kSlots * buffer.factors * iterations * double(nearest.size());
  launch.at_most = true;  // orbits end where they escape
  launch.run = [&] {
    expect(clEnqueueNDRangeKernel(queue, kernel, 1, nullptr, &items, nullptr, 0, nullptr, nullptr));
    expect(clFinish(queue));
  };
  const auto figures = qjulia::profile_launch(device, launch);
  std::cout << 1e3 * figures.median_seconds << " ms; " << figures.limited_by << '\n';
  expect(clReleaseMemObject(out));
  expect(clReleaseKernel(kernel));

  qjulia::Image image;
  image.width = image.height = width;
  for (const float distance : nearest) {
    const auto gray = static_cast<std::uint8_t>(255 * std::sqrt(std::min(1.0F, distance)));
    image.pixels.insert(image.pixels.end(), 3, gray);
  }
  qjulia::write_png(image, "traps.png");
  std::cout << "traps.png, " << width << " pixels wide\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}

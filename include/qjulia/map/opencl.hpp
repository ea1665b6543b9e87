#pragma once
/// The library in programs that use OpenCL themselves: devices made of their own contexts, and
/// their own kernels on maps. This is the only public header in which OpenCL types appear, and the
/// only one that needs OpenCL's headers; `qjulia.hpp` does not include it.

#ifndef CL_TARGET_OPENCL_VERSION
#define CL_TARGET_OPENCL_VERSION 120
#endif
#include <CL/cl.h>

#include <cstddef>
#include <memory>
#include <string>

#include "qjulia/device/device.hpp"
#include "qjulia/map/field.hpp"
#include "qjulia/map/map.hpp"

namespace qjulia {

/// A device that works in the program's context and puts all that it does in the program's queue.
/// It retains the three, and releases them with its last copy, after it has waited for the queue.
///
/// Handles must be valid or null: OpenCL offers no way to check others. The queue must run commands
/// in order. With CL_QUEUE_PROFILING_ENABLE, kernels are timed on the device; without it, each is
/// waited for and timed by the clock, which is slower where there are many short ones. Settings are
/// the defaults of the device's layout. Parts of devices (clCreateSubDevices) need a driver that
/// lists them in their context, which PoCL does not; their `DeviceInfo` has −1 as platform, index.
/// @throws InputError naming what does not fit: a handle that is null, a device that is not in the
///   context, a queue of another context or device or one that runs commands out of order.
Device device_from_opencl(cl_context context, cl_device_id device, cl_command_queue queue);

/// What a device works with, made by `device_from_opencl` or not. Each is valid as long as a copy
/// of the device is: retain it to keep it longer. What is put in the queue runs after all that the
/// library has put there; like the device itself, the queue is for one thread at a time.
cl_context opencl_context(const Device& device);
cl_device_id opencl_device(const Device& device);
cl_command_queue opencl_queue(const Device& device);

/// A map in a buffer of a device, as the functions of `map.clh` take it. Copies share the buffer;
/// the last one releases it.
struct MapBuffer {
  cl_mem map = nullptr;  ///< the argument `global const real* map`
  cl_int factors = 0;    ///< the argument `int factors`, which stands next to it
  /// Points that one work-item computes: the lanes of `lane` and `qlane`.
  int lane_width = 1;
  Precision precision = Precision::single;  ///< whether `real` is float or double
  std::shared_ptr<const void> owner{};      ///< keeps `map`
};

/// Uploads a map for kernels of `build_kernel`. Takes some bytes for each factor, or a real for
/// each sample of an exact map's grid.
/// @param stops where `map_iterate` ends orbits.
/// @throws InputError naming what is wrong with the map; DeviceError when the device has too little
///   memory.
MapBuffer map_buffer(const Device& device, const Map& map, Precision precision = Precision::single,
                     const StopRadii& stops = {});

/// The field of one map at points that are in buffers of the device's context, with results that
/// stay there. While `Field` takes points from the host, this class copies nothing and does not
/// check the points: coordinates that are not finite give values that are not finite.
///
/// Arrays have `stride(count)` reals for `count` points; those past the points may have any value.
/// Points are four such arrays, X, Y, Z and W in map coordinates. Each function below puts one
/// launch in the queue, of work in proportion to points × factors × n; on a device that also draws
/// a display, keep it to some tenths of a second. They throw OptionError naming the buffer that is
/// null, no buffer, of another context or too small, and DeviceError where the device refuses.
class BufferField {
 public:
  /// @throws InputError naming what is wrong with the map; DeviceError
  BufferField(const Device& device, const Map& map, Precision precision = Precision::single,
              const StopRadii& stops = {});

  /// The least multiple of the lane width that is not below `count`.
  std::size_t stride(std::size_t count) const;

  /// F_n with the escape radius alone, bit for bit as Field::at gives it, into one array.
  /// @throws OptionError naming `iterations` unless n is 1 … kMostIterations, or `count` where
  ///   there are more than 2³¹ − 1 points.
  void at(cl_mem points, std::size_t count, int iterations, cl_mem field) const;
  /// ∂F_1/∂q into four arrays, of points within the escape radius. @throws OptionError likewise
  void gradient_at(cl_mem points, std::size_t count, cl_mem gradient) const;

 private:
  struct Impl;
  std::shared_ptr<const Impl> impl_;
};

/// The kernel `name` of a program of your own in OpenCL C 1.2, which the caller releases. The
/// source may `#include "map.clh"`, which has `map_modulus` (F), `map_modulus_gradient`,
/// `map_image` (R) and `map_iterate` (F_n) of points `qlane`, in `real`s. That file is part of the
/// library, and the directive stands alone on its line. The program is built for the map's kinds of
/// modulus and versor, its paint and its portals, for this device's lane width and the given
/// precision:
///
///     #include "map.clh"
///     // points: four arrays X, Y, Z, W of `stride` reals, a multiple of QJ_WIDTH, the lane width.
///     // One work-item for QJ_WIDTH points.
///     kernel void f(global const real* points, int stride, global const real* map, int factors,
///                   global real* field) {
///       int g = (int)get_global_id(0);
///       lane_store(map_modulus(q_load(points, stride, g), map, factors), field, g);
///     }
///
/// It can be used with every map of the same kinds. Each call compiles the source anew, which takes
/// from a tenth of a second to some seconds.
/// @throws KernelBuildError with the compiler's log, or naming a file that cannot be included;
///   InputError when the map is not valid, the source has no such kernel, or the device has no
///   double precision.
cl_kernel build_kernel(const Device& device, const Map& map, Precision precision,
                       const std::string& source, const std::string& name);

}  // namespace qjulia

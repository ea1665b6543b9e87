#pragma once
/// The OpenCL objects behind devices and buffers, for `qjulia/map/opencl.hpp`.

#include <string>

#include "device/context.hpp"
#include "qjulia/map/opencl.hpp"

namespace qjulia::device {

/// Those that a context works with. They belong to the context.
struct Handles {
  cl_context context;
  cl_device_id device;
  cl_command_queue queue;

  static Handles of(const Context& context);
  /// It belongs to the memory.
  static cl_mem of(const Memory& memory);
  /// A program's own buffer, which is retained, of at least so many bytes.
  /// @throws OptionError naming `name`.
  static Memory borrowed(const Context& context, const char* name, cl_mem buffer,
                         std::size_t bytes);
  /// A kernel of a source that may include embedded files; the caller releases it.
  /// @throws KernelBuildError; InputError when the source has no such kernel.
  static cl_kernel build(const Context& context, const std::string& source, const std::string& name,
                         const BuildOptions& options);
};

}  // namespace qjulia::device

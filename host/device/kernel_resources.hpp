#pragma once
/// Asks drivers what a compiled kernel needs: OpenCL's questions, and those of vendors.

#include <cstdint>
#include <optional>
#include <string>

#include "qjulia/device/kernel_resources.hpp"

namespace cl {
class Device;
class Kernel;
}  // namespace cl

namespace qjulia::device {

/// 0 or nothing where the driver does not answer.
KernelResources resources_of(const cl::Kernel& kernel, const cl::Device& device);

/// What NVIDIA's assembler says of a kernel.
struct AssemblerFigures {
  std::optional<std::uint64_t> registers, spilled_bytes;  ///< spilled: stores
};
/// @param log of a build with -cl-nv-verbose, of a program that may have more kernels.
AssemblerFigures assembler_figures(const std::string& log, const std::string& kernel);

}  // namespace qjulia::device

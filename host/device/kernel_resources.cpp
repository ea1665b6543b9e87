#include "device/kernel_resources.hpp"

#include <regex>

#include "device/opencl.hpp"

namespace qjulia::device {
namespace {

// Questions of vendors, by the numbers of CL/cl_ext.h.
constexpr cl_device_info kNvidiaRegisters = 0x4002;          // CL_DEVICE_REGISTERS_PER_BLOCK_NV
constexpr cl_device_info kAmdWavefront = 0x4043;             // CL_DEVICE_WAVEFRONT_WIDTH_AMD
constexpr cl_kernel_work_group_info kIntelSpilled = 0x4109;  // CL_KERNEL_SPILL_MEM_SIZE_INTEL

/// 0 where the driver does not know the question.
template <class Answer>
std::uint64_t kernel_answer(const cl::Kernel& kernel, const cl::Device& device,
                            cl_kernel_work_group_info question) {
  Answer given{};
  const cl_int code =
      ::clGetKernelWorkGroupInfo(kernel(), device(), question, sizeof given, &given, nullptr);
  return code == CL_SUCCESS ? given : 0;
}

std::uint64_t device_answer(const cl::Device& device, cl_device_info question) {
  cl_uint given = 0;
  const cl_int code = ::clGetDeviceInfo(device(), question, sizeof given, &given, nullptr);
  return code == CL_SUCCESS ? given : 0;
}

/// The log of one more build of the kernel's program, in which NVIDIA's assembler says what it did.
std::string verbose_log(const cl::Kernel& kernel, const cl::Device& device) {
  const auto program = kernel.getInfo<CL_KERNEL_PROGRAM>();
  const auto context = kernel.getInfo<CL_KERNEL_CONTEXT>();
  std::string line = program.getBuildInfo<CL_PROGRAM_BUILD_OPTIONS>(device);
  line += " -cl-nv-verbose";
  const auto source = program.getInfo<CL_PROGRAM_SOURCE>();
  cl_int code = CL_SUCCESS;
  cl::Program again;
  if (source.empty()) {
    const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
    if (binaries.size() != 1) return {};
    again = cl::Program(context, {device}, binaries, nullptr, &code);
  } else {
    again = cl::Program(context, source, false, &code);
  }
  if (code != CL_SUCCESS || again.build(device, line.c_str()) != CL_SUCCESS) return {};
  return again.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device);
}

std::optional<std::uint64_t> first_number(const std::string& text, const char* pattern) {
  std::smatch found;
  if (!std::regex_search(text, found, std::regex(pattern))) return std::nullopt;
  return std::stoull(found[1]);
}

}  // namespace

AssemblerFigures assembler_figures(const std::string& log, const std::string& kernel) {
  // ptxas info    : Compiling entry function 'NAME' for 'sm_90'
  // …    0 bytes stack frame, 0 bytes spill stores, 0 bytes spill loads
  // ptxas info    : Used 40 registers, …
  std::size_t begin = log.find("entry function '" + kernel + "'");
  if (begin == std::string::npos) return {};
  const std::size_t end = log.find("entry function '", begin + 1);
  const std::string part = log.substr(begin, end == std::string::npos ? end : end - begin);
  return {first_number(part, R"(Used (\d{1,9}) registers)"),
          first_number(part, R"((\d{1,9}) bytes spill stores)")};
}

KernelResources resources_of(const cl::Kernel& kernel, const cl::Device& device) {
  KernelResources found;
  found.group_size = kernel_answer<std::size_t>(kernel, device, CL_KERNEL_WORK_GROUP_SIZE);
  found.group_multiple =
      kernel_answer<std::size_t>(kernel, device, CL_KERNEL_PREFERRED_WORK_GROUP_SIZE_MULTIPLE);
  found.local_bytes = kernel_answer<cl_ulong>(kernel, device, CL_KERNEL_LOCAL_MEM_SIZE);
  found.private_bytes = kernel_answer<cl_ulong>(kernel, device, CL_KERNEL_PRIVATE_MEM_SIZE);
  const auto extensions = device.getInfo<CL_DEVICE_EXTENSIONS>();
  const auto has = [&](const char* name) { return extensions.find(name) != std::string::npos; };
  if (has("cl_nv_device_attribute_query")) {
    const auto figures =
        assembler_figures(verbose_log(kernel, device), kernel.getInfo<CL_KERNEL_FUNCTION_NAME>());
    found.registers = figures.registers;
    found.spilled_bytes = figures.spilled_bytes;
    if (found.registers.value_or(0) > 0) {
      found.resident_items = device_answer(device, kNvidiaRegisters) / *found.registers;
    }
  }
  if (has("cl_amd_device_attribute_query")) {
    if (const auto wavefront = device_answer(device, kAmdWavefront)) {
      found.group_multiple = wavefront;
    }
  }
  if (has("cl_intel_required_subgroup_size")) {
    found.spilled_bytes = kernel_answer<cl_ulong>(kernel, device, kIntelSpilled);
  }
  return found;
}

}  // namespace qjulia::device

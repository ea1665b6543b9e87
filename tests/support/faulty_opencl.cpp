/// A device with faults: loaded before the OpenCL loader (LD_PRELOAD), it refuses the launches
/// numbered FIRST … FIRST + COUNT − 1 of a process, as QJULIA_TEST_FAULTS=FIRST:COUNT says; with
/// QJULIA_TEST_NO_TIMES=1 its events carry times of zero; with QJULIA_TEST_WRONG_WIDTH=W programs
/// compiled for W lanes run an iterate too few; with QJULIA_TEST_REFUSED_BYTES=N,M,… it has no
/// memory for buffers of exactly so many bytes, and says so.

#include <dlfcn.h>

#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

namespace {

bool refused() {
  static std::atomic<unsigned long> launches = 0;
  const unsigned long number = launches++;
  const char* faults = std::getenv("QJULIA_TEST_FAULTS");
  unsigned long first = 0;
  unsigned long count = 0;
  // NOLINTNEXTLINE(cert-err34-c): the tests write it
  if (faults == nullptr || std::sscanf(faults, "%lu:%lu", &first, &count) != 2) return false;
  return number >= first && number - first < count;
}

/// Whether `bytes` is among the numbers of QJULIA_TEST_REFUSED_BYTES.
bool too_large(size_t bytes) {
  const char* refused = std::getenv("QJULIA_TEST_REFUSED_BYTES");
  if (refused == nullptr) return false;
  return (',' + std::string(refused) + ',').find(',' + std::to_string(bytes) + ',') !=
         std::string::npos;
}

}  // namespace

extern "C" CL_API_ENTRY cl_mem CL_API_CALL clCreateBuffer(cl_context context, cl_mem_flags flags,
                                                          size_t size, void* host, cl_int* code) {
  static const auto real =
      reinterpret_cast<decltype(&clCreateBuffer)>(::dlsym(RTLD_NEXT, "clCreateBuffer"));
  if (!too_large(size)) return real(context, flags, size, host, code);
  std::fprintf(stderr, "refused %zu bytes\n", size);
  if (code != nullptr) *code = CL_MEM_OBJECT_ALLOCATION_FAILURE;
  return nullptr;
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL
clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                       const size_t* offset, const size_t* global, const size_t* local,
                       cl_uint waits, const cl_event* wait_list, cl_event* event) {
  static const auto real = reinterpret_cast<decltype(&clEnqueueNDRangeKernel)>(
      ::dlsym(RTLD_NEXT, "clEnqueueNDRangeKernel"));
  if (refused()) return CL_OUT_OF_RESOURCES;
  return real(queue, kernel, dimensions, offset, global, local, waits, wait_list, event);
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL clGetEventProfilingInfo(cl_event event,
                                                                   cl_profiling_info name,
                                                                   size_t size, void* value,
                                                                   size_t* needed) {
  static const auto real = reinterpret_cast<decltype(&clGetEventProfilingInfo)>(
      ::dlsym(RTLD_NEXT, "clGetEventProfilingInfo"));
  const cl_int code = real(event, name, size, value, needed);
  if (std::getenv("QJULIA_TEST_NO_TIMES") != nullptr && value != nullptr) {
    *static_cast<cl_ulong*>(value) = 0;
  }
  return code;
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL
clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
               void(CL_CALLBACK* notify)(cl_program, void*), void* user_data) {
  static const auto real =
      reinterpret_cast<decltype(&clBuildProgram)>(::dlsym(RTLD_NEXT, "clBuildProgram"));
  std::string changed = options == nullptr ? "" : options;
  const char* width = std::getenv("QJULIA_TEST_WRONG_WIDTH");
  const auto has = [&](const std::string& option) {
    return changed.find(option) != std::string::npos;
  };
  if (width != nullptr && has(std::string("-DQJ_WIDTH=") + width + ' ') &&
      has("-DQJ_ITERATIONS=4")) {
    changed += " -DQJ_ITERATIONS=3";
  }
  return real(program, count, devices, changed.c_str(), notify, user_data);
}

/// A device with faults: loaded before the OpenCL loader (LD_PRELOAD). The environment says which:
/// QJULIA_TEST_FAULTS=FIRST:COUNT:CODE  launches FIRST … FIRST + COUNT − 1 of a process are refused
///                                   with CODE; without it, with CL_OUT_OF_RESOURCES
/// QJULIA_TEST_LAUNCHES=FILE         gets a line with the kernel's name for each launch
/// QJULIA_TEST_NO_TIMES=1            events carry times of zero
/// QJULIA_TEST_NO_DOUBLE=1           there is no double precision
/// QJULIA_TEST_WRONG_WIDTH=W         programs compiled for W lanes run an iterate too few
/// QJULIA_TEST_WRONG_COMPILER=NAME   programs are compiled as by that of wrong_compilers.hpp
/// QJULIA_TEST_BROKEN_PROGRAM=NAME   programs whose source is kernels/NAME do not build
/// QJULIA_TEST_CRASHING_PROGRAM=NAME the process ends with SIGSEGV when such a program is built
/// QJULIA_TEST_HANGING_PROGRAM=NAME  the build of such a program takes five minutes
/// QJULIA_TEST_NO_BINARY=WHEN        compiled programs are refused when they are created (`create`)
///                                   or built (`build`), or have no kernels (`kernel`)
/// QJULIA_TEST_GPU=1                 devices say that they are GPUs
/// QJULIA_TEST_DEVICE_VERSION=TEXT   devices say that they are of that version of OpenCL
/// QJULIA_TEST_DRIVER_VERSION=TEXT   devices say that their driver is of that version
/// QJULIA_TEST_SOURCES=FILE          gets the first line of each program's source
/// QJULIA_TEST_REFUSED_BYTES=N,M,…   no memory for buffers of exactly so many bytes; it says so
/// QJULIA_TEST_LARGEST_BUFFER=N      no buffer has more than N bytes, as the device tells
/// QJULIA_TEST_LOCAL_BYTES=N         a group has N bytes of local memory, as the device tells
/// QJULIA_TEST_GROUP=WHO:N           groups have at most N work-items: `device` tells so for all
///                                   kernels, `kernel` for each, `nobody` until a launch is refused
/// QJULIA_TEST_LOST=FIRST:CODE:NAME|…  from its launch FIRST on, all that queues are asked for
/// fails
///                                   with CODE, on devices whose names have one of these in theirs
/// QJULIA_TEST_BUSY_WAITS=1          devices say that they are GPUs, and a core is kept busy by
///                                   whoever waits for one

#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>

#include "wrong_compilers.hpp"

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

namespace {

/// The loader's function of this name.
template <class Function>
Function* loaders(Function* /*same type*/, const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}

std::optional<size_t> number(const char* variable) {
  const char* text = std::getenv(variable);
  if (text == nullptr) return std::nullopt;
  return std::strtoull(text, nullptr, 10);
}

/// The largest group, where `who` (or anybody: empty) tells it.
std::optional<size_t> largest_group(std::string_view who) {
  const char* text = std::getenv("QJULIA_TEST_GROUP");
  if (text == nullptr) return std::nullopt;
  const std::string_view all(text);
  const size_t colon = all.find(':');
  if (!who.empty() && all.substr(0, colon) != who) return std::nullopt;
  return std::strtoull(text + colon + 1, nullptr, 10);
}

/// How this process's next launch is refused; CL_SUCCESS: it is not.
cl_int refused() {
  static std::atomic<unsigned long> launches = 0;
  const unsigned long launch = launches++;
  const char* faults = std::getenv("QJULIA_TEST_FAULTS");
  unsigned long first = 0;
  unsigned long count = 0;
  int code = CL_OUT_OF_RESOURCES;
  // NOLINTNEXTLINE(cert-err34-c): the tests write it
  if (faults == nullptr || std::sscanf(faults, "%lu:%lu:%d", &first, &count, &code) < 2) {
    return CL_SUCCESS;
  }
  return launch >= first && launch - first < count ? code : CL_SUCCESS;
}

/// Adds a line to the file that the variable names.
void note(const char* variable, const std::string& line) {
  const char* path = std::getenv(variable);
  if (path == nullptr) return;
  if (FILE* file = std::fopen(path, "a")) {
    std::fprintf(file, "%s\n", line.c_str());
    std::fclose(file);
  }
}

std::string name_of(cl_kernel kernel) {
  std::array<char, 256> name{};
  clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, name.size() - 1, name.data(), nullptr);
  return name.data();
}

/// Whether `bytes` is among the numbers of QJULIA_TEST_REFUSED_BYTES.
bool is_refused_size(size_t bytes) {
  const char* refused = std::getenv("QJULIA_TEST_REFUSED_BYTES");
  if (refused == nullptr) return false;
  return (',' + std::string(refused) + ',').find(',' + std::to_string(bytes) + ',') !=
         std::string::npos;
}

size_t group_items(cl_uint dimensions, const size_t* local) {
  size_t items = 1;
  for (cl_uint i = 0; local != nullptr && i < dimensions; ++i) items *= local[i];
  return items;
}

/// Bytes of local memory a launch of the kernel takes.
size_t local_bytes(cl_command_queue queue, cl_kernel kernel) {
  static const auto info = loaders(&clGetKernelWorkGroupInfo, "clGetKernelWorkGroupInfo");
  cl_device_id device = nullptr;
  cl_ulong bytes = 0;
  clGetCommandQueueInfo(queue, CL_QUEUE_DEVICE, sizeof device, &device, nullptr);
  info(kernel, device, CL_KERNEL_LOCAL_MEM_SIZE, sizeof bytes, &bytes, nullptr);
  return bytes;
}

std::string device_name(cl_command_queue queue) {
  cl_device_id device = nullptr;
  clGetCommandQueueInfo(queue, CL_QUEUE_DEVICE, sizeof device, &device, nullptr);
  std::array<char, 256> name{};
  clGetDeviceInfo(device, CL_DEVICE_NAME, name.size() - 1, name.data(), nullptr);
  return name.data();
}

/// What a queue is answered once its device is lost; CL_SUCCESS before. @param launches 1 for a
/// launch, which counts
cl_int lost(cl_command_queue queue, unsigned long launches = 0) {
  static std::atomic<unsigned long> count = 0;
  const char* text = std::getenv("QJULIA_TEST_LOST");
  if (text == nullptr) return CL_SUCCESS;
  char* end = nullptr;
  const unsigned long first = std::strtoul(text, &end, 10);
  const long code = std::strtol(end + 1, &end, 10);
  std::istringstream names(end + 1);
  const std::string device = device_name(queue);
  bool is_named = false;
  for (std::string name; !is_named && std::getline(names, name, '|');)
    is_named = device.find(name) != std::string::npos;
  if (!is_named) return CL_SUCCESS;
  return (count += launches) > first ? static_cast<cl_int>(code) : CL_SUCCESS;
}

/// Where waits are busy ones: keeps asking whether the queue has done all that it was given.
void wait_busily(cl_command_queue queue) {
  if (!number("QJULIA_TEST_BUSY_WAITS")) return;
  cl_event event = nullptr;
  if (clEnqueueMarkerWithWaitList(queue, 0, nullptr, &event) != CL_SUCCESS) return;
  clFlush(queue);
  cl_int state = CL_QUEUED;
  while (state > CL_COMPLETE && clGetEventInfo(event, CL_EVENT_COMMAND_EXECUTION_STATUS,
                                               sizeof state, &state, nullptr) == CL_SUCCESS) {
  }
  clReleaseEvent(event);
}

std::string source_of(cl_program program) {
  size_t size = 0;
  clGetProgramInfo(program, CL_PROGRAM_SOURCE, 0, nullptr, &size);
  std::string source(size, '\0');
  clGetProgramInfo(program, CL_PROGRAM_SOURCE, size, source.data(), nullptr);
  return source;
}

/// Whether the variable names the file whose source the program has. A driver's own needs may come
/// before the source.
bool is_named_by(const char* variable, cl_program program) {
  const char* name = std::getenv(variable);
  return name != nullptr && source_of(program).find(std::string("#line 1 \"kernels/") + name +
                                                    '"') != std::string::npos;
}

bool refuses_binaries(std::string_view when) {
  const char* refused = std::getenv("QJULIA_TEST_NO_BINARY");
  return refused != nullptr && refused == when;
}

/// The compiler that QJULIA_TEST_WRONG_COMPILER names; null without it.
const qjulia::test::WrongCompiler* wrong_compiler() {
  const char* name = std::getenv("QJULIA_TEST_WRONG_COMPILER");
  if (name == nullptr) return nullptr;
  const auto& all = qjulia::test::kWrongCompilers;
  const auto* const found =
      std::ranges::find(all, std::string_view(name), &qjulia::test::WrongCompiler::name);
  if (found == all.end()) {
    std::fprintf(stderr, "no wrong compiler is called %s\n", name);
    std::abort();
  }
  return found;
}

/// Answers a question with text.
cl_int answer(std::string_view text, size_t size, void* value, size_t* needed) {
  if (needed != nullptr) *needed = text.size() + 1;
  if (value == nullptr) return CL_SUCCESS;
  if (size <= text.size()) return CL_INVALID_VALUE;
  char* const end = std::ranges::copy(text, static_cast<char*>(value)).out;
  *end = '\0';
  return CL_SUCCESS;
}

/// Replaces what was told, where anybody asked and something is to be told.
template <class Number>
void tell(const std::optional<size_t>& most, void* value) {
  if (!most || value == nullptr) return;
  auto& told = *static_cast<Number*>(value);
  told = std::min(told, static_cast<Number>(*most));
}

}  // namespace

extern "C" CL_API_ENTRY cl_int CL_API_CALL clGetDeviceInfo(cl_device_id device, cl_device_info name,
                                                           size_t size, void* value,
                                                           size_t* needed) {
  static const auto real = loaders(&clGetDeviceInfo, "clGetDeviceInfo");
  const char* version = std::getenv("QJULIA_TEST_DEVICE_VERSION");
  if (name == CL_DEVICE_VERSION && version != nullptr) return answer(version, size, value, needed);
  const char* driver = std::getenv("QJULIA_TEST_DRIVER_VERSION");
  if (name == CL_DRIVER_VERSION && driver != nullptr) return answer(driver, size, value, needed);
  const cl_int code = real(device, name, size, value, needed);
  if (name == CL_DEVICE_MAX_MEM_ALLOC_SIZE) {
    tell<cl_ulong>(number("QJULIA_TEST_LARGEST_BUFFER"), value);
  } else if (name == CL_DEVICE_LOCAL_MEM_SIZE) {
    tell<cl_ulong>(number("QJULIA_TEST_LOCAL_BYTES"), value);
  } else if (name == CL_DEVICE_MAX_WORK_GROUP_SIZE) {
    tell<size_t>(largest_group("device"), value);
  } else if (name == CL_DEVICE_DOUBLE_FP_CONFIG && number("QJULIA_TEST_NO_DOUBLE")) {
    tell<cl_device_fp_config>(0, value);
  } else if (name == CL_DEVICE_TYPE && value != nullptr &&
             (number("QJULIA_TEST_BUSY_WAITS") || number("QJULIA_TEST_GPU"))) {
    *static_cast<cl_device_type*>(value) = CL_DEVICE_TYPE_GPU;
  }
  return code;
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL clGetKernelWorkGroupInfo(cl_kernel kernel,
                                                                    cl_device_id device,
                                                                    cl_kernel_work_group_info name,
                                                                    size_t size, void* value,
                                                                    size_t* needed) {
  static const auto real = loaders(&clGetKernelWorkGroupInfo, "clGetKernelWorkGroupInfo");
  const cl_int code = real(kernel, device, name, size, value, needed);
  if (name == CL_KERNEL_WORK_GROUP_SIZE) tell<size_t>(largest_group("kernel"), value);
  return code;
}

extern "C" CL_API_ENTRY cl_mem CL_API_CALL clCreateBuffer(cl_context context, cl_mem_flags flags,
                                                          size_t size, void* host, cl_int* code) {
  static const auto real = loaders(&clCreateBuffer, "clCreateBuffer");
  const auto largest = number("QJULIA_TEST_LARGEST_BUFFER");
  const bool is_too_large = largest && size > *largest;
  if (!is_too_large && !is_refused_size(size)) return real(context, flags, size, host, code);
  std::fprintf(stderr, "refused %zu bytes\n", size);
  if (code != nullptr) {
    *code = is_too_large ? CL_INVALID_BUFFER_SIZE : CL_MEM_OBJECT_ALLOCATION_FAILURE;
  }
  return nullptr;
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL
clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                       const size_t* offset, const size_t* global, const size_t* local,
                       cl_uint waits, const cl_event* wait_list, cl_event* event) {
  static const auto real = loaders(&clEnqueueNDRangeKernel, "clEnqueueNDRangeKernel");
  note("QJULIA_TEST_LAUNCHES", name_of(kernel));
  if (const cl_int code = refused()) return code;
  if (const cl_int code = lost(queue, 1)) return code;
  const auto largest = largest_group({});
  if (largest && group_items(dimensions, local) > *largest) {
    std::fprintf(stderr, "refused a group of %zu\n", group_items(dimensions, local));
    return CL_INVALID_WORK_GROUP_SIZE;
  }
  const auto bytes = number("QJULIA_TEST_LOCAL_BYTES");
  if (bytes && local_bytes(queue, kernel) > *bytes) {
    std::fprintf(stderr, "refused %zu bytes of local memory\n", local_bytes(queue, kernel));
    return CL_OUT_OF_RESOURCES;
  }
  return real(queue, kernel, dimensions, offset, global, local, waits, wait_list, event);
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL clFinish(cl_command_queue queue) {
  static const auto real = loaders(&clFinish, "clFinish");
  if (const cl_int code = lost(queue)) return code;
  wait_busily(queue);
  return real(queue);
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL clEnqueueReadBuffer(
    cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size, void* to,
    cl_uint waits, const cl_event* wait_list, cl_event* event) {
  static const auto real = loaders(&clEnqueueReadBuffer, "clEnqueueReadBuffer");
  if (const cl_int code = lost(queue)) return code;
  if (blocking != CL_FALSE) wait_busily(queue);
  return real(queue, buffer, blocking, offset, size, to, waits, wait_list, event);
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL clEnqueueWriteBuffer(
    cl_command_queue queue, cl_mem buffer, cl_bool blocking, size_t offset, size_t size,
    const void* from, cl_uint waits, const cl_event* wait_list, cl_event* event) {
  static const auto real = loaders(&clEnqueueWriteBuffer, "clEnqueueWriteBuffer");
  if (const cl_int code = lost(queue)) return code;
  if (blocking != CL_FALSE) wait_busily(queue);
  return real(queue, buffer, blocking, offset, size, from, waits, wait_list, event);
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL clGetEventProfilingInfo(cl_event event,
                                                                   cl_profiling_info name,
                                                                   size_t size, void* value,
                                                                   size_t* needed) {
  static const auto real = loaders(&clGetEventProfilingInfo, "clGetEventProfilingInfo");
  const cl_int code = real(event, name, size, value, needed);
  if (std::getenv("QJULIA_TEST_NO_TIMES") != nullptr && value != nullptr) {
    *static_cast<cl_ulong*>(value) = 0;
  }
  return code;
}

extern "C" CL_API_ENTRY cl_program CL_API_CALL clCreateProgramWithBinary(
    cl_context context, cl_uint count, const cl_device_id* devices, const size_t* lengths,
    const unsigned char** binaries, cl_int* states, cl_int* code) {
  static const auto real = loaders(&clCreateProgramWithBinary, "clCreateProgramWithBinary");
  if (!refuses_binaries("create")) {
    return real(context, count, devices, lengths, binaries, states, code);
  }
  if (code != nullptr) *code = CL_INVALID_BINARY;
  return nullptr;
}

extern "C" CL_API_ENTRY cl_kernel CL_API_CALL clCreateKernel(cl_program program, const char* name,
                                                             cl_int* code) {
  static const auto real = loaders(&clCreateKernel, "clCreateKernel");
  if (!refuses_binaries("kernel") || source_of(program).size() > 1) {
    return real(program, name, code);
  }
  if (code != nullptr) *code = CL_INVALID_KERNEL_NAME;
  return nullptr;
}

/// In the source itself, which built-in headers do not see: what QJ_TEST_WRONG turns round, and
/// what a wrong compiler does.
extern "C" CL_API_ENTRY cl_program CL_API_CALL clCreateProgramWithSource(
    cl_context context, cl_uint count, const char** strings, const size_t* lengths, cl_int* code) {
  static const auto real = loaders(&clCreateProgramWithSource, "clCreateProgramWithSource");
  const auto* const wrong = wrong_compiler();
  const std::string_view first = count > 0 ? strings[0] : "";
  note("QJULIA_TEST_SOURCES", std::string(first.substr(0, first.find('\n'))));
  if (std::getenv("QJULIA_TEST_WRONG_WIDTH") == nullptr && wrong == nullptr) {
    return real(context, count, strings, lengths, code);
  }
  std::string source = "#ifdef QJ_TEST_WRONG\n#define isless(a, b) isgreater(a, b)\n#endif\n";
  if (wrong != nullptr) {
    source.append(qjulia::test::kOverloads).append(wrong->prelude);
  }
  for (cl_uint i = 0; i < count; ++i) {
    const bool is_counted = lengths != nullptr && lengths[i] != 0;
    source += is_counted ? std::string(strings[i], lengths[i]) : std::string(strings[i]);
  }
  const char* text = source.c_str();
  return real(context, 1, &text, nullptr, code);
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL
clBuildProgram(cl_program program, cl_uint count, const cl_device_id* devices, const char* options,
               void(CL_CALLBACK* notify)(cl_program, void*), void* user_data) {
  static const auto real = loaders(&clBuildProgram, "clBuildProgram");
  std::string changed = options == nullptr ? "" : options;
  const auto has = [&](const std::string& option) {
    return changed.find(option) != std::string::npos;
  };
  const char* width = std::getenv("QJULIA_TEST_WRONG_WIDTH");
  if (width != nullptr && has(std::string("-DQJ_WIDTH=") + width + ' ') && has("-DQJ_GROUP=")) {
    changed += " -DQJ_TEST_WRONG";
  }
  if (const auto* const wrong = wrong_compiler()) changed += wrong->option;
  const bool is_broken = is_named_by("QJULIA_TEST_BROKEN_PROGRAM", program);
  if (is_named_by("QJULIA_TEST_CRASHING_PROGRAM", program)) {
    std::signal(SIGSEGV, SIG_DFL);  // a sanitizer would end the process otherwise
    std::raise(SIGSEGV);
  }
  if (is_named_by("QJULIA_TEST_HANGING_PROGRAM", program)) {
    constexpr unsigned kSeconds = 300;  // and no longer, should nobody end the process
    ::sleep(kSeconds);
  }
  if (refuses_binaries("build") && source_of(program).size() <= 1) return CL_INVALID_BINARY;
  const bool needs_double = number("QJULIA_TEST_NO_DOUBLE") && has("-DQJ_DOUBLE=1");
  if (is_broken || needs_double) changed += " -Dkernel=broken";
  return real(program, count, devices, changed.c_str(), notify, user_data);
}

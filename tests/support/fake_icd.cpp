/// An OpenCL driver without hardware, which the loader finds by an .icd file that names this
/// library. The environment says what it shows: QJULIA_TEST_PLATFORMS=PLATFORM=DEVICE,…;… platforms
/// by name. A DEVICE is an error code, which
///     the platform gives when it is asked for devices, or
///     KIND|NAME|VENDOR|UNITS|MHZ|SHARES|PCI|UUID: gpu or cpu; 1 where it shares the host's memory;
///     PCI as `khr:BUS`, `nv:BUS` or `amd:BUS`, the extension that tells and the number in
///     hexadecimal digits, or nothing; UUID one byte in hexadecimal digits, sixteen times, or
///     nothing
/// Contexts and queues can be made and released; buffers and programs cannot.

#include <algorithm>
#include <array>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#define CL_TARGET_OPENCL_VERSION 120
#define CL_USE_DEPRECATED_OPENCL_1_1_APIS
#include <CL/cl.h>
#include <CL/cl_ext.h>
#include <CL/cl_icd.h>

extern "C" CL_API_ENTRY void* CL_API_CALL clGetExtensionFunctionAddress(const char* name);

namespace {

/// The loader looks for a driver's functions in what each of its objects begins with.
struct Object {
  const cl_icd_dispatch* functions;
};

struct Platform;

struct FakeDevice : Object {
  Platform* platform = nullptr;
  std::vector<std::string> fields;
  const std::string& field(std::size_t i) const { return fields.at(i); }
};

struct Platform : Object {
  std::string name;
  cl_int code = CL_SUCCESS;
  std::vector<std::unique_ptr<FakeDevice>> devices;
};

const cl_icd_dispatch& functions();

std::vector<std::string> parts(const std::string& text, char separator) {
  std::vector<std::string> found;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);) found.push_back(part);
  return found;
}

std::vector<std::unique_ptr<Platform>> made_platforms() {
  std::vector<std::unique_ptr<Platform>> all;
  const char* const text = std::getenv("QJULIA_TEST_PLATFORMS");
  for (const std::string& part : parts(text == nullptr ? "" : text, ';')) {
    const std::size_t equals = part.find('=');
    auto platform = std::make_unique<Platform>();
    platform->functions = &functions();
    platform->name = part.substr(0, equals);
    for (const std::string& device : parts(part.substr(equals + 1), ',')) {
      if (device.find('|') == std::string::npos) {
        platform->code = std::atoi(device.c_str());  // NOLINT(cert-err34-c): the tests write it
        continue;
      }
      auto made = std::make_unique<FakeDevice>();
      made->functions = &functions();
      made->platform = platform.get();
      made->fields = parts(device, '|');
      made->fields.resize(8);
      platform->devices.push_back(std::move(made));
    }
    all.push_back(std::move(platform));
  }
  return all;
}

const std::vector<std::unique_ptr<Platform>>& platforms() {
  static const auto all = made_platforms();
  return all;
}

cl_int give(const void* from, std::size_t bytes, std::size_t size, void* value, size_t* needed) {
  if (needed != nullptr) *needed = bytes;
  if (value == nullptr) return CL_SUCCESS;
  if (size < bytes) return CL_INVALID_VALUE;
  std::memcpy(value, from, bytes);
  return CL_SUCCESS;
}

cl_int give_text(const std::string& text, std::size_t size, void* value, size_t* needed) {
  return give(text.c_str(), text.size() + 1, size, value, needed);
}

template <class Value>
cl_int give_value(const Value& from, std::size_t size, void* value, size_t* needed) {
  return give(&from, sizeof from, size, value, needed);
}

CL_API_ENTRY cl_int CL_API_CALL platform_ids(cl_uint entries, cl_platform_id* ids, cl_uint* count) {
  if (count != nullptr) *count = static_cast<cl_uint>(platforms().size());
  for (cl_uint i = 0; ids != nullptr && i < entries && i < platforms().size(); ++i) {
    ids[i] = reinterpret_cast<cl_platform_id>(platforms()[i].get());
  }
  return platforms().empty() ? CL_PLATFORM_NOT_FOUND_KHR : CL_SUCCESS;
}

CL_API_ENTRY cl_int CL_API_CALL platform_info(cl_platform_id id, cl_platform_info name, size_t size,
                                              void* value, size_t* needed) {
  switch (name) {
    case CL_PLATFORM_NAME:
      return give_text(reinterpret_cast<Platform*>(id)->name, size, value, needed);
    case CL_PLATFORM_VERSION:
      return give_text("OpenCL 1.2 fake", size, value, needed);
    case CL_PLATFORM_EXTENSIONS:
      return give_text("cl_khr_icd", size, value, needed);
    case CL_PLATFORM_ICD_SUFFIX_KHR:
      return give_text("FAKE", size, value, needed);
    default:
      return give_text("", size, value, needed);
  }
}

CL_API_ENTRY cl_int CL_API_CALL device_ids(cl_platform_id id, cl_device_type /*type*/,
                                           cl_uint entries, cl_device_id* ids, cl_uint* count) {
  const auto& platform = *reinterpret_cast<Platform*>(id);
  if (platform.code != CL_SUCCESS) return platform.code;
  const auto& devices = platform.devices;
  if (count != nullptr) *count = static_cast<cl_uint>(devices.size());
  for (cl_uint i = 0; ids != nullptr && i < entries && i < devices.size(); ++i) {
    ids[i] = reinterpret_cast<cl_device_id>(devices[i].get());
  }
  return devices.empty() ? CL_DEVICE_NOT_FOUND : CL_SUCCESS;
}

/// Of the extension by which the device tells its place.
std::string extensions_of(const FakeDevice& device) {
  const std::string& pci = device.field(6);
  std::string names;
  if (pci.starts_with("khr")) names += "cl_khr_pci_bus_info ";
  if (pci.starts_with("nv")) names += "cl_nv_device_attribute_query ";
  if (pci.starts_with("amd")) names += "cl_amd_device_attribute_query ";
  if (!device.field(7).empty()) names += "cl_khr_device_uuid ";
  return names;
}

/// The place on the bus and the UUID, if it is this extension that tells.
cl_int give_identity(const FakeDevice& device, cl_device_info name, size_t size, void* value,
                     size_t* needed) {
  const std::string& pci = device.field(6);
  const std::string told = pci.substr(0, pci.find(':'));
  const auto bus = static_cast<cl_uint>(
      std::strtoul(pci.empty() ? "" : pci.c_str() + told.size() + 1, nullptr, 16));
  if (name == 0x410F && told == "khr") {
    return give_value(std::array<cl_uint, 4>{0, bus, 0, 0}, size, value, needed);
  }
  if (name == 0x4008 && told == "nv") return give_value(bus, size, value, needed);
  if ((name == 0x4009 || name == 0x400A) && told == "nv") {
    return give_value(cl_uint{0}, size, value, needed);
  }
  if (name == 0x4037 && told == "amd") {
    std::array<unsigned char, 24> place{};
    place[0] = 1;
    place[21] = static_cast<unsigned char>(bus);
    return give_value(place, size, value, needed);
  }
  if (name == 0x106A && !device.field(7).empty()) {
    std::array<unsigned char, 16> uuid{};
    uuid.fill(static_cast<unsigned char>(std::strtoul(device.field(7).c_str(), nullptr, 16)));
    return give_value(uuid, size, value, needed);
  }
  return CL_INVALID_VALUE;
}

CL_API_ENTRY cl_int CL_API_CALL device_info(cl_device_id id, cl_device_info name, size_t size,
                                            void* value, size_t* needed) {
  const auto& device = *reinterpret_cast<FakeDevice*>(id);
  const auto number = [&](std::size_t field) {
    return static_cast<cl_uint>(std::strtoul(device.field(field).c_str(), nullptr, 10));
  };
  switch (name) {
    case CL_DEVICE_TYPE: {
      const cl_device_type type =
          device.field(0) == "gpu" ? CL_DEVICE_TYPE_GPU : CL_DEVICE_TYPE_CPU;
      return give_value(type, size, value, needed);
    }
    case CL_DEVICE_NAME:
      return give_text(device.field(1), size, value, needed);
    case CL_DEVICE_VENDOR:
      return give_text(device.field(2), size, value, needed);
    case CL_DEVICE_MAX_COMPUTE_UNITS:
      return give_value(number(3), size, value, needed);
    case CL_DEVICE_MAX_CLOCK_FREQUENCY:
      return give_value(number(4), size, value, needed);
    case CL_DEVICE_HOST_UNIFIED_MEMORY:
      return give_value(static_cast<cl_bool>(number(5)), size, value, needed);
    case CL_DEVICE_AVAILABLE:
      return give_value(cl_bool{CL_TRUE}, size, value, needed);
    case CL_DEVICE_PLATFORM:
      return give_value(reinterpret_cast<cl_platform_id>(device.platform), size, value, needed);
    case CL_DEVICE_VERSION:
      return give_text("OpenCL 1.2 fake", size, value, needed);
    case CL_DRIVER_VERSION:
      return give_text("1", size, value, needed);
    case CL_DEVICE_EXTENSIONS:
      return give_text(extensions_of(device), size, value, needed);
    case CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT:
      return give_value(cl_uint{1}, size, value, needed);
    case CL_DEVICE_GLOBAL_MEM_SIZE:
    case CL_DEVICE_MAX_MEM_ALLOC_SIZE:
      return give_value(cl_ulong{1} << 32U, size, value, needed);
    case CL_DEVICE_LOCAL_MEM_SIZE:
      return give_value(cl_ulong{1} << 15U, size, value, needed);
    case CL_DEVICE_MAX_WORK_GROUP_SIZE:
      return give_value(size_t{256}, size, value, needed);
    case CL_DEVICE_DOUBLE_FP_CONFIG:
      return give_value(cl_device_fp_config{CL_FP_FMA}, size, value, needed);
    default:
      return give_identity(device, name, size, value, needed);
  }
}

template <class Handle>
CL_API_ENTRY cl_int CL_API_CALL counted(Handle /*of an object that stays*/) {
  return CL_SUCCESS;
}

template <class Handle>
Handle new_object(cl_int* code) {
  static Object object{&functions()};
  if (code != nullptr) *code = CL_SUCCESS;
  return reinterpret_cast<Handle>(&object);
}

CL_API_ENTRY cl_context CL_API_CALL new_context(
    const cl_context_properties* /*properties*/, cl_uint /*count*/, const cl_device_id* /*devices*/,
    void(CL_CALLBACK* /*notify*/)(const char*, const void*, size_t, void*), void* /*data*/,
    cl_int* code) {
  return new_object<cl_context>(code);
}

CL_API_ENTRY cl_command_queue CL_API_CALL new_queue(cl_context /*context*/, cl_device_id /*device*/,
                                                    cl_command_queue_properties /*properties*/,
                                                    cl_int* code) {
  return new_object<cl_command_queue>(code);
}

CL_API_ENTRY cl_mem CL_API_CALL no_buffer(cl_context /*context*/, cl_mem_flags /*flags*/,
                                          size_t /*size*/, void* /*host*/, cl_int* code) {
  if (code != nullptr) *code = CL_DEVICE_NOT_AVAILABLE;
  return nullptr;
}

CL_API_ENTRY cl_program CL_API_CALL no_program(cl_context /*context*/, cl_uint /*count*/,
                                               const char** /*texts*/, const size_t* /*sizes*/,
                                               cl_int* code) {
  if (code != nullptr) *code = CL_DEVICE_NOT_AVAILABLE;
  return nullptr;
}

const cl_icd_dispatch& functions() {
  static const cl_icd_dispatch all = [] {
    cl_icd_dispatch made{};
    made.clGetPlatformIDs = platform_ids;
    made.clGetPlatformInfo = platform_info;
    made.clGetDeviceIDs = device_ids;
    made.clGetDeviceInfo = device_info;
    made.clRetainDevice = counted<cl_device_id>;
    made.clReleaseDevice = counted<cl_device_id>;
    made.clCreateContext = new_context;
    made.clRetainContext = counted<cl_context>;
    made.clReleaseContext = counted<cl_context>;
    made.clCreateCommandQueue = new_queue;
    made.clRetainCommandQueue = counted<cl_command_queue>;
    made.clReleaseCommandQueue = counted<cl_command_queue>;
    made.clCreateBuffer = no_buffer;
    made.clCreateProgramWithSource = no_program;
    made.clFinish = counted<cl_command_queue>;
    made.clGetExtensionFunctionAddress = clGetExtensionFunctionAddress;
    return made;
  }();
  return all;
}

}  // namespace

extern "C" CL_API_ENTRY cl_int CL_API_CALL clIcdGetPlatformIDsKHR(cl_uint entries,
                                                                  cl_platform_id* ids,
                                                                  cl_uint* count) {
  return platform_ids(entries, ids, count);
}

extern "C" CL_API_ENTRY cl_int CL_API_CALL clGetPlatformInfo(cl_platform_id id,
                                                             cl_platform_info name, size_t size,
                                                             void* value, size_t* needed) {
  return platform_info(id, name, size, value, needed);
}

extern "C" CL_API_ENTRY void* CL_API_CALL clGetExtensionFunctionAddress(const char* name) {
  const std::string_view wanted(name);
  if (wanted == "clIcdGetPlatformIDsKHR") return reinterpret_cast<void*>(&clIcdGetPlatformIDsKHR);
  if (wanted == "clGetPlatformInfo") return reinterpret_cast<void*>(&platform_info);
  return nullptr;
}

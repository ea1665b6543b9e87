#include "device/handles.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "device/context_impl.hpp"
#include "device/program_source.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::device {

Handles Handles::of(const Context& context) {
  const Context::Impl& impl = *context.impl_;
  return {impl.context(), impl.device(), impl.queue()};
}

cl_mem Handles::of(const Memory& memory) { return memory.handle_->buffer(); }

Memory Handles::borrowed(const Context& context, const char* name, cl_mem buffer,
                         std::size_t bytes) {
  if (buffer == nullptr) throw OptionError(name, "is null; give a buffer");
  const cl::Buffer kept(buffer, true);
  if (kept.getInfo<CL_MEM_TYPE>() != CL_MEM_OBJECT_BUFFER) {
    throw OptionError(name, "is an image; give a buffer");
  }
  if (kept.getInfo<CL_MEM_CONTEXT>()() != context.impl_->context()) {
    throw OptionError(name, "belongs to another context; give a buffer of the device's");
  }
  if (const auto size = kept.getInfo<CL_MEM_SIZE>(); size < bytes) {
    throw OptionError(name, fmt::format("has {} bytes; give at least {}", size, bytes));
  }
  Memory memory;
  memory.bytes_ = bytes;
  memory.handle_ = std::make_shared<Memory::Handle>();
  memory.handle_->buffer = kept;
  return memory;
}

cl_kernel Handles::build(const Context& context, const std::string& source, const std::string& name,
                         const BuildOptions& options) {
  Context::Impl& impl = *context.impl_;
  impl.expect_own_process(fmt::format("building kernel {}", name));
  const std::string line = impl.build_line(options);
  const char* const label = "the caller's source";
  const cl::Program built = impl.builder.build(
      impl.context, impl.device, label, expand_kernel_text(label, source, options.files), line);
  cl_int code = CL_SUCCESS;
  cl::Kernel kernel(built, name.c_str(), &code);
  if (code == CL_INVALID_KERNEL_NAME) {
    throw InputError(fmt::format("the source has no kernel named '{}'", name));
  }
  impl.expect(code, fmt::format("creating kernel {}", name));
  const cl_kernel given = kernel();
  kernel() = nullptr;  // the caller releases it
  return given;
}

}  // namespace qjulia::device

namespace qjulia {
namespace {

/// Throws InputError where a question about a handle is answered by an error.
void expect_answer(cl_int code, const char* what) {
  if (code == CL_SUCCESS) return;
  throw InputError(fmt::format("OpenCL says nothing of the {} ({}); give a valid one", what, code));
}

void expect_handle(const void* handle, const char* what) {
  if (handle == nullptr) throw InputError(fmt::format("the {} is null; give a valid one", what));
}

void check_queue(const cl::CommandQueue& queue, cl_context context, cl_device_id device) {
  cl_int code = CL_SUCCESS;
  const auto queue_context = queue.getInfo<CL_QUEUE_CONTEXT>(&code);
  expect_answer(code, "queue");
  if (queue_context() != context) {
    throw InputError(
        "the queue belongs to another context; make one with clCreateCommandQueue in "
        "the context that is given");
  }
  const auto queue_device = queue.getInfo<CL_QUEUE_DEVICE>(&code);
  expect_answer(code, "queue");
  if (queue_device() != device) {
    throw InputError(
        "the queue belongs to another device; make one with clCreateCommandQueue for "
        "the device that is given");
  }
  const auto properties = queue.getInfo<CL_QUEUE_PROPERTIES>(&code);
  expect_answer(code, "queue");
  if ((properties & CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE) != 0) {
    throw InputError(
        "the queue runs commands out of order; make one without "
        "CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE");
  }
}

/// What `list_devices` says of the device; its numbers are −1 where it is not among these.
DeviceInfo info_of(cl_device_id wanted) {
  const auto platforms = device::platforms();
  for (const DeviceInfo& info : device::take_inventory().devices) {
    const auto devices = device::devices(platforms.at(static_cast<std::size_t>(info.platform)));
    if (devices.at(static_cast<std::size_t>(info.index))() == wanted) return info;
  }
  return device::describe(cl::Device(wanted, true), -1, -1);
}

}  // namespace

Device device_from_opencl(cl_context context, cl_device_id device, cl_command_queue queue) {
  expect_handle(context, "context");
  expect_handle(device, "device");
  expect_handle(queue, "queue");
  cl_int code = CL_SUCCESS;
  const auto devices = cl::Context(context, true).getInfo<CL_CONTEXT_DEVICES>(&code);
  expect_answer(code, "context");
  if (std::ranges::none_of(devices, [&](const cl::Device& d) { return d() == device; })) {
    throw InputError("the device is not in the context; give one of its CL_CONTEXT_DEVICES");
  }
  check_queue(cl::CommandQueue(queue, true), context, device);
  return Device(
      std::make_shared<device::Context>(info_of(device), device::Handles{context, device, queue}));
}

cl_context opencl_context(const Device& device) {
  return device::Handles::of(device.context()).context;
}

cl_device_id opencl_device(const Device& device) {
  return device::Handles::of(device.context()).device;
}

cl_command_queue opencl_queue(const Device& device) {
  return device::Handles::of(device.context()).queue;
}

}  // namespace qjulia

#include "device/context.hpp"

#include "device/context_impl.hpp"
#include "device/handles.hpp"

namespace qjulia::device {

Context::Context(const DeviceInfo& info, const Context* sharing)
    : impl_(std::make_unique<Impl>(info, sharing == nullptr ? nullptr : sharing->impl_.get())) {
  cl_int code = CL_SUCCESS;
  if (sharing != nullptr) {
    sharing->impl_->expect_own_process("opening a queue");
    impl_->device = sharing->impl_->device;
    impl_->context = sharing->impl_->context;
  } else {
    const auto all = devices(platforms().at(static_cast<std::size_t>(info.platform)));
    impl_->device = all.at(static_cast<std::size_t>(info.index));
    impl_->context = cl::Context(impl_->device, nullptr, nullptr, nullptr, &code);
    impl_->expect(code, "clCreateContext");
  }
  impl_->queue = cl::CommandQueue(impl_->context, impl_->device, CL_QUEUE_PROFILING_ENABLE, &code);
  impl_->expect(code, "clCreateCommandQueue");
}

Context::Context(const DeviceInfo& info, const Handles& handles)
    : impl_(std::make_unique<Impl>(info, nullptr)) {
  impl_->device = cl::Device(handles.device, true);
  impl_->context = cl::Context(handles.context, true);
  impl_->queue = cl::CommandQueue(handles.queue, true);
  cl_int code = CL_SUCCESS;
  const auto properties = impl_->queue.getInfo<CL_QUEUE_PROPERTIES>(&code);
  impl_->expect(code, "clGetCommandQueueInfo");
  if ((properties & CL_QUEUE_PROFILING_ENABLE) == 0) impl_->events_have_times = false;
}

Context::~Context() {
  if (impl_->process != ::getpid()) {
    // The queue's work goes on in the process that opened it; here the driver would wait for it
    // without end.
    static_cast<void>(impl_.release());
    return;
  }
  if (impl_->queue()) impl_->queue.finish();
}

const DeviceInfo& Context::info() const { return impl_->info; }

void Context::expect_own_process() const { impl_->expect_own_process("using a device"); }

std::map<std::string, KernelTime> Context::kernel_times() {
  impl_->collect_times();
  return impl_->times;
}

WaitTime Context::wait_time() const { return impl_->waited->value(); }

void Context::record(std::shared_ptr<Trace> trace, Trace::Row row) {
  impl_->collect_times();
  impl_->trace = std::move(trace);
  impl_->row = row;
  impl_->allocated->trace = impl_->trace;
  impl_->allocated->row = row;
  impl_->allocated->tell();
}

const std::shared_ptr<Trace>& Context::trace() const { return impl_->trace; }

void Context::reset_kernel_times() {
  impl_->collect_times();
  impl_->times.clear();
}

}  // namespace qjulia::device

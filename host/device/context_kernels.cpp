/// A context's kernels, built at first use.

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "device/context_impl.hpp"
#include "device/program_source.hpp"
#include "device/quirks.hpp"

namespace qjulia::device {

Kernel Context::kernel(const std::string& file, const std::string& name,
                       const BuildOptions& options) {
  impl_->expect_own_process(fmt::format("building kernel {}", name));
  const std::string line = impl_->build_line(options);
  std::string program_key = file + '\n' + line;
  for (const auto& [unused, included] : options.files) program_key += '\n' + included;
  const std::string key = name + '\n' + program_key;
  if (const auto found = impl_->kernels.find(key); found != impl_->kernels.end()) {
    return found->second;
  }
  auto program = impl_->programs.find(program_key);
  if (program == impl_->programs.end()) {
    const TraceStage stage(impl_->trace, "build " + file);
    const cl::Program built = impl_->builder.build(impl_->context, impl_->device, file,
                                                   expand_kernel_source(file, options.files), line);
    program = impl_->programs.emplace(program_key, built).first;
  }
  Kernel kernel;
  kernel.handle_ = std::make_shared<Kernel::Handle>();
  Kernel::Handle& handle = *kernel.handle_;
  cl_int code = CL_SUCCESS;
  handle.kernel = cl::Kernel(program->second, name.c_str(), &code);
  impl_->expect(code, fmt::format("creating kernel {} of {}", name, file));
  handle.name = name;
  handle.lane_width = options.lane_width;
  handle.precision = options.precision;
  handle.sizer = LaunchSizer(impl_->info);
  handle.argument_count = handle.kernel.getInfo<CL_KERNEL_NUM_ARGS>();
  handle.group = std::clamp<std::size_t>(std::bit_floor(largest_group(kernel)), 1,
                                         preferred_group_size(impl_->info, options.lane_width));
  impl_->kernels.emplace(key, kernel);
  return kernel;
}

std::size_t Context::largest_group(const Kernel& kernel) const {
  const cl::Kernel& built = kernel.handle_->kernel;
  cl_int code = CL_SUCCESS;
  const std::string call = fmt::format("asking about kernel {}", kernel.handle_->name);
  const auto local = built.getWorkGroupInfo<CL_KERNEL_LOCAL_MEM_SIZE>(impl_->device, &code);
  impl_->expect(code, call);
  if (local > impl_->info.local_memory) return 0;
  const auto group = built.getWorkGroupInfo<CL_KERNEL_WORK_GROUP_SIZE>(impl_->device, &code);
  impl_->expect(code, call);
  return std::min<std::size_t>(group, impl_->info.largest_work_group);
}

}  // namespace qjulia::device

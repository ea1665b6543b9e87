/// A context's buffers, and what is copied to them and from them.

#include <fmt/format.h>

#include <algorithm>

#include "base/large_pages.hpp"
#include "device/context_impl.hpp"

namespace qjulia::device {
namespace {

/// Bytes of the largest write that is copied rather than waited for, and of all such copies.
constexpr std::size_t kLargestCopy = std::size_t{1} << 20, kMostCopied = std::size_t{1} << 26;

}  // namespace

/// Uses large pages on a CPU, where buffers lie in the host's memory.
void Context::Impl::use_large_pages(const cl::Buffer& buffer, std::size_t bytes) const {
  constexpr std::size_t kLeast = std::size_t{1} << 22;
  if (info.kind != DeviceKind::cpu || bytes < kLeast) return;
  cl_int code = CL_SUCCESS;
  void* at = queue.enqueueMapBuffer(buffer, CL_TRUE, CL_MAP_WRITE_INVALIDATE_REGION, 0, bytes,
                                    nullptr, nullptr, &code);
  if (code != CL_SUCCESS) return;
  base::use_large_pages(at, bytes);
  expect(queue.enqueueUnmapMemObject(buffer, at), "clEnqueueUnmapMemObject");
}

Memory Context::allocate_bytes(std::size_t bytes) {
  const std::string call = fmt::format("allocating {} bytes", bytes);
  impl_->expect_own_process(call);
  if (bytes > impl_->info.largest_allocation) impl_->expect(CL_INVALID_BUFFER_SIZE, call);
  if (bytes > impl_->info.global_memory - std::min<std::uint64_t>(impl_->allocated->now.load(),
                                                                  impl_->info.global_memory)) {
    impl_->expect(CL_MEM_OBJECT_ALLOCATION_FAILURE, call);
  }
  Memory memory;
  memory.bytes_ = bytes;
  memory.handle_ = std::make_shared<Memory::Handle>();
  cl_int code = CL_SUCCESS;
  // OpenCL has no empty buffer: an empty one of ours holds one unused byte.
  memory.handle_->buffer = cl::Buffer(impl_->context, CL_MEM_READ_WRITE,
                                      std::max<std::size_t>(bytes, 1), nullptr, &code);
  impl_->expect(code, call);
  impl_->use_large_pages(memory.handle_->buffer, bytes);
  memory.handle_->bytes = bytes;
  memory.handle_->allocated = impl_->allocated;
  impl_->allocated->add(bytes);
  return memory;
}

std::size_t Context::peak_allocated_bytes() const { return impl_->allocated->peak; }

void Context::reset_peak_allocated_bytes() {
  impl_->allocated->peak = impl_->allocated->now.load();
}

RealBuffer Context::allocate_real(std::size_t count, Precision precision) {
  return {allocate_bytes(count * real_bytes(precision)), precision};
}

RealBuffer Context::upload_real(std::span<const double> values, Precision precision) {
  RealBuffer buffer = allocate_real(values.size(), precision);
  write(buffer, values);
  return buffer;
}

RealBuffer Context::upload_real(std::span<const float> values) {
  RealBuffer buffer = allocate_real(values.size(), Precision::single);
  write_bytes(buffer, std::as_bytes(values));
  return buffer;
}

void Context::write(const RealBuffer& buffer, std::span<const double> values) {
  if (buffer.precision() == Precision::dbl) {
    write_bytes(buffer, std::as_bytes(values));
    return;
  }
  const std::vector<float> narrow(values.begin(), values.end());
  write_bytes(buffer, std::as_bytes(std::span(narrow)));
}

void Context::read(const RealBuffer& buffer, std::span<double> out) {
  const RealRead one{buffer, out};
  read(std::span(&one, 1));
}

void Context::read(std::span<const RealRead> reads) {
  std::vector<std::vector<float>> narrow;
  std::vector<ByteRead> all;
  for (const RealRead& read : reads) {
    const bool is_narrow = read.from.precision() == Precision::single;
    narrow.emplace_back(is_narrow ? read.to.size() : 0);
    all.push_back({read.from, is_narrow ? std::as_writable_bytes(std::span(narrow.back()))
                                        : std::as_writable_bytes(read.to)});
  }
  read_bytes(all);
  for (std::size_t i = 0; i < reads.size(); ++i) {
    std::ranges::copy(narrow[i], reads[i].to.begin());
  }
}

void Context::write_bytes(const Memory& memory, std::span<const std::byte> bytes) {
  const std::size_t count = bytes.size();
  if (count > memory.bytes()) throw std::logic_error("write past the end of a device buffer");
  if (count == 0) return;
  impl_->expect_own_process("writing to a buffer");
  const cl::Buffer& to = memory.handle_->buffer;
  impl_->waited->add({.transfers = 1});
  if (count > kLargestCopy) {
    const cl_int code = impl_->wait(
        [&] { return impl_->queue.enqueueWriteBuffer(to, CL_TRUE, 0, count, bytes.data()); });
    impl_->expect(code, "clEnqueueWriteBuffer");
    impl_->collect_finished();
    return;
  }
  if (impl_->copied_bytes + count > kMostCopied) impl_->collect_times();
  auto& copy = impl_->copied.emplace_back(bytes.begin(), bytes.end());
  impl_->copied_bytes += count;
  impl_->expect(impl_->queue.enqueueWriteBuffer(to, CL_FALSE, 0, count, copy.data()),
                "clEnqueueWriteBuffer");
}

void Context::read_bytes(const Memory& memory, std::span<std::byte> bytes) {
  const ByteRead one{memory, bytes};
  read_bytes(std::span(&one, 1));
}

void Context::read_bytes(std::span<const ByteRead> reads) {
  std::vector<const ByteRead*> wanted;
  for (const ByteRead& read : reads) {
    if (read.to.size() > read.from.bytes()) {
      throw std::logic_error("read past the end of a device buffer");
    }
    if (!read.to.empty()) wanted.push_back(&read);
  }
  if (wanted.empty()) return;
  impl_->expect_own_process("reading from a buffer");
  impl_->waited->add({.transfers = wanted.size()});
  const auto enqueue = [&](const ByteRead& read, cl_bool blocking) {
    return impl_->queue.enqueueReadBuffer(read.from.handle_->buffer, blocking, 0, read.to.size(),
                                          read.to.data());
  };
  for (const ByteRead* read : std::span(wanted).first(wanted.size() - 1)) {
    const cl_int code = enqueue(*read, CL_FALSE);
    if (code == CL_SUCCESS) continue;
    impl_->queue.finish();  // the earlier ones write to what the caller may free
    impl_->expect(code, "clEnqueueReadBuffer");
  }
  // In a queue in order the last comes last.
  const cl_int code = impl_->wait([&] { return enqueue(*wanted.back(), CL_TRUE); });
  if (code != CL_SUCCESS && wanted.size() > 1) impl_->queue.finish();
  impl_->expect(code, "clEnqueueReadBuffer");
  impl_->collect_finished();
}

}  // namespace qjulia::device

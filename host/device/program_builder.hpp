#pragma once
/// Builds programs: from a compiled one that was kept where that is faster, else from source.

#include <optional>
#include <string>

#include "device/context.hpp"
#include "device/opencl.hpp"
#include "device/program_store.hpp"

namespace qjulia::device {

class ProgramBuilder {
 public:
  explicit ProgramBuilder(const DeviceInfo& info) : info_(info) {}

  /// The compiler's options. @param queue this process's number of the queue.
  /// @throws InputError where the device lacks the precision.
  std::string line(const BuildOptions& options, int queue) const;

  /// @param name of the source, for errors.
  /// @throws KernelBuildError with the compiler's log, or because a process has ended in this build
  ///   before.
  cl::Program build(const cl::Context& context, const cl::Device& device, const std::string& name,
                    const std::string& source, const std::string& line);

 private:
  /// Where programs and markers are kept. Found at the first build.
  struct Place {
    std::optional<std::filesystem::path> folder;  ///< none: nothing is kept
    bool stores = false;                          ///< compiled programs
    bool tries_again = false;                     ///< builds in which a process has ended
  };
  const Place& place();

  DeviceInfo info_;
  std::optional<Place> place_;
};

}  // namespace qjulia::device

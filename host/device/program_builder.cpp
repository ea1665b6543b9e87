#include "device/program_builder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <mutex>

#include "base/build_total.hpp"
#include "base/crash_marker.hpp"
#include "base/kernel_cache.hpp"
#include "base/text.hpp"
#include "device/cache_folder.hpp"
#include "device/quirks.hpp"
#include "qjulia/base/error.hpp"

namespace qjulia::device {
namespace {

/// What a marker says of the build under way.
constexpr std::string_view kFromSource = "source";
constexpr std::string_view kFromBinary = "binary";

std::string owner_of(const DeviceInfo& info) {
  return fmt::format("{}\n{}\n{}\n{}\n{}", info.platform_name, info.vendor, info.name,
                     info.driver_version, info.opencl_version);
}

cl::Program from_source(const cl::Context& context, const cl::Device& device,
                        const DeviceInfo& info, const std::string& name, const std::string& source,
                        const std::string& line) {
  if (compiles_on_disk(info)) {
    for (const auto problem : {base::unwritable_cache, base::full_cache}) {
      if (const std::string text = problem(); !text.empty()) {
        throw KernelBuildError(
            fmt::format("cannot compile {} for '{}': {}", name, info.name, text));
      }
    }
  }
  cl::Program built(context, source_for(info, source));
  if (const cl_int code = built.build(device, line.c_str()); code != CL_SUCCESS) {
    throw KernelBuildError(fmt::format("{} did not build for '{}' with options {}\n{}", name,
                                       info.name, line,
                                       built.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device)));
  }
  return built;
}

/// None where the driver takes it no longer, or a kernel is missing.
std::optional<cl::Program> from_binary(const cl::Context& context, const cl::Device& device,
                                       const StoredProgram& stored, const std::string& line) {
  cl_int code = CL_SUCCESS;
  const cl::Program::Binaries binaries{{stored.binary.begin(), stored.binary.end()}};
  cl::Program built(context, {device}, binaries, nullptr, &code);
  if (code != CL_SUCCESS || built.build(device, line.c_str()) != CL_SUCCESS) return std::nullopt;
  for (const std::string& name : stored.kernels) {
    const cl::Kernel kernel(built, name.c_str(), &code);
    if (code != CL_SUCCESS) return std::nullopt;
  }
  return built;
}

/// None where the driver does not hand it out.
std::optional<StoredProgram> compiled(const cl::Program& built, const cl::Device& device) {
  cl_int code = CL_SUCCESS;
  const auto devices = built.getInfo<CL_PROGRAM_DEVICES>(&code);
  const auto binaries = built.getInfo<CL_PROGRAM_BINARIES>(&code);
  const auto names = built.getInfo<CL_PROGRAM_KERNEL_NAMES>(&code);
  if (code != CL_SUCCESS || devices.size() != binaries.size()) return std::nullopt;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (devices[i]() != device() || binaries[i].empty()) continue;
    return StoredProgram{base::split(names, ';'), {binaries[i].begin(), binaries[i].end()}};
  }
  return std::nullopt;
}

/// What build_total returns.
class CountedBuilds {
 public:
  void add(const base::BuildTotal& more) {
    const std::lock_guard lock(mutex_);
    total_.compiled += more.compiled;
    total_.loaded += more.loaded;
    total_.replaced += more.replaced;
    total_.seconds += more.seconds;
  }
  base::BuildTotal value() const {
    const std::lock_guard lock(mutex_);
    return total_;
  }

 private:
  mutable std::mutex mutex_;
  base::BuildTotal total_;
};

CountedBuilds& counted_builds() {
  static CountedBuilds builds;
  return builds;
}

[[noreturn]] void refuse_crashed(const std::string& name, const DeviceInfo& info,
                                 const std::filesystem::path& marker) {
  throw KernelBuildError(fmt::format(
      "{} is not compiled for '{}' (driver {}), because the last process that tried ended before "
      "it was done: the driver's compiler has probably crashed. To try again, remove '{}', or run "
      "'qjulia doctor', which compiles in a process of its own. A newer driver is always tried",
      name, info.name, info.driver_version, marker.string()));
}

}  // namespace

std::string ProgramBuilder::line(const BuildOptions& options, int queue) const {
  if (options.precision == Precision::dbl && !info_.has_double) {
    throw InputError(
        fmt::format("device '{}' has no double precision (cl_khr_fp64); use single "
                    "precision or another device",
                    info_.name));
  }
  std::string line = fmt::format("-cl-std=CL1.2 -DQJ_WIDTH={} -DQJ_DOUBLE={}", options.lane_width,
                                 options.precision == Precision::dbl ? 1 : 0);
  for (const auto& [macro, value] : options.defines) line += fmt::format(" -D{}={}", macro, value);
  if (queue > 0 && needs_kernels_of_its_own(info_)) {
    line += fmt::format(" -DQJ_QUEUE={}", queue);  // no kernel asks for it
  }
  return line;
}

const ProgramBuilder::Place& ProgramBuilder::place() {
  if (place_) return *place_;
  Place found;
  const std::string stores =
      environment_word("QJULIA_BINARIES", {"auto", "on", "off"},
                       "auto, to keep compiled programs where that is faster, on or off");
  found.stores = stores == "on" || (stores == "auto" && gains_by_stored_programs(info_));
  found.tries_again = environment_word("QJULIA_CRASHED_BUILDS", {"skip", "retry"},
                                       "skip, or retry, to try them again") == "retry";
  if (found.stores || may_crash_in_builds(info_)) {
    try {
      found.folder = cache_folder() / "programs";
      std::filesystem::create_directories(*found.folder);
    } catch (const Error&) {
      found.folder = {};  // there is no such place
    } catch (const std::filesystem::filesystem_error&) {
      found.folder = {};
    }
  }
  place_ = found;
  return *place_;
}

cl::Program ProgramBuilder::build(const cl::Context& context, const cl::Device& device,
                                  const std::string& name, const std::string& source,
                                  const std::string& line) {
  const auto begin = std::chrono::steady_clock::now();
  const auto count = [&](base::BuildTotal one) {
    one.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    counted_builds().add(one);
  };
  const Place& at = place();
  if (!at.folder) {
    cl::Program built = from_source(context, device, info_, name, source, line);
    count({.compiled = 1});
    return built;
  }
  const ProgramKey key{owner_of(info_), line, source};
  const ProgramStore store(*at.folder);
  std::optional<base::CrashMarker> marker;
  if (may_crash_in_builds(info_)) marker.emplace(*at.folder / (key.name() + ".building"));
  const bool crashed = marker && marker->left() == kFromSource;
  if (crashed && !at.tries_again) {
    refuse_crashed(name, info_, *at.folder / (key.name() + ".building"));
  }
  std::error_code ignored;
  const bool has_file = at.stores && std::filesystem::exists(store.file(key), ignored);
  // What a process has crashed over is as good as damaged.
  if (has_file && !(marker && marker->left() == kFromBinary)) {
    if (const auto stored = store.load(key)) {
      if (marker) marker->mark(kFromBinary);
      if (const auto built = from_binary(context, device, *stored, line)) {
        count({.loaded = 1});
        return *built;
      }
    }
  }
  if (marker) marker->mark(kFromSource);
  cl::Program built = from_source(context, device, info_, name, source, line);
  if (at.stores) {
    if (const auto program = compiled(built, device)) store.save(key, *program);
  }
  count({.compiled = 1, .replaced = has_file ? 1 : 0});
  return built;
}

}  // namespace qjulia::device

qjulia::base::BuildTotal qjulia::base::build_total() { return device::counted_builds().value(); }

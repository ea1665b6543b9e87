#pragma once
/// One run of a command: what it says, when it is to stop, how long it has run.

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/output_check.hpp"
#include "console/console.hpp"
#include "console/interrupts.hpp"
#include "describe/job.hpp"
#include "describe/options.hpp"
#include "profile/command_profile.hpp"
#include "qjulia/device/device.hpp"
#include "qjulia/mesh/mesh.hpp"

namespace qjulia::tools {

/// The files that a command reads and writes, known before it does anything.
struct Plan {
  std::vector<std::filesystem::path> inputs;
  std::vector<base::Output> outputs;
  /// Inputs that no option names, by what the job calls them: the map of a film's script.
  std::map<std::string, std::filesystem::path> further_inputs{};
};

/// What runs a job inside another command, or inside another program.
struct JobPlace {
  std::optional<Device> device{};  ///< none: the job opens one itself
  ProgressMonitor monitor{};       ///< is shown its progress, and stops it
};

class Session {
  // The signals are blocked before anything can start a thread.
  std::unique_ptr<Interrupts> interrupts_;
  JobPlace place_;
  std::stop_token stop_;

 public:
  /// Of the program's own command: signals stop it, and it speaks to the terminal.
  /// @param trace_file where `finish` writes a trace; empty: nowhere.
  /// @param profile_file where it writes the command's profile; empty: nowhere.
  Session(const Verbosity& verbosity, std::string trace_file, std::string profile_file);
  /// Of a job that runs inside another command: what it says goes to `said`.
  Session(JobPlace place, Said& said);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Asked to stop where a signal has come, or whoever runs the job wants it no more.
  std::stop_token stop() const { return stop_; }

  /// Wall time since the command started.
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  /// What the command was asked to make; to be called before anything else.
  void begin(Job job) { job_ = std::move(job); }
  /// The job given to `begin`. Its inputs have hashes after `check_outputs`, and it has its device
  /// after `open_device`.
  const Job& job() const { return job_; }
  /// Checks all that a command reads and writes, with the trace, before any work. Pipes among the
  /// outputs are waited for until somebody reads them, as a shell's '>' does. @throws InputError,
  /// OutputError, Interrupted
  void check_outputs(const Plan& plan);
  /// Where progress goes and stop requests come from; stages go to the trace. Valid as long as this
  /// session.
  ProgressMonitor monitor();
  /// Reads a map. @throws InputError
  Map read_map(const std::string& file);
  /// Reads a mesh, and warns of what is wrong with it. @throws InputError
  TriangleMesh read_mesh(const std::string& file) { return read_mesh(file, stop()); }
  TriangleMesh read_mesh(const std::string& file, const std::stop_token& stop);
  /// Chooses a device, with the settings kept for it, says which, and tests it where that is due;
  /// or the one that the job was given.
  /// @throws NoDeviceError
  Device open_device(const TrustedDevice& wanted);
  /// Before the first use of a GPU, unless it is trusted: tests it, and warns of what fails. The
  /// test's launches are in no trace or profile of this command, nor in the device's kernel times.
  /// @throws Interrupted
  void expect_right_results(const Device& device, const TrustedDevice& wanted);
  /// What is traced, if anything is.
  const std::shared_ptr<Trace>& trace() const { return trace_; }
  /// Cancels the trace: another process of this run, the first rank, writes it.
  void leave_trace() { trace_ = {}; }
  /// Writes trace and profile, where they are wanted and the command came as far as
  /// `check_outputs`.
  /// @throws OutputError
  void finish();
  /// With --verbose: how long each kernel ran on the device.
  void report_kernels(const Device& device);

  Console console;
  std::string written_so_far = "nothing was written";  ///< what an interrupted command says

 private:
  void write_profile(double seconds);
  /// Where a profile is wanted, measures the device before the command uses it.
  void start_meter(const Device& device);

  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  Job job_;
  std::string trace_file_, profile_file_;
  bool are_outputs_checked_ = false;
  std::vector<int> pipes_;  ///< outputs; open, so that readers wait
  std::shared_ptr<Trace> trace_;
  std::optional<Device> traced_;
  WaitTime untraced_wait_;  ///< for `traced_`, before its trace began
  std::unique_ptr<profiling::LaunchCounter> counter_;
  std::unique_ptr<profiling::CommandMeter> meter_;
  double meter_seconds_ = 0;  ///< that it took, and the command did not
};

/// The warning of a profile that other programs disturbed.
std::string busy_text(const std::vector<std::string>& signs);

/// How long a device was waited for, and what that took.
std::string describe(const WaitTime& waited);

/// "0:0 cpu NAME".
std::string describe(const DeviceInfo& info);

}  // namespace qjulia::tools

#pragma once
/// Where in compiled kernels the threads of a CPU's driver are, sampled by their CPU time.

#include <functional>
#include <map>
#include <memory>
#include <string>

#include "profile/worker_clock.hpp"
#include "qjulia/profile/instruction_mix.hpp"

namespace qjulia::profiling {

/// The mixes of kernels, by name.
struct KernelMixes {
  std::map<std::string, InstructionMix> mixes;
  std::string problem;        ///< why there are none, and what to do; empty where there are some
  bool sees_kernels = false;  ///< whether a thread was in a kernel's file at all
};

/// Samples while it lives. One at a time samples; a second one finds nothing.
class CodeSampler {
 public:
  /// @param clock of the threads; null: nothing is sampled.
  explicit CodeSampler(const std::shared_ptr<const WorkerClock>& clock);
  ~CodeSampler();
  CodeSampler(const CodeSampler&) = delete;
  CodeSampler& operator=(const CodeSampler&) = delete;

  /// Whether any thread is sampled.
  bool is_sampling() const;
  /// Of kernels that the driver keeps as files of machine code, as PoCL does, and that were seen
  /// often enough.
  KernelMixes mixes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;  ///< null: it does not sample
};

/// What the kernels of a run are made of: it is repeated until they were seen often enough.
KernelMixes sampled_code(const std::shared_ptr<const WorkerClock>& clock,
                         const std::function<void()>& run);

}  // namespace qjulia::profiling

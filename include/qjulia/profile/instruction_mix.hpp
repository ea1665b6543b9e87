#pragma once
/// What the compiler of a CPU's driver made of a kernel: the instructions of the loop that takes
/// most of its time.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>

namespace qjulia {

/// Vector instructions of the loop in which most samples of a kernel lie, or of the whole kernel
/// where most lie in no loop. An instruction that loads an operand counts as a load too.
struct InstructionMix {
  int multiply_adds = 0;    ///< fused
  int multiplications = 0;  ///< alone
  int divisions = 0;        ///< and roots
  int others = 0;           ///< that compute: sums, shuffles, comparisons, conversions
  int loads = 0;            ///< of vectors and of scalars in vector registers, from anywhere
  int stores = 0;
  int spills = 0;           ///< those of the loads and stores that use the stack
  int slot_bytes = 0;       ///< of the registers of multiply-adds, multiplications and divisions
  int data_bytes = 0;       ///< of loads and stores that do not use the stack
  double time_share = 0;    ///< of the kernel's time in this loop
  std::size_t samples = 0;  ///< of the kernel

  /// What a launch's slots count.
  int slots() const { return multiply_adds + multiplications + divisions; }
  int operations() const { return slots() + others; }
  /// The share of the multiply-add limit that it can reach if every operation takes as long.
  double ceiling() const {
    return operations() > 0 ? static_cast<double>(slots()) / operations() : 0;
  }
};

nlohmann::json to_json(const InstructionMix& mix);

}  // namespace qjulia

#pragma once
/// Instructions of the loops that take a GPU's time, a pair of a sample and a factor: what the
/// compiled code has for gfx906 in single precision (tests/lint/gpu.py counts and checks them).

namespace qjulia::profiling {

struct LoopCounts {
  int fma;      ///< multiply-adds, products and sums
  int special;  ///< reciprocals, roots
  int loads;    ///< from memory, most of them one for a whole wave
  int other;    ///< comparisons, selections, integers, addresses
};

// counted
constexpr LoopCounts kLogNorm{.fma = 18, .special = 0, .loads = 5, .other = 20};
constexpr LoopCounts kVersor{.fma = 50, .special = 1, .loads = 10, .other = 75};
constexpr LoopCounts kPotentialGradient{.fma = 30, .special = 1, .loads = 5, .other = 40};
constexpr LoopCounts kStep{.fma = 50, .special = 1, .loads = 8, .other = 93};
constexpr LoopCounts kPullBack{.fma = 114, .special = 3, .loads = 7, .other = 91};
constexpr LoopCounts kPullBackLast{.fma = 33, .special = 2, .loads = 3, .other = 66};
// end

/// Full-rate instructions that pass while the special-function unit takes one: a quarter of the
/// lanes at most, on NVIDIA since compute capability 8.6 (CUDA C++ Programming Guide, "Arithmetic
/// Instructions") and on AMD.
constexpr int kSpecialSlots = 4;

/// Slots of a GPU's issue that a pair takes in a loop.
constexpr int slots(const LoopCounts& loop) {
  return loop.fma + loop.other + loop.loads + kSpecialSlots * loop.special;
}

}  // namespace qjulia::profiling

#pragma once
/// Which instructions a kernel's time goes into.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "qjulia/profile/instruction_mix.hpp"

namespace qjulia::profiling {

/// How often a program was seen at an address of its file.
using AddressCounts = std::map<std::uint64_t, std::size_t>;

/// The mix of the innermost loop that holds most of the samples.
/// @param text what `objdump -dw` prints of x86-64 code.
/// @return none where no sample lies in the text.
std::optional<InstructionMix> instruction_mix(std::string_view text, const AddressCounts& samples);

/// What objdump prints of a file.
struct Disassembly {
  std::string text;
  std::string problem;  ///< why there is none, and what to do; empty where there is
};
Disassembly disassembled(const std::filesystem::path& file);

}  // namespace qjulia::profiling

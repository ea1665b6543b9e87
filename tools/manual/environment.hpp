#pragma once
/// The variables that commands read from their environment, and the files that they keep of their
/// own accord.

#include <span>

#include "describe/usage.hpp"

namespace qjulia::manual {

/// Commands that something is about.
enum class Concern { all, computing };

struct Entry {
  const char* name;
  const char* text;  ///< whole sentences
  Concern concern;
};

std::span<const Entry> environment();
std::span<const Entry> files();

/// Whether an entry is about a command: those that compute have a --device.
bool is_about(const Entry& entry, const tools::CommandUsage& command);

}  // namespace qjulia::manual

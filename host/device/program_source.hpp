#pragma once
#include <string>

namespace qjulia::device {

/// The embedded kernel file `name` (say "energy.cl") with every `#include "…"` replaced by the file
/// it names, once each, and `#line` marks so that a build log names the real file and line.
/// @throws KernelBuildError when a file is missing.
std::string expand_kernel_source(const std::string& name);

}  // namespace qjulia::device

#pragma once
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace qjulia::device {

/// Kernel sources by path from the repository root; generated at build time.
const std::map<std::string, std::string_view, std::less<>>& embedded_kernels();

/// The embedded kernel file `name` (say "energy.cl") with every `#include "…"` replaced by the file
/// it names, once each, and `#line` marks so that a build log names the real file and line. For an
/// `#include NAME` the file is `files[NAME]`, or else the one that the source itself has set
/// before:
/// `#define NAME "…"`.
/// @throws KernelBuildError when a file is missing.
std::string expand_kernel_source(const std::string& name,
                                 const std::map<std::string, std::string>& files = {});

/// Expands a text that is not embedded itself; build logs call it `label`.
std::string expand_kernel_text(const std::string& label, std::string_view text,
                               const std::map<std::string, std::string>& files = {});

}  // namespace qjulia::device

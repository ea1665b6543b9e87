#include "device/program_source.hpp"

#include <fmt/format.h>

#include <set>
#include <sstream>

#include "device/embedded_kernels.hpp"
#include "qjulia/error.hpp"

namespace qjulia::device {
namespace {

/// Where an include's name is looked for, in this order.
constexpr const char* kFolders[] = {"kernels/", "include/"};

std::string find_path(const std::string& name) {
  for (const char* folder : kFolders) {
    std::string path = folder + name;
    if (embedded_kernels().contains(path)) return path;
  }
  throw KernelBuildError(fmt::format("no kernel file named '{}' is part of this build", name));
}

void append_file(const std::string& path, std::set<std::string>& seen, std::string& out) {
  if (!seen.insert(path).second) return;
  out += fmt::format("#line 1 \"{}\"\n", path);
  std::istringstream lines{std::string(embedded_kernels().find(path)->second)};
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    constexpr std::string_view kInclude = "#include \"";
    if (line.starts_with(kInclude)) {
      const auto end = line.find('"', kInclude.size());
      append_file(find_path(line.substr(kInclude.size(), end - kInclude.size())), seen, out);
      out += fmt::format("#line {} \"{}\"\n", number + 1, path);
    } else if (line != "#pragma once") {
      out += line + '\n';
    } else {
      out += '\n';
    }
  }
}

}  // namespace

std::string expand_kernel_source(const std::string& name) {
  std::string out;
  std::set<std::string> seen;
  append_file(find_path(name), seen, out);
  return out;
}

}  // namespace qjulia::device

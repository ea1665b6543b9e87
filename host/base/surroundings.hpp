#pragma once
/// Properties of a machine, or of the container that a process runs in, that keep OpenCL from its
/// devices.

#include <filesystem>
#include <string>
#include <vector>

namespace qjulia::base {

struct Finding {
  std::string kind;  ///< container, wsl, flatpak, permission or drivers
  std::string path;  ///< what was looked at
  std::string text;  ///< what is wrong, and what to do
};

/// All findings that apply: containers without device nodes, Windows' Subsystem for Linux, flatpak,
/// nodes of GPUs that this process may not open, no list of drivers. Empty if no problem is found.
/// @param root the folder that stands for `/`.
std::vector<Finding> surroundings(const std::filesystem::path& root = "/");

}  // namespace qjulia::base

#pragma once
/// Properties of a machine, or of the container that a process runs in, that keep OpenCL from its
/// devices.

#include <filesystem>
#include <string>
#include <vector>

namespace qjulia::base {

struct Finding {
  std::string kind;  ///< container, wsl, flatpak, permission, drivers, library or cache
  std::string path;  ///< what was looked at
  std::string text;  ///< what is wrong, and what to do
};

/// All findings that apply: containers without device nodes, Windows' Subsystem for Linux, flatpak,
/// nodes of GPUs that this process may not open, no list of drivers, drivers whose library cannot
/// be loaded, a folder that PoCL cannot write its kernels to. Empty if no problem is found.
/// @param root the folder that stands for `/`, in which drivers are listed.
std::vector<Finding> surroundings(const std::filesystem::path& root = "/");

/// Whether a monitor is connected to the GPU at this PCI address ("0000:01:00.0"), as Linux lists
/// connectors in /sys/class/drm. Empty address: to any GPU of the machine.
/// @param root the folder that stands for `/`.
bool draws_screen(const std::string& pci_address, const std::filesystem::path& root = "/");

}  // namespace qjulia::base

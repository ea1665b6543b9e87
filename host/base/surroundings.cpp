#include "base/surroundings.hpp"

#include <dlfcn.h>
#include <fmt/format.h>
#include <grp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "base/kernel_cache.hpp"
#include "base/text.hpp"

namespace qjulia::base {
namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// Files of a folder whose names begin and end so, sorted; empty where there is no such folder.
std::vector<fs::path> files_in(const fs::path& folder, const std::string& begin,
                               const std::string& end = "") {
  std::vector<fs::path> found;
  std::error_code error;
  for (auto at = fs::directory_iterator(folder, error); !error && at != fs::directory_iterator();
       at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with(begin) && name.ends_with(end)) found.push_back(at->path());
  }
  std::ranges::sort(found);
  return found;
}

/// The nodes by which drivers reach GPUs, as far as they are there.
std::vector<fs::path> gpu_nodes(const fs::path& root) {
  std::vector<fs::path> nodes = files_in(root / "dev/dri", "renderD");
  for (const char* const name : {"dev/kfd", "dev/dxg"}) {
    if (is_there(root / name)) nodes.push_back(root / name);
  }
  std::ranges::move(files_in(root / "dev", "nvidia"), std::back_inserter(nodes));
  std::erase_if(nodes, [](const fs::path& node) {
    std::error_code ignored;
    return fs::is_directory(node, ignored);  // nvidia-caps
  });
  return nodes;
}

/// The folder's or file's name by which the loader finds drivers.
fs::path driver_list(const fs::path& root) {
  const char* const own = std::getenv("OCL_ICD_VENDORS");
  return own != nullptr && *own != '\0' ? fs::path(own) : root / "etc/OpenCL/vendors";
}

/// The files that name drivers' libraries.
std::vector<fs::path> driver_files(const fs::path& list) {
  std::error_code ignored;
  if (fs::is_directory(list, ignored)) return files_in(list, "", ".icd");
  return list.extension() == ".icd" && is_there(list) ? std::vector{list} : std::vector<fs::path>{};
}

bool lists_drivers(const fs::path& list) {
  if (std::getenv("OCL_ICD_FILENAMES") != nullptr) return true;  // drivers by name, in any folder
  std::error_code ignored;
  return fs::is_directory(list, ignored) ? !driver_files(list).empty() : is_there(list);
}

/// The library that such a file names, in its first line.
std::string library_of(const fs::path& file) {
  std::string name;
  std::getline(std::ifstream(file), name);
  return name.substr(0, name.find_last_not_of(" \t\r") + 1);
}

/// A node's path as this machine's user knows it: below the root.
std::string name_of(const fs::path& node, const fs::path& root) {
  return (fs::path("/") / node.lexically_relative(root)).string();
}

bool is_container(const fs::path& root) {
  return is_there(root / ".dockerenv") || is_there(root / "run/.containerenv");
}

std::string group_name(gid_t group) {
  std::array<char, 4096> text{};
  struct group entry {};
  struct group* found = nullptr;
  const bool is_known =
      ::getgrgid_r(group, &entry, text.data(), text.size(), &found) == 0 && found != nullptr;
  return is_known ? found->gr_name : std::to_string(group);
}

/// What lets this process open a node that it may not open.
std::string remedy(const struct stat& node, const std::string& name, const fs::path& root) {
  constexpr mode_t kGroupMay = S_IRGRP | S_IWGRP;
  const std::string group = group_name(node.st_gid);
  if ((node.st_mode & kGroupMay) != kGroupMay) {
    return fmt::format(
        "no group may open it: give it one with 'sudo chgrp render {0} && sudo chmod 660 {0}', and "
        "a udev rule that keeps it so, or start the driver's own service for it",
        name);
  }
  if (is_container(root)) {
    return fmt::format("start the container with '--group-add {}' (the group '{}')", node.st_gid,
                       group);
  }
  return fmt::format(
      "it belongs to the group '{0}': 'sudo usermod -aG {0} $USER', then log in again", group);
}

void add_permissions(const fs::path& root, std::vector<Finding>& found) {
  for (const fs::path& node : gpu_nodes(root)) {
    struct stat state {};
    if (::access(node.c_str(), R_OK | W_OK) == 0 || ::stat(node.c_str(), &state) != 0) continue;
    const std::string name = name_of(node, root);
    found.push_back(
        {"permission", name,
         fmt::format("this user may not open {}; {}", name, remedy(state, name, root))});
  }
}

void add_container(const fs::path& root, std::vector<Finding>& found) {
  if (!is_container(root) || !gpu_nodes(root).empty()) return;
  const char* const sign = is_there(root / ".dockerenv") ? "/.dockerenv" : "/run/.containerenv";
  found.push_back(
      {"container", sign,
       fmt::format("this is a container ({}) to which no GPU was passed: start it with '--device "
                   "/dev/dri' (Intel, AMD), with '--device /dev/dri --device /dev/kfd' (AMD's "
                   "ROCm) or with '--gpus all' (NVIDIA's container toolkit, for /dev/nvidia*)",
                   sign)});
}

void add_wsl(const fs::path& root, std::vector<Finding>& found) {
  std::string kernel;
  std::getline(std::ifstream(root / "proc/version"), kernel);
  const bool has_node = is_there(root / "dev/dxg");
  if (!has_node && lower_case(kernel).find("microsoft") == std::string::npos) return;
  found.push_back(
      {"wsl", has_node ? "/dev/dxg" : "/proc/version",
       fmt::format(
           "this is Windows' Subsystem for Linux, which shows GPUs by /dev/dxg ({}): an Intel GPU "
           "needs 'apt-get install intel-opencl-icd'; NVIDIA's driver has no OpenCL there "
           "(microsoft/WSL, issue 6951): use PoCL, which runs on the CPU ('apt-get install "
           "pocl-opencl-icd'), or run qjulia on a Linux machine with NVIDIA's driver",
           has_node ? "it is there"
                    : "it is not there: 'wsl --update', version 2, and a GPU driver in Windows")});
}

void add_flatpak(const fs::path& root, std::vector<Finding>& found) {
  if (!is_there(root / ".flatpak-info")) return;
  found.push_back(
      {"flatpak", "/.flatpak-info",
       "this is a flatpak, which sees neither the host's drivers nor its devices: pass /dev/dri "
       "with 'flatpak override --user --device=dri' (NVIDIA: --device=all, for /dev/nvidia*), and "
       "install the runtime's extension org.freedesktop.Platform.GL of the GPU's driver, whose ICD "
       "files are in /usr/lib/*/GL/OpenCL/vendors; name another folder of them with "
       "OCL_ICD_VENDORS"});
}

void add_drivers(const fs::path& root, std::vector<Finding>& found) {
  const fs::path list = driver_list(root);
  if (lists_drivers(list)) return;
  const bool is_own = list != root / "etc/OpenCL/vendors";
  const std::string name = is_own ? list.string() : name_of(list, root);
  std::string text = fmt::format(
      "no OpenCL driver is listed: '{}'{} holds no .icd file; install a driver: 'apt-get install "
      "pocl-opencl-icd' runs on any CPU, a GPU needs its vendor's OpenCL package",
      name, is_own ? ", which OCL_ICD_VENDORS names," : "");
  if (is_container(root)) {
    text +=
        ". Install it in the container's image, since it does not see the host's drivers; for "
        "NVIDIA write 'libnvidia-opencl.so.1' into /etc/OpenCL/vendors/nvidia.icd and start it "
        "with '-e NVIDIA_DRIVER_CAPABILITIES=compute,utility'";
  }
  found.push_back({"drivers", name, text});
}

void add_libraries(const fs::path& root, std::vector<Finding>& found) {
  for (const fs::path& file : driver_files(driver_list(root))) {
    const std::string library = library_of(file);
    // It stays loaded: PoCL registers its options with LLVM, which outlives it, and a second time
    // LLVM ends the process.
    if (::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL) != nullptr) continue;
    const char* const problem = ::dlerror();
    found.push_back(
        {"library", file.string(),
         fmt::format("the OpenCL driver that '{}' names, '{}', cannot be loaded ({}); install the "
                     "driver again, or remove the .icd file where it is no longer wanted",
                     file.string(), library, problem == nullptr ? "unknown reason" : problem)});
  }
}

void add_cache(const fs::path& root, std::vector<Finding>& found) {
  const auto is_pocl = [](const fs::path& file) {
    return library_of(file).find("pocl") != std::string::npos;
  };
  if (std::ranges::none_of(driver_files(driver_list(root)), is_pocl)) return;
  const std::string problem = unwritable_cache();
  if (!problem.empty()) found.push_back({"cache", kernel_cache().folder.string(), problem});
}

}  // namespace

std::vector<Finding> surroundings(const fs::path& root) {
  std::vector<Finding> found;
  add_permissions(root, found);
  add_container(root, found);
  add_wsl(root, found);
  add_flatpak(root, found);
  add_drivers(root, found);
  add_libraries(root, found);
  add_cache(root, found);
  return found;
}

bool draws_screen(const std::string& pci_address, const fs::path& root) {
  return std::ranges::any_of(files_in(root / "sys/class/drm", "card"), [&](const fs::path& entry) {
    std::string status;
    std::ifstream(entry / "status") >> status;  // of connectors, such as card0-HDMI-A-1
    if (status != "connected") return false;
    if (pci_address.empty()) return true;
    // The connector's device is the card, whose device is the one on the bus.
    std::error_code error;
    const fs::path bus = fs::canonical(entry / "device/device", error);
    return !error && bus.filename() == pci_address;
  });
}

}  // namespace qjulia::base
